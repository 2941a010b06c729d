//! A prior on opacities while Gaussians are tuned.
//!
//! Adam takes steps of the same length however small a gradient is. So what images hardly see, such as
//! Gaussians below a floor, goes wherever the last trace of it in some image points, and views that no image
//! has pay for it. The mean squared change of the raw opacities, by a weight so small that it only decides
//! where images do not, keeps these as they were (method §6).

use burn::tensor::{Device, Tensor};
use lgs_model::{LagrangianScene, TensorFile, TensorFileError};

use crate::cloud_tensors::{host_rows, rows};
use crate::trainable_cloud::CloudLeaves;

/// Names of the raw opacities at the start in a checkpoint.
const AT_START: [&str; 2] = ["tune.static.opacities_at_start", "tune.dynamic.opacities_at_start"];

/// Raw opacities as they were when a stage began, and the weight of their change.
pub(super) struct OpacityPrior {
    weight: f32,
    /// `[n, 1]` each, of the static and of the dynamic Gaussians.
    at_start: [Tensor<2>; 2],
}

impl OpacityPrior {
    pub(super) fn new(scene: &LagrangianScene, weight: f32, device: &Device) -> Self {
        let clouds = [&scene.static_gaussians, &scene.dynamic_gaussians];
        let column = |raw: &[f32]| rows(raw.as_chunks::<1>().0, device);
        Self { weight, at_start: clouds.map(|cloud| column(&cloud.raw_opacities)) }
    }

    /// A loss `[1]` with the weighted mean squared change of the static and the dynamic Gaussians' opacities.
    pub(super) fn added_to(&self, loss: Tensor<1>, leaves: [&CloudLeaves; 2]) -> Tensor<1> {
        if self.weight == 0.0 {
            return loss;
        }
        let count: usize = self.at_start.iter().map(|rows| rows.dims()[0]).sum();
        let parts = self.at_start.iter().zip(leaves).filter(|(rows, _)| rows.dims()[0] > 0);
        parts.fold(loss, |loss, (at_start, leaves)| {
            let change = leaves.raw_opacities.clone() - at_start.clone().autodiff();
            loss + change.powi_scalar(2).sum().mul_scalar(self.weight / count as f32)
        })
    }

    pub(super) fn insert_into(&self, file: &mut TensorFile) {
        for (name, at_start) in AT_START.iter().zip(&self.at_start) {
            let raw: Vec<[f32; 1]> = host_rows(at_start);
            file.insert(*name, &[raw.len(), 1], raw.as_flattened());
        }
    }

    /// Reads the opacities at the start from a checkpoint that was written during the stage.
    ///
    /// # Errors
    /// If they are missing or not as many.
    pub(super) fn restore(&mut self, file: &TensorFile) -> Result<(), TensorFileError> {
        for (name, at_start) in AT_START.iter().zip(&mut self.at_start) {
            let raw: Vec<[f32; 1]> = super::rows_of_gaussians(file, name, at_start.dims()[0])?;
            *at_start = rows(&raw, &at_start.device());
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud_rates::CloudRates;
    use crate::device::DeviceName;
    use crate::{adam::AdamSteps, trainable_cloud::TrainableCloud};
    use lgs_core::GaussianCloud;
    use lgs_model::MotionConfig;

    /// Raw opacities of a static Gaussian that hardly matters to a loss, and of a dynamic one that does,
    /// after two hundred steps.
    fn tuned(weight: f32) -> [f32; 2] {
        let device = DeviceName::Cpu.device();
        let cloud = || GaussianCloud::isotropic(vec![[0.0; 3]], 0.1, [0.5; 3], 0.5);
        let scene = LagrangianScene {
            dynamic_gaussians: cloud(),
            velocities: vec![[0.0; 3]],
            objects: Vec::new(),
            ..LagrangianScene::still(cloud(), MotionConfig { dt: 0.1, time_window: 1.0 }, [1.0; 3])
        };
        let prior = OpacityPrior::new(&scene, weight, &device);
        let mut clouds = [cloud(), cloud()].map(|cloud| TrainableCloud::new(&cloud, &device));
        let rates = CloudRates { raw_opacities: 0.03, ..CloudRates::default() };
        for _ in 0..200 {
            let leaves = clouds.each_ref().map(TrainableCloud::leaves);
            let [hidden, seen] = leaves.each_ref().map(|leaves| leaves.raw_opacities.clone().sum());
            let loss = hidden.mul_scalar(1e-6) + (seen - 3.0).powi_scalar(2).mul_scalar(1e-2);
            let mut gradients = prior.added_to(loss, leaves.each_ref()).backward();
            let mut steps = AdamSteps::default();
            for (cloud, leaves) in clouds.iter_mut().zip(leaves) {
                cloud.add_steps(leaves.gradients(&mut gradients), &rates, &mut steps);
            }
            steps.take();
        }
        clouds.map(|cloud| cloud.cloud().raw_opacities[0])
    }

    #[test]
    fn what_images_hardly_see_keeps_its_opacity_and_what_they_see_changes() {
        let [hidden, seen] = tuned(1e-4);
        assert!(hidden.abs() < 0.02 && (seen - 3.0).abs() < 0.1, "{hidden}, {seen}");
        let [hidden, _] = tuned(0.0);
        assert!(hidden < -4.0, "without the prior it goes as far as steps reach: {hidden}");
    }
}
