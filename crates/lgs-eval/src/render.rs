//! One Gaussian cloud as one camera sees it.

use lgs_core::{Camera, GaussianCloud, Image};
use lgs_render::{Splats, rasterize};

/// A rendered view.
#[derive(Clone, Debug)]
pub struct Rendered {
    /// Colours over the background, not yet rounded.
    pub image: Image,
    /// Fraction of the background's light that reaches each pixel, `[height · width]`.
    pub transmittance: Vec<f32>,
}

impl Rendered {
    /// Accumulated opacity of every pixel.
    pub fn opacity(&self) -> impl Iterator<Item = f32> {
        self.transmittance.iter().map(|t| 1.0 - t)
    }
}

/// Draws all Gaussians of a cloud.
#[must_use]
pub fn render(cloud: &GaussianCloud, camera: &Camera, background: [f32; 3]) -> Rendered {
    let out = rasterize(&Splats::from(cloud), camera, background);
    Rendered {
        image: Image { width: camera.width, height: camera.height, pixels: out.image },
        transmittance: out.transmittance,
    }
}
