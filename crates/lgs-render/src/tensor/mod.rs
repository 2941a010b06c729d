//! The rasterizer and the photometric loss as differentiable Burn operations.
//!
//! A tensor on an autodiff device gets a graph node whose backward pass is the crate's own vector–Jacobian
//! product: the forward pass keeps projections, tile lists and final transmittances, and nothing is rendered
//! twice. Image and transmittance leave the operation as one `[H, W, 4]` tensor, since a node has one output,
//! and are sliced apart here.

#[cfg(feature = "gpu")]
mod cube;
mod loss;
mod ops;

use burn::backend::Dispatch;
use burn::tensor::{Device, Int, Tensor};

pub use loss::{PhotometricCall, PhotometricKernels, PhotometricOps};
pub use ops::{Drawn, RasterKept, RasterKernels, RasterOps, SplatPrimitives, ViewSpec};

/// Gaussians as tensors of raw parameters.
#[derive(Clone, Debug)]
pub struct SplatTensors {
    /// Centres `[n, 3]`, world units.
    pub means: Tensor<2>,
    /// Quaternions `[n, 4]`, w first, normalised inside.
    pub rotations: Tensor<2>,
    /// Logarithms of the standard deviations `[n, 3]`.
    pub log_scales: Tensor<2>,
    /// Logits of the opacities `[n]`.
    pub raw_opacities: Tensor<1>,
    /// Spherical-harmonic coefficients `[n, K, 3]`.
    pub sh: Tensor<3>,
    /// `[n, 2]`, values unused: its gradient is that by the projected centres, per pixel (the densification
    /// statistic).
    pub means2d_probe: Tensor<2>,
    /// `[6]`: the motion of the scene in camera axes ([`lgs_core::Camera::seeing_moved`]) under which it is
    /// seen; its gradient is that by a further small one, by which the camera's pose is refined.
    pub pose: Tensor<1>,
}

/// A rendered image, and which Gaussians it shows.
#[derive(Clone, Debug)]
pub struct RasterTensors {
    /// Colour over the background `[H, W, 3]`, not clamped.
    pub image: Tensor<3>,
    /// Transmittance left for the background `[H, W]`.
    pub transmittance: Tensor<2>,
    /// Three standard deviations of each Gaussian, rounded up to pixels `[n]`; 0 where it cannot touch the
    /// image.
    pub radii: Tensor<1, Int>,
}

/// Draws Gaussians over a background; differentiable by every tensor of `splats`.
///
/// # Panics
/// If the tensors' lengths differ or the degree (0 to 3) asks for more coefficients than there are.
#[must_use]
pub fn rasterize(splats: &SplatTensors, view: ViewSpec) -> RasterTensors {
    let primitives = SplatPrimitives {
        means: splats.means.clone().into_dispatch(),
        rotations: splats.rotations.clone().into_dispatch(),
        log_scales: splats.log_scales.clone().into_dispatch(),
        raw_opacities: splats.raw_opacities.clone().into_dispatch(),
        sh: splats.sh.clone().into_dispatch(),
        means2d: splats.means2d_probe.clone().into_dispatch(),
        pose: splats.pose.clone().into_dispatch(),
    };
    let Drawn { packed, radii } = <Dispatch as RasterOps>::rasterize(primitives, view);
    let packed = Tensor::<3>::from_dispatch(packed);
    let (height, width) = (view.camera.height as usize, view.camera.width as usize);
    RasterTensors {
        image: packed.clone().slice([0..height, 0..width, 0..3]),
        transmittance: packed.slice([0..height, 0..width, 3..4]).reshape([height, width]),
        radii: Tensor::from_dispatch(radii),
    }
}

/// `(1 - λ) mean|image - target| + λ (1 - SSIM)` of two images `[H, W, 3]`, a tensor of one value;
/// differentiable by `image` only.
///
/// # Panics
/// If the shapes differ.
#[must_use]
pub fn photometric_loss(image: Tensor<3>, target: Tensor<3>, lambda: f32) -> Tensor<1> {
    assert_eq!(image.dims(), target.dims(), "shapes of the images");
    let out =
        <Dispatch as PhotometricOps>::photometric_loss(image.into_dispatch(), target.into_dispatch(), lambda);
    Tensor::from_dispatch(out)
}

/// Looks whether the tile lists of what was drawn on a device since the last call had room for all their
/// entries, and makes more where it was scarce. It waits for the device, so training calls it every so many
/// steps; an image whose lists had no room has no gradient, and the log says so. The processor's always have.
pub fn settle(device: &Device) {
    #[cfg(feature = "gpu")]
    cube::settle(device);
    #[cfg(not(feature = "gpu"))]
    let _ = device;
}
