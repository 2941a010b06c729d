//! A differentiable rasterizer of 3D Gaussians on the CPU, and the photometric loss that trains through it.
//!
//! ```
//! use lgs_core::{Camera, GaussianCloud};
//! use lgs_render::{ImageCotangents, Splats, rasterize, rasterize_vjp};
//! let cloud = GaussianCloud::isotropic(vec![[0.0; 3]], 0.2, [0.9, 0.4, 0.1], 0.8);
//! let camera = Camera::look_at([0.0, -3.0, 0.0], [0.0; 3], 0.8, 32, 32);
//! let splats = Splats::from(&cloud);
//! let drawn = rasterize(&splats, &camera, [1.0; 3]);
//! assert!(drawn.transmittance[16 * 32 + 16] < 0.3);
//! let v_image = vec![[1.0; 3]; 32 * 32];
//! let v = ImageCotangents { image: &v_image, transmittance: &vec![0.0; 32 * 32] };
//! let v = rasterize_vjp(&splats, &camera, &drawn, v);
//! assert!(v.raw_opacities[0] < 0.0, "covering a white background darkens the image");
//! ```
//!
//! Not here: optimisers, densification, culling by the caller's rules, and anything that knows of time.

mod backward;
mod blend;
mod blend_jvp;
mod blend_vjp;
pub mod exponential;
mod extent;
mod forward_mode;
mod image_part;
mod pack;
mod photometric;
mod project;
mod project_jvp;
mod project_vjp;
mod projected;
mod rasterize;
pub mod reference;
mod sh;
mod simd;
mod splats;
mod ssim;
pub mod tensor;
mod tile_list;
mod tiles;
mod transpose;
mod view;
mod window;

pub use backward::{ImageCotangents, RasterizedVjp, rasterize_vjp};
pub use forward_mode::{ImageTangent, rasterize_jvp};
pub use image_part::ImagePart;
pub use photometric::{
    DEFAULT_LAMBDA, PhotometricVjp, mse, photometric, photometric_vjp, psnr, ssim, ssim_vjp,
};
pub use project_jvp::AffineMotion;
pub use projected::{ALPHA_MAX, ALPHA_MIN, BLUR, MIP_VARIANCE, TRANSMITTANCE_STOP};
pub use rasterize::{Rasterized, rasterize, rasterize_part};
pub use splats::{SplatGradients, Splats};
