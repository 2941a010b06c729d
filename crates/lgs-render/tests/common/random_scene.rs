//! Random Gaussians, and their images and gradients in a small view.
#![allow(dead_code, reason = "each test binary uses a part of it")]

use lgs_core::{Camera, GaussianCloud, stream};
use lgs_render::{ImageCotangents, Rasterized, SplatGradients, Splats, rasterize, rasterize_vjp};
use rand::RngExt;

pub(crate) const BACKGROUND: [f32; 3] = [0.2, 0.5, 0.8];

pub(crate) fn camera(width: u32, height: u32) -> Camera {
    Camera::look_at([0.3, -3.2, 1.1], [0.0; 3], 0.7, width, height)
}

pub(crate) fn random_cloud(count: usize, seed: u64) -> GaussianCloud {
    let mut rng = stream(seed, "behaviour", 0);
    let mut uniform = |low: f32, high: f32| rng.random_range(low..high);
    let mut cloud = GaussianCloud { sh_degree: 1, ..GaussianCloud::default() };
    for _ in 0..count {
        cloud.means.push(std::array::from_fn(|_| uniform(-1.0, 1.0)));
        cloud.rotations.push(std::array::from_fn(|_| uniform(-1.0, 1.0)));
        cloud.log_scales.push(std::array::from_fn(|_| uniform(-3.5, -1.5)));
        cloud.raw_opacities.push(uniform(-3.0, 5.0));
        cloud.sh.extend((0..12).map(|_| uniform(-0.6, 0.6)));
    }
    cloud
}

pub(crate) fn draw(cloud: &GaussianCloud, camera: &Camera) -> Rasterized {
    rasterize(&Splats::from(cloud), camera, BACKGROUND)
}

/// Cotangents of image and transmittance.
pub(crate) fn cotangents(camera: &Camera) -> (Vec<[f32; 3]>, Vec<f32>) {
    let v_image: Vec<[f32; 3]> =
        (0..camera.pixels()).map(|i| [0, 1, 2].map(|c| ((i * 7 + c) % 11) as f32 / 11.0 - 0.4)).collect();
    (v_image, (0..camera.pixels()).map(|i| (i % 5) as f32 / 5.0 - 0.5).collect())
}

pub(crate) fn gradients(cloud: &GaussianCloud, camera: &Camera, drawn: &Rasterized) -> SplatGradients {
    let (v_image, v_transmittance) = cotangents(camera);
    let v = ImageCotangents { image: &v_image, transmittance: &v_transmittance };
    rasterize_vjp(&Splats::from(cloud), camera, drawn, v)
}
