//! The noise of Langevin dynamics (method §3.4): positions of nearly invisible Gaussians wander within their
//! own shapes until an image holds them (Kheradmand et al. 2024, Eq. 8).

use burn::tensor::{Tensor, TensorData, activation::sigmoid};
use lgs_core::Stream;
use rand_distr::{Distribution, StandardNormal};

use crate::cloud_tensors::quat_rotate;
use crate::thresholds::{NOISE_OPACITY, NOISE_STEEPNESS, QUIET_OPACITY};

/// Shapes and opacities of n Gaussians.
pub(super) struct Shapes {
    /// Raw quaternions `[n, 4]`.
    pub(super) rotations: Tensor<2>,
    /// Logarithms of standard deviations `[n, 3]`, world units.
    pub(super) log_scales: Tensor<2>,
    /// Logits of opacities `[n, 1]`.
    pub(super) raw_opacities: Tensor<2>,
}

/// Shifts of positions `[n, 3]`, world units: `factor · logistic(−100 (o − 0.005)) · Σ η` with the opacity o,
/// the covariance Σ and a normal draw η. Draws go to the device; nothing comes back.
pub(super) fn shifts(shapes: Shapes, factor: f32, random: &mut Stream) -> Tensor<2> {
    let Shapes { rotations, log_scales, raw_opacities } = shapes;
    let ([n, _], device) = (log_scales.dims(), log_scales.device());
    let draws: Vec<f32> = (0..3 * n).map(|_| StandardNormal.sample(random)).collect();
    let opacities = sigmoid(raw_opacities);
    let gate = sigmoid(opacities.clone().sub_scalar(NOISE_OPACITY).mul_scalar(-NOISE_STEEPNESS));
    let gate = gate.mask_fill(opacities.greater_elem(QUIET_OPACITY), 0.0).mul_scalar(factor);
    // A normal draw turned into the axes of the Gaussian is one again.
    let draws = Tensor::<2>::from_data(TensorData::new(draws, [n, 3]), &device);
    let along = log_scales.mul_scalar(2.0).exp() * draws * gate;
    quat_rotate(&rotations, along)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud_tensors::{host_rows, rows};
    use crate::device::DeviceName;

    #[test]
    fn faint_gaussians_wander_by_their_covariance_and_opaque_ones_stay() {
        let n = 4000;
        let half = 0.5_f32.sqrt();
        // A quarter turn about z takes the long axis from x to y.
        let rotations = vec![[2.0 * half, 0.0, 0.0, 2.0 * half]; n];
        let log_scales = vec![[0.3_f32.ln(), 0.1_f32.ln(), 0.05_f32.ln()]; n];
        let raw_opacities: Vec<[f32; 1]> =
            (0..n).map(|i| [if i % 2 == 0 { (0.005_f32 / 0.995).ln() } else { 1.0 }]).collect();
        let device = DeviceName::Cpu.device();
        let shapes = Shapes {
            rotations: rows(&rotations, &device),
            log_scales: rows(&log_scales, &device),
            raw_opacities: rows(&raw_opacities, &device),
        };
        let found = shifts(shapes, 2.0, &mut lgs_core::stream(1, "noise", 0));
        let found: Vec<[f32; 3]> = host_rows(&found);
        assert!(found.iter().skip(1).step_by(2).all(|s| *s == [0.0; 3]));
        for (axis, variance) in [(0, 0.01), (1, 0.09), (2, 0.0025)] {
            let sum: f32 = found.iter().step_by(2).map(|s| s[axis].powi(2)).sum();
            let spread = (sum / (n / 2) as f32).sqrt();
            assert!((spread / variance - 1.0).abs() < 0.05, "axis {axis}: {spread} {variance}");
        }
    }
}
