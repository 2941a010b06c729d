//! The statistic by which densification chooses: the mean norm of a Gaussian's gradient by its projected
//! centre, over the images that show it (method §3.4). The sums are tensors on the device of training.

use burn::tensor::{Device, Int, Tensor};
use lgs_core::Camera;
use lgs_model::{TensorFile, TensorFileError};

use crate::adam::values;
use crate::cloud_tensors::{rows, vector};

/// Names of the sums in a checkpoint.
const NAMES: [&str; 2] = ["densify.gradient_sum", "densify.count"];

/// Sums since the last densification.
pub(super) struct DensifyStatistics {
    /// Sum of NDC gradient norms `[n]`.
    gradient_sum: Tensor<1>,
    /// Images in which a Gaussian was visible `[n]`.
    count: Tensor<1>,
}

impl DensifyStatistics {
    /// Nothing seen yet of `n` Gaussians.
    pub(super) fn new(n: usize, device: &Device) -> Self {
        let zeros = Tensor::zeros([n], device);
        Self { gradient_sum: zeros.clone(), count: zeros }
    }

    /// Adds one image: gradients by the projected centres in pixels `[n, 2]`, which are turned into NDC by
    /// half the image size, and screen radii `[n]`, 0 for Gaussians that are not visible.
    pub(super) fn observe(&mut self, gradient: &Tensor<2>, radii: &Tensor<1, Int>, camera: &Camera) {
        let half = rows(&[[camera.width, camera.height].map(|size| 0.5 * size as f32)], &gradient.device());
        let norm = (gradient.clone() * half).square().sum_dim(1).sqrt().squeeze_dim::<1>(1);
        let hidden = radii.clone().inner().lower_equal_elem(0);
        self.gradient_sum = self.gradient_sum.clone() + norm.mask_fill(hidden.clone(), 0.0);
        self.count = self.count.clone() + hidden.bool_not().float();
    }

    /// The mean per Gaussian, on the host; 0 for those that no image showed.
    pub(super) fn means(&self) -> Vec<f32> {
        values(&(self.gradient_sum.clone() / self.count.clone().clamp_min(1.0)))
    }

    /// Adds the sums to a checkpoint.
    pub(super) fn insert_into(&self, file: &mut TensorFile) {
        for (name, sum) in NAMES.into_iter().zip([&self.gradient_sum, &self.count]) {
            file.insert(name, &sum.dims(), &values(sum));
        }
    }

    /// Reads the sums of `n` Gaussians from a checkpoint.
    ///
    /// # Errors
    /// If a sum is absent, not finite or of another length.
    pub(super) fn read_from(file: &TensorFile, n: usize, device: &Device) -> Result<Self, TensorFileError> {
        let sum = |name: &str| {
            let (shape, values) = file.values(name)?;
            if shape == [n] {
                Ok(vector(values, device))
            } else {
                Err(file.field(name, &format!("shape [{n}]"), format!("{shape:?}")))
            }
        };
        Ok(Self { gradient_sum: sum(NAMES[0])?, count: sum(NAMES[1])? })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::DeviceName;

    #[test]
    fn the_statistic_is_the_mean_ndc_gradient_over_images_that_show_the_gaussian() {
        let device = DeviceName::Cpu.device();
        let mut statistics = DensifyStatistics::new(2, &device);
        let camera = Camera::look_at([0.0, -4.0, 0.0], [0.0; 3], 0.7, 200, 100);
        let radii = Tensor::from_ints([3, 0], &device);
        for gradient in [[0.01, 0.0], [0.0, 0.04]] {
            statistics.observe(&rows(&[gradient, [5.0, 5.0]], &device), &radii, &camera);
        }
        let means = statistics.means();
        assert!((means[0] - 1.5).abs() < 1e-6 && means[1] == 0.0, "{means:?}");
    }
}
