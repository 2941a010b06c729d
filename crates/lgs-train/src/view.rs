//! A training frame beside what is drawn of Gaussians from its camera.

use burn::tensor::{Device, Tensor, TensorData};
use lgs_core::Exposure;
use lgs_data::dataset::Frame;
use lgs_model::LagrangianScene;
use lgs_render::tensor::{RasterTensors, SplatTensors, ViewSpec, photometric_loss, rasterize};

use crate::cloud_tensors::CloudTensors;

/// How a frame is seen: the leaves of what is learned of its camera.
pub(crate) struct Sensor {
    /// `[6]`: the motion of the scene in the axes of the frame's camera, if that is learned; its gradient is
    /// that by a further motion.
    pub(crate) pose: Option<Tensor<1>>,
    /// `[6]`: gains minus 1, then offsets; nothing where colours are as they are.
    pub(crate) exposure: Option<Tensor<1>>,
}

impl Sensor {
    /// A frame seen as it says itself.
    pub(crate) fn of(frame: &Frame, device: &Device) -> Self {
        let Exposure { gain: [r, g, b], offset: [x, y, z] } = frame.exposure;
        let changes = || Tensor::from_floats([r - 1.0, g - 1.0, b - 1.0, x, y, z], device);
        let exposure = (frame.exposure != Exposure::IDENTITY).then(changes);
        Self { pose: None, exposure }
    }

    /// An image `[h, w, 3]` as the sensor shows it, given the transmittance `[h, w]` to the background
    /// ([`Exposure::expose`]).
    fn exposed(&self, image: Tensor<3>, transmittance: Tensor<2>, background: [f32; 3]) -> Tensor<3> {
        let Some(exposure) = &self.exposure else { return image };
        let [height, width, _] = image.dims();
        let part = |from: usize| exposure.clone().narrow(0, from, 3).reshape([1, 1, 3]);
        let through = transmittance.reshape([height, width, 1]);
        let behind = Tensor::<1>::from_floats(background, &image.device()).reshape([1, 1, 3]);
        let covered = image.clone() - through.clone() * behind;
        image + covered * part(0) + through.neg().add_scalar(1.0) * part(3)
    }
}

/// A training frame and the settings by which an image is compared with it.
#[derive(Clone, Copy)]
pub(crate) struct View<'a> {
    pub(crate) frame: &'a Frame,
    pub(crate) sensor: &'a Sensor,
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

impl<'a> View<'a> {
    /// A frame before the background of a scene, which is drawn in all its colours.
    pub(crate) fn of_scene(
        scene: &LagrangianScene,
        (frame, sensor): (&'a Frame, &'a Sensor),
        ssim_weight: f32,
        device: &'a Device,
    ) -> Self {
        let sh_degree = scene.dynamic_gaussians.sh_degree;
        Self { frame, sensor, background: scene.background, ssim_weight, sh_degree, device }
    }

    /// As [`Self::compare`], where nobody asks for the gradient by the projected centres.
    pub(crate) fn compare_cloud(&self, cloud: CloudTensors) -> Comparison {
        let probe = Tensor::zeros([cloud.len(), 2], self.device);
        self.compare(cloud.splats(probe))
    }

    /// Draws Gaussians and compares the image with the frame.
    pub(crate) fn compare(&self, splats: SplatTensors) -> Comparison {
        let Self { frame, sensor, background, ssim_weight, sh_degree, device } = *self;
        let pose = sensor.pose.clone().unwrap_or(splats.pose);
        let splats = SplatTensors { pose, ..splats };
        let spec = ViewSpec { camera: frame.camera, background, active_degree: sh_degree };
        let drawn = rasterize(&splats, spec);
        let exposed = sensor.exposed(drawn.image.clone(), drawn.transmittance.clone(), background);
        let target = tracing::trace_span!("frame").in_scope(|| {
            let truth = frame.composited(background);
            let shape = [truth.height as usize, truth.width as usize, 3];
            Tensor::<3>::from_data(TensorData::new(truth.pixels.into_flattened(), shape), device)
        });
        let (image, target, part) = self.without_masked(exposed, target);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::adam::values;
    use crate::device::DeviceName;
    use lgs_core::Camera;
    use lgs_data::dataset::{Picture, Pixels};

    fn view<'a>(frame: &'a Frame, sensor: &'a Sensor, device: &'a Device) -> View<'a> {
        View { frame, sensor, background: [1.0; 3], ssim_weight: 0.2, sh_degree: 0, device }
    }

    /// Loss and gradient by the mean of a Gaussian of a frame that is grey, but `shade` where it is masked.
    fn compared(shade: u8) -> (f32, Vec<f32>) {
        let camera = Camera::look_at([0.0, -3.0, 0.0], [0.0; 3], 0.6, 24, 24);
        let column = |i: usize| i % 24 < 9;
        let rgba = (0..576).flat_map(|i| if column(i) { [shade, 0, shade, 255] } else { [90, 90, 90, 255] });
        let mask = (0..576).map(|i| if column(i) { 0 } else { 255 }).collect();
        let pixels = Pixels::of(Picture { rgba: rgba.collect(), mask: Some(mask) });
        let frame = Frame {
            name: String::new(),
            camera_id: 0,
            camera,
            time: 0.0,
            exposure: Exposure::IDENTITY,
            pixels,
        };
        let device = DeviceName::Cpu.device().autodiff();
        let row = |values: &[f32]| Tensor::<1>::from_floats(values, &device);
        let means = row(&[0.05, 0.0, 0.1]).reshape([1, 3]).require_grad();
        let splats = SplatTensors {
            means: means.clone(),
            rotations: row(&[1.0, 0.0, 0.0, 0.0]).reshape([1, 4]),
            log_scales: row(&[-1.0; 3]).reshape([1, 3]),
            raw_opacities: row(&[1.0]),
            sh: row(&[0.7, -0.2, 0.4]).reshape([1, 1, 3]),
            means2d_probe: Tensor::zeros([1, 2], &device),
            pose: Tensor::zeros([6], &device),
        };
        let compared = view(&frame, &Sensor::of(&frame, &device), &device).compare(splats);
        let gradient = means.grad(&compared.loss.backward()).map(|gradient| values(&gradient.reshape([3])));
        let figures = values(&Tensor::cat(vec![compared.loss.inner(), compared.mse], 0));
        assert!((0.01..0.45).contains(&figures[1]), "{figures:?}");
        (figures[0], gradient.unwrap_or_default())
    }

    #[test]
    fn images_are_exposed_as_on_slices() {
        let device = DeviceName::Cpu.device();
        let exposure = Exposure { gain: [1.1, 1.0, 0.9], offset: [0.0, 0.02, -0.03] };
        let camera = Camera::look_at([0.0, -3.0, 0.0], [0.0; 3], 0.6, 2, 1);
        let (name, pixels) = (String::new(), Pixels::from(vec![0; 8]));
        let frame = Frame { name, camera_id: 0, camera, time: 0.0, exposure, pixels };
        let (image, transmittance) = ([[0.2, 0.5, 0.9], [0.7, 0.4, 0.1]], [0.3, 0.8]);
        let mut expected = image;
        exposure.expose(&mut expected, &transmittance, [0.3, 0.6, 0.2]);
        let drawn = Tensor::<1>::from_floats([0.2, 0.5, 0.9, 0.7, 0.4, 0.1], &device).reshape([1, 2, 3]);
        let through = Tensor::<1>::from_floats(transmittance, &device).reshape([1, 2]);
        let found = Sensor::of(&frame, &device).exposed(drawn, through, [0.3, 0.6, 0.2]);
        for (found, expected) in values(&found).iter().zip(expected.as_flattened()) {
            assert!((found - expected).abs() < 1e-6, "{found} {expected}");
        }
    }

    #[test]
    fn what_a_mask_leaves_out_has_no_part_in_the_loss() {
        let (loss, gradient) = compared(255);
        assert_eq!((loss, gradient.clone()), compared(0));
        assert!(loss > 0.0 && gradient.iter().any(|g| *g != 0.0));
    }
}
