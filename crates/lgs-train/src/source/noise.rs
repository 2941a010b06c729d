//! The noise of Langevin dynamics (method §3.4): positions of nearly invisible Gaussians wander within their
//! own shapes until an image holds them (Kheradmand et al. 2024, Eq. 8).

use lgs_core::Stream;
use lgs_core::linear::{mat_vec, matrix_from_quat, quat_normalize};
use rand_distr::{Distribution, StandardNormal};

use crate::thresholds::{NOISE_OPACITY, NOISE_STEEPNESS, QUIET_OPACITY};

/// Shapes and opacities of Gaussians.
#[derive(Clone, Copy)]
pub(super) struct Shapes<'a> {
    /// Raw quaternions.
    pub(super) rotations: &'a [[f32; 4]],
    /// Logarithms of standard deviations, world units.
    pub(super) log_scales: &'a [[f32; 3]],
    /// Logits of opacities.
    pub(super) raw_opacities: &'a [f32],
}

/// Shifts of positions, world units: `factor · logistic(−100 (o − 0.005)) · Σ η` with the opacity o, the
/// covariance Σ and a normal draw η.
pub(super) fn shifts(shapes: Shapes<'_>, factor: f32, random: &mut Stream) -> Vec<[f32; 3]> {
    let of_one = |i: usize| {
        let opacity = 1.0 / (1.0 + (-shapes.raw_opacities[i]).exp());
        if opacity > QUIET_OPACITY {
            return [0.0; 3];
        }
        let gate = 1.0 / (1.0 + (NOISE_STEEPNESS * (opacity - NOISE_OPACITY)).exp());
        // A normal draw turned into the axes of the Gaussian is one again.
        let draw: [f32; 3] = std::array::from_fn(|_| StandardNormal.sample(random));
        let along = std::array::from_fn(|a| factor * gate * (2.0 * shapes.log_scales[i][a]).exp() * draw[a]);
        mat_vec(&matrix_from_quat(quat_normalize(shapes.rotations[i])), along)
    };
    (0..shapes.raw_opacities.len()).map(of_one).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faint_gaussians_wander_by_their_covariance_and_opaque_ones_stay() {
        let n = 4000;
        let half = 0.5_f32.sqrt();
        // A quarter turn about z takes the long axis from x to y.
        let rotations = vec![[half, 0.0, 0.0, half]; n];
        let log_scales = vec![[0.3_f32.ln(), 0.1_f32.ln(), 0.05_f32.ln()]; n];
        let raw_opacities: Vec<f32> =
            (0..n).map(|i| if i % 2 == 0 { (0.005_f32 / 0.995).ln() } else { 1.0 }).collect();
        let shapes = Shapes { rotations: &rotations, log_scales: &log_scales, raw_opacities: &raw_opacities };
        let found = shifts(shapes, 2.0, &mut lgs_core::stream(1, "noise", 0));
        assert!(found.iter().skip(1).step_by(2).all(|s| *s == [0.0; 3]));
        for (axis, variance) in [(0, 0.01), (1, 0.09), (2, 0.0025)] {
            let sum: f32 = found.iter().step_by(2).map(|s| s[axis].powi(2)).sum();
            let spread = (sum / (n / 2) as f32).sqrt();
            assert!((spread / variance - 1.0).abs() < 0.05, "axis {axis}: {spread} {variance}");
        }
    }
}
