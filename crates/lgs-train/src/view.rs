//! A training frame beside what is drawn of Gaussians from its camera.

use burn::tensor::{Device, Tensor, TensorData};
use lgs_core::psnr_of_mse;
use lgs_data::dataset::Frame;
use lgs_render::tensor::{RasterTensors, SplatTensors, photometric_loss, rasterize};

use crate::adam::values;
use crate::driver::StepReport;

/// A training frame and the settings by which an image is compared with it.
#[derive(Clone, Copy)]
pub(crate) struct View<'a> {
    pub(crate) frame: &'a Frame,
    /// Colour behind the Gaussians, and behind transparent pixels of the frame.
    pub(crate) background: [f32; 3],
    /// Weight of 1 − SSIM in the photometric loss.
    pub(crate) ssim_weight: f32,
    /// Degree of spherical harmonics that is drawn.
    pub(crate) sh_degree: usize,
    /// Device of the Gaussians, with autodiff.
    pub(crate) device: &'a Device,
}

/// An image of Gaussians compared with its frame.
pub(crate) struct Comparison {
    pub(crate) drawn: RasterTensors,
    /// Photometric loss `[1]`, tracked.
    pub(crate) loss: Tensor<1>,
    /// Mean squared error `[1]` of the image, clamped to [0, 1].
    pub(crate) mse: Tensor<1>,
}

impl View<'_> {
    /// Draws Gaussians and compares the image with the frame.
    pub(crate) fn compare(&self, splats: &SplatTensors) -> Comparison {
        let Self { frame, background, ssim_weight, sh_degree, device } = *self;
        let drawn = rasterize(splats, &frame.camera, background, sh_degree);
        let target = tracing::trace_span!("frame").in_scope(|| {
            let truth = frame.composited(background);
            let shape = [truth.height as usize, truth.width as usize, 3];
            Tensor::<3>::from_data(TensorData::new(truth.pixels.into_flattened(), shape), device)
        });
        let (image, target, part) = self.without_masked(drawn.image.clone(), target);
        let error = image.clone().inner().clamp(0.0, 1.0) - target.clone().inner();
        let loss = photometric_loss(image, target, ssim_weight) / part;
        Comparison { drawn, loss, mse: error.square().mean() / part }
    }

    /// Two images `[h, w, 3]`, black where the frame's mask leaves pixels out, and the part of all pixels
    /// that counts: means over the images divided by it are means over these.
    fn without_masked(&self, image: Tensor<3>, target: Tensor<3>) -> (Tensor<3>, Tensor<3>, f64) {
        let Some(weights) = self.frame.weights() else { return (image, target, 1.0) };
        let part = self.frame.pixels.counted().max(1) as f64 / weights.len() as f64;
        let camera = &self.frame.camera;
        let shape = [camera.height as usize, camera.width as usize, 1];
        let weights = Tensor::<3>::from_data(TensorData::new(weights, shape), self.device);
        (image * weights.clone(), target * weights, part)
    }
}

/// Figures of a step from its loss `[1]` and the mean squared errors `[1]` of its frames: one transfer from
/// the device.
pub(crate) fn report(loss: &Tensor<1>, errors: &[Tensor<1>]) -> StepReport {
    let mean = Tensor::cat(errors.to_vec(), 0).mean();
    let figures = values(&Tensor::cat(vec![loss.clone().inner(), mean], 0));
    StepReport { loss: figures[0], psnr: psnr_of_mse(f64::from(figures[1])) as f32 }
}
