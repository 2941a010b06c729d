//! Moving Gaussians as tensors: packed rollout states, their quaternions, and the splats they make with the
//! static ones.

use burn::tensor::{Device, Tensor, TensorData};
use lgs_core::GaussianCloud;

/// A slice of rows as a `[n, D]` tensor.
pub(super) fn rows<const D: usize>(values: &[[f32; D]], device: &Device) -> Tensor<2> {
    Tensor::from_data(TensorData::new(values.as_flattened().to_vec(), [values.len(), D]), device)
}

/// A slice as a `[n]` tensor.
pub(super) fn vector(values: &[f32], device: &Device) -> Tensor<1> {
    Tensor::from_data(TensorData::new(values.to_vec(), [values.len()]), device)
}

/// Hamilton products `a ⊗ b` of `[n, 4]` quaternions `[w, x, y, z]`.
pub(super) fn quat_mul(a: &Tensor<2>, b: &Tensor<2>) -> Tensor<2> {
    let part = |q: &Tensor<2>, i: usize| q.clone().narrow(1, i, 1);
    let term = |i, j| part(a, i) * part(b, j);
    Tensor::cat(
        vec![
            term(0, 0) - term(1, 1) - term(2, 2) - term(3, 3),
            term(0, 1) + term(1, 0) + term(2, 3) - term(3, 2),
            term(0, 2) - term(1, 3) + term(2, 0) + term(3, 1),
            term(0, 3) + term(1, 2) - term(2, 1) + term(3, 0),
        ],
        1,
    )
}

/// The arrays of a cloud as tensors.
#[derive(Clone)]
pub(super) struct CloudTensors {
    pub(super) means: Tensor<2>,
    pub(super) rotations: Tensor<2>,
    pub(super) log_scales: Tensor<2>,
    pub(super) raw_opacities: Tensor<1>,
    pub(super) sh: Tensor<3>,
}

impl CloudTensors {
    pub(super) fn new(cloud: &GaussianCloud, device: &Device) -> Self {
        let sh = TensorData::new(cloud.sh.clone(), [cloud.len(), cloud.sh_stride() / 3, 3]);
        Self {
            means: rows(&cloud.means, device),
            rotations: rows(&cloud.rotations, device),
            log_scales: rows(&cloud.log_scales, device),
            raw_opacities: vector(&cloud.raw_opacities, device),
            sh: Tensor::from_data(sh, device),
        }
    }

    /// Static Gaussians first, then the moving ones, as everywhere.
    pub(super) fn followed_by(&self, dynamic_gaussians: &Self) -> Self {
        Self {
            means: Tensor::cat(vec![self.means.clone(), dynamic_gaussians.means.clone()], 0),
            rotations: Tensor::cat(vec![self.rotations.clone(), dynamic_gaussians.rotations.clone()], 0),
            log_scales: Tensor::cat(vec![self.log_scales.clone(), dynamic_gaussians.log_scales.clone()], 0),
            raw_opacities: Tensor::cat(
                vec![self.raw_opacities.clone(), dynamic_gaussians.raw_opacities.clone()],
                0,
            ),
            sh: Tensor::cat(vec![self.sh.clone(), dynamic_gaussians.sh.clone()], 0),
        }
    }
}
