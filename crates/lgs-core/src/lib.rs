//! Values and geometry that every other crate shares: cameras, Gaussian clouds, images, nearest neighbours
//! and seeded random streams.
//!
//! ```
//! use lgs_core::{Camera, GaussianCloud};
//! let camera = Camera::look_at([0.0, -3.0, 1.0], [0.0; 3], 0.8, 64, 48);
//! let cloud = GaussianCloud::isotropic(vec![[0.0; 3]], 0.1, [0.5; 3], 0.9);
//! assert_eq!(cloud.len(), 1);
//! let (pixel, depth) = camera.pixel_from_world([0.0; 3]);
//! assert!((pixel[0] - 32.0).abs() < 1e-3 && depth > 3.0);
//! ```
//!
//! Invariant: no files, no threads, no clock and no global state. A position is `[f32; 3]` in world units, a
//! rotation is a quaternion `[w, x, y, z]`, and raw (pre-activation) parameters say so in their names.

mod camera;
mod cloud;
mod exposure;
mod gauge;
pub mod geometry;
pub mod harmonics;
mod image;
pub mod linear;
mod neighbors;
pub mod optim;
pub mod prefetch;
mod spatial;
mod statistics;
mod streams;
pub mod testing;
pub mod thresholds;
mod turned_harmonics;

pub use camera::{Camera, DEFAULT_NEAR, PixelFilter};
pub use cloud::{CloudError, GaussianCloud, sh_coefficients};
pub use exposure::Exposure;
pub use gauge::Gauge;
pub use harmonics::SH_C0;
pub use image::{Image, psnr_of_mse};
pub use neighbors::{k_nearest, mean_squared_neighbor_distance, nearest_indices};
pub use spatial::spatial_order;
pub use statistics::{holding, median};
pub use streams::{Stream, stream};
pub use turned_harmonics::TurnedHarmonics;
