//! The Lagrangian stages: distillation and baking (1), photometric tuning of the dynamics (2), refinement of
//! the Gaussians (3).
//!
//! Stages 2 and 3 are [`Tuning`] values; the loop that drives them is in `pipeline`.

mod body;
mod cloud_tensors;
mod config;
mod fit_dynamics;
mod initial_pose;
mod initialise_scene;
mod look;
mod newton;
mod object_tensors;
mod seen_motion;
mod subset;
mod trainable_cloud;
mod tune_dynamics;
mod tune_gaussians;
mod tuning;

pub use config::{
    FitDynamicsConfig, InitialVelocity, MotionOptions, TuneDynamicsConfig, TuneGaussiansConfig,
};
pub use fit_dynamics::FitDynamics;
pub use initialise_scene::{InitialScene, InitialSceneRequest, initialise_scene};
pub use tune_dynamics::TuneDynamics;
pub use tune_gaussians::TuneGaussians;
pub use tuning::Tuning;

use burn::tensor::{Device, Tensor, TensorData};
use lgs_data::dataset::Frame;
use lgs_render::tensor::{SplatTensors, photometric_loss, rasterize};

use cloud_tensors::CloudTensors;

/// What a training step reports.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepReport {
    /// Photometric loss, mean over the step's frames.
    pub loss: f32,
    /// PSNR of the step's frames before the step, dB, of their mean squared error.
    pub psnr: f32,
}

/// Cosine decay from 1 to a hundredth over `total` steps.
fn cosine(step: usize, total: usize) -> f64 {
    const FLOOR: f64 = 0.01;
    let progress = step as f64 / total.max(1) as f64;
    FLOOR + (1.0 - FLOOR) * 0.5 * (1.0 + (std::f64::consts::PI * progress.min(1.0)).cos())
}

/// The photometric loss of Gaussians seen by a frame's camera against the frame, and the mean squared error.
fn frame_loss(cloud: CloudTensors, degree: usize, view: &View<'_>) -> (Tensor<1>, f64) {
    let View { frame, background, ssim_weight, device } = *view;
    let n = cloud.means.dims()[0];
    let splats = SplatTensors {
        means: cloud.means,
        rotations: cloud.rotations,
        log_scales: cloud.log_scales,
        raw_opacities: cloud.raw_opacities,
        sh: cloud.sh,
        means2d_probe: Tensor::zeros([n, 2], device),
    };
    let drawn = rasterize(&splats, &frame.camera, background, degree);
    let truth = tracing::trace_span!("frame").in_scope(|| frame.composited(background));
    let error = mean_squared_error(crate::adam::values(&drawn.image).as_chunks().0, &truth.pixels);
    let shape = [truth.height as usize, truth.width as usize, 3];
    let target = Tensor::from_data(TensorData::new(truth.pixels.as_flattened().to_vec(), shape), device);
    (photometric_loss(drawn.image, target, ssim_weight), error)
}

/// What a frame is compared under.
struct View<'a> {
    frame: &'a Frame,
    background: [f32; 3],
    ssim_weight: f32,
    device: &'a Device,
}

/// Mean squared error of an image that may leave [0, 1] against one that does not.
fn mean_squared_error(image: &[[f32; 3]], truth: &[[f32; 3]]) -> f64 {
    let pairs = image.as_flattened().iter().zip(truth.as_flattened());
    pairs.map(|(a, b)| f64::from(a.clamp(0.0, 1.0) - b).powi(2)).sum::<f64>()
        / (3 * truth.len()).max(1) as f64
}

/// PSNR of a mean squared error, dB.
fn psnr_of(mse: f64) -> f32 {
    (-10.0 * mse.max(1e-12).log10()) as f32
}

#[cfg(test)]
mod tests {
    use super::cosine;

    #[test]
    fn the_cosine_runs_from_one_to_a_hundredth() {
        assert!((cosine(0, 10) - 1.0).abs() < 1e-12);
        assert!((cosine(5, 10) - 0.505).abs() < 1e-12);
        assert!((cosine(10, 10) - 0.01).abs() < 1e-12);
    }
}
