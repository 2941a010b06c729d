//! The static regulariser: it draws deformed positions to where they are without deformation, so that what
//! does not move stays exactly where it is.
//!
//! `E = weight · mean of ρ(d)`, `d = |q − p|` with canonical p and deformed q, and `ρ(d) = d / (1 + d/c)`:
//! close to the distance itself for small displacements, so that these vanish instead of shrinking, and flat
//! for large ones, which belong to moving things.

use crate::thresholds::{AT_REST, STATIC_SCALE};
use burn::tensor::Tensor;

/// The gradient `[n, 3]` of the energy by the deformed positions; `extent` is the scene's, world units.
pub(super) fn gradient(canonical: &Tensor<2>, deformed: &Tensor<2>, weight: f32, extent: f32) -> Tensor<2> {
    let factor = weight / canonical.dims()[0].max(1) as f32;
    let displacement = deformed.clone() - canonical.clone();
    let length = displacement.clone().square().sum_dim(1).sqrt();
    let spread = (length.clone().div_scalar(STATIC_SCALE * extent) + 1.0).square();
    let slope = length.full_like(factor) / (spread * (length + AT_REST * extent));
    displacement * slope
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud_tensors::{host_rows, rows};
    use crate::device::DeviceName;

    const EXTENT: f32 = 3.0;

    /// The gradient of a Gaussian that is displaced along an axis from rest at the origin.
    fn pull(displacement: [f32; 3], weight: f32) -> [f32; 3] {
        let device = DeviceName::Cpu.device();
        let (rest, moved) = (rows(&[[0.0; 3]], &device), rows(&[displacement], &device));
        host_rows(&gradient(&rest, &moved, weight, EXTENT))[0]
    }

    #[test]
    fn the_gradient_is_that_of_the_energy_and_fades_for_what_moves() {
        let energy = |d: f32| 2.0 * d / (1.0 + d / (STATIC_SCALE * EXTENT));
        for d in [0.003_f32, 0.02, 0.3] {
            let found = pull([0.0, d, 0.0], 2.0);
            let step = 1e-3 * d;
            let expected = (energy(d + step) - energy(d - step)) / (2.0 * step);
            assert!((found[1] - expected).abs() < 2e-2 * expected, "{found:?} {expected}");
            assert_eq!((found[0], found[2]), (0.0, 0.0));
        }
        assert!(pull([1.0, 0.0, 0.0], 1.0)[0] < 0.01 * pull([0.01, 0.0, 0.0], 1.0)[0]);
        assert_eq!(pull([0.0; 3], 1.0), [0.0; 3]);
    }
}
