//! The 3D smoothing filter (Yu et al. 2024, Eq. 9; method §3.4): no Gaussian is finer than what the training
//! images resolve at its place, so that a closer view does not thin it out.
//!
//! A Gaussian's covariance Σ becomes Σ + f² I and its opacity is multiplied by √(|Σ| / |Σ + f² I|), with f² =
//! 0.2 of the square of a pixel's width at its depth, in the training view that resolves it best.

use std::collections::BTreeSet;

use burn::tensor::activation::sigmoid;
use lgs_core::{Camera, GaussianCloud};
use lgs_data::dataset::Frame;
use lgs_model::{TensorFile, TensorFileError};

use super::config_groups::Antialias;
use crate::cloud_tensors::{CloudTensors, vector};
use crate::thresholds::{OPACITY_MARGIN, SAMPLING_MARGIN, SMOOTHING_VARIANCE};

/// Name of the widths in a checkpoint.
const NAME: &str = "smoothing.widths";

/// The filter of every Gaussian; without cameras there is none.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Smoothing {
    /// Cameras of the training images.
    cameras: Vec<Camera>,
    /// Standard deviation f of each, world units.
    widths: Vec<f32>,
}

impl Smoothing {
    /// The filter of Gaussians at some positions, if training asks for one.
    pub(super) fn asked(frames: &[Frame], antialias: Antialias, means: &[[f32; 3]]) -> Self {
        if antialias != Antialias::MipSmoothing {
            return Self::default();
        }
        let mut seen = BTreeSet::new();
        let distinct = frames.iter().filter(|frame| seen.insert(frame.camera_id));
        Self::new(means, &distinct.map(|frame| frame.camera).collect::<Vec<_>>())
    }

    /// The filter for Gaussians that have taken the place of others.
    pub(super) fn renew(&mut self, means: impl FnOnce() -> Vec<[f32; 3]>) {
        if !self.cameras.is_empty() {
            *self = Self::new(&means(), &self.cameras);
        }
    }

    /// The filter of Gaussians at some positions, given the cameras of the training images. What no camera
    /// sees gets the widest filter of those that are seen.
    pub(super) fn new(means: &[[f32; 3]], cameras: &[Camera]) -> Self {
        let finest = |mean: &[f32; 3]| {
            let pixels = cameras.iter().filter_map(|camera| pixel_width(camera, *mean));
            pixels.reduce(f32::min).map(|width| width * SMOOTHING_VARIANCE.sqrt())
        };
        let widths: Vec<Option<f32>> = means.iter().map(finest).collect();
        let widest = widths.iter().flatten().copied().fold(0.0, f32::max);
        let widths = widths.into_iter().map(|width| width.unwrap_or(widest)).collect();
        Self { cameras: cameras.to_vec(), widths }
    }

    /// Gaussians as they are drawn.
    pub(super) fn applied(&self, cloud: CloudTensors) -> CloudTensors {
        if self.cameras.is_empty() {
            return cloud;
        }
        let n = self.widths.len();
        let variances: Vec<f32> = self.widths.iter().map(|f| f * f).collect();
        let device = cloud.log_scales.device();
        let variances = vector(&variances, &device).reshape([n, 1]);
        let widened = (cloud.log_scales.clone().mul_scalar(2.0).exp() + variances).log().mul_scalar(0.5);
        let energy = (cloud.log_scales - widened.clone()).sum_dim(1).exp().reshape([n]);
        let opacity = (sigmoid(cloud.raw_opacities) * energy).clamp(OPACITY_MARGIN, 1.0 - OPACITY_MARGIN);
        let raw_opacities = opacity.clone().log() - opacity.neg().add_scalar(1.0).log();
        CloudTensors { log_scales: widened, raw_opacities, ..cloud }
    }

    /// The Gaussians of a cloud on the host as they are drawn.
    pub(super) fn applied_on_host(
        &self,
        cloud: &GaussianCloud,
        device: &burn::tensor::Device,
    ) -> GaussianCloud {
        if self.cameras.is_empty() {
            return cloud.clone();
        }
        self.applied(CloudTensors::new(cloud, device)).cloud(cloud.sh_degree)
    }

    /// Adds the widths to a checkpoint.
    pub(super) fn insert_into(&self, file: &mut TensorFile) {
        if !self.cameras.is_empty() {
            file.insert(NAME, &[self.widths.len()], &self.widths);
        }
    }

    /// Reads the widths of `n` Gaussians from a checkpoint.
    ///
    /// # Errors
    /// If they are absent, not finite or of another number.
    pub(super) fn restore(&mut self, file: &TensorFile, n: usize) -> Result<(), TensorFileError> {
        if self.cameras.is_empty() {
            return Ok(());
        }
        let (shape, widths) = file.values(NAME)?;
        if shape != [n] {
            return Err(file.field(NAME, &format!("shape [{n}]"), format!("{shape:?}")));
        }
        self.widths = widths.to_vec();
        Ok(())
    }
}

/// The width of a pixel at a point's depth, world units, if the camera sees it.
fn pixel_width(camera: &Camera, point: [f32; 3]) -> Option<f32> {
    let ([x, y], depth) = camera.pixel_from_world(point);
    let [width, height] = [camera.width, camera.height].map(|pixels| pixels as f32);
    let inside = |at: f32, size: f32| at > -SAMPLING_MARGIN * size && at < (1.0 + SAMPLING_MARGIN) * size;
    (depth > camera.near && inside(x, width) && inside(y, height)).then(|| depth / camera.fx.max(camera.fy))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::DeviceName;
    use lgs_core::PixelFilter;
    use lgs_render::{Splats, rasterize};

    fn camera(size: u32) -> Camera {
        let camera = Camera::look_at([0.0, -4.0, 0.0], [0.0; 3], 0.8, size, size);
        Camera { filter: PixelFilter::Mip, ..camera }
    }

    /// A vertical wall of Gaussians finer than a pixel, one for each of the pixels of a training view.
    fn wall(size: u32) -> GaussianCloud {
        let pixel = 4.0 / camera(size).fx;
        let at = |i: u32| (i as f32 + 0.5 - 0.5 * size as f32) * pixel;
        let means = (0..size * size).map(|i| [at(i % size), 0.0, at(i / size)]).collect();
        GaussianCloud::isotropic(means, 0.3 * pixel, [0.2; 3], 0.99)
    }

    /// The range of transmittances in the middle of a view of the wall.
    fn unevenness(cloud: &GaussianCloud, view: &Camera) -> f32 {
        let drawn = rasterize(&Splats::from(cloud), view, [1.0; 3]);
        let side = view.width as usize;
        let inner = 3 * side / 8..5 * side / 8;
        let pixels = inner.clone().flat_map(|y| inner.clone().map(move |x| y * side + x));
        let (low, high) = pixels
            .map(|i| drawn.transmittance[i])
            .fold((1.0_f32, 0.0_f32), |(low, high), t| (low.min(t), high.max(t)));
        high - low
    }

    #[test]
    fn a_closer_view_does_not_thin_out_what_is_smoothed() {
        let (size, device) = (16, DeviceName::Cpu.device());
        let cloud = wall(size);
        let smoothing = Smoothing::new(&cloud.means, &[camera(size)]);
        let smoothed = smoothing.applied_on_host(&cloud, &device);
        for drawn in [&cloud, &smoothed] {
            assert!(unevenness(drawn, &camera(size)) < 0.05, "both are even in the training view");
        }
        let (open, closed) =
            (unevenness(&cloud, &camera(8 * size)), unevenness(&smoothed, &camera(8 * size)));
        assert!(open > 0.5 && closed < 0.1, "holes without the filter {open}, with it {closed}");
    }

    #[test]
    fn what_is_large_stays_and_what_is_small_keeps_its_mass() {
        let device = DeviceName::Cpu.device();
        let mut cloud = GaussianCloud::isotropic(vec![[0.0; 3]; 2], 1.0, [0.5; 3], 0.8);
        cloud.log_scales[1] = [0.001_f32.ln(); 3];
        let smoothing = Smoothing::new(&cloud.means, &[camera(100)]);
        let drawn = smoothing.applied_on_host(&cloud, &device);
        assert!((drawn.log_scales[0][0]).abs() < 1e-3 && (drawn.opacity(0) - 0.8).abs() < 1e-2);
        let f = (0.2_f32).sqrt() * 4.0 / camera(100).fx;
        assert!((drawn.log_scales[1][0].exp() / f - 1.0).abs() < 1e-2);
        let mass = |c: &GaussianCloud| c.opacity(1) * (3.0 * c.log_scales[1][0]).exp();
        assert!((mass(&drawn) / mass(&cloud) - 1.0).abs() < 0.02);
    }

    #[test]
    fn files_keep_the_widths() {
        let smoothing = Smoothing::new(&[[0.0; 3]], &[camera(60)]);
        let mut file = TensorFile::new("test/1");
        smoothing.insert_into(&mut file);
        let mut back = Smoothing { cameras: vec![camera(60)], widths: Vec::new() };
        assert!(back.restore(&file, 2).is_err());
        back.restore(&file, 1).expect("read");
        assert_eq!(back, smoothing);
    }

    #[test]
    fn gradients_match_difference_quotients() {
        let device = DeviceName::Cpu.device();
        let mut cloud = GaussianCloud::isotropic(vec![[0.0; 3]], 0.02, [0.5; 3], 0.7);
        cloud.log_scales[0] = [0.01_f32.ln(), 0.03_f32.ln(), 0.1_f32.ln()];
        let smoothing = Smoothing::new(&cloud.means, &[camera(60)]);
        let value = |cloud: &GaussianCloud| {
            let drawn = smoothing.applied_on_host(cloud, &device);
            drawn.raw_opacities[0] + drawn.log_scales[0].iter().sum::<f32>()
        };
        let mut tracked = CloudTensors::new(&cloud, &device).autodiff();
        tracked.log_scales = tracked.log_scales.require_grad();
        tracked.raw_opacities = tracked.raw_opacities.require_grad();
        let (scales, opacity) = (tracked.log_scales.clone(), tracked.raw_opacities.clone());
        let drawn = smoothing.applied(tracked);
        let mut gradients = (drawn.raw_opacities.sum() + drawn.log_scales.sum()).backward();
        let by_scale = crate::adam::values(&scales.grad_remove(&mut gradients).expect("a gradient"));
        let by_opacity = crate::adam::values(&opacity.grad_remove(&mut gradients).expect("a gradient"));
        let slope = |change: &dyn Fn(&mut GaussianCloud, f32)| {
            let moved = |d: f32| {
                let mut other = cloud.clone();
                change(&mut other, d);
                value(&other)
            };
            (moved(1e-2) - moved(-1e-2)) / 2e-2
        };
        for (axis, expected) in by_scale.iter().enumerate() {
            let found = slope(&|c, d| c.log_scales[0][axis] += d);
            assert!((found - expected).abs() < 5e-3, "axis {axis}: {found} {expected}");
        }
        let found = slope(&|c, d| c.raw_opacities[0] += d);
        assert!((found - by_opacity[0]).abs() < 5e-3, "{found} {}", by_opacity[0]);
    }
}
