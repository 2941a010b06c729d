//! A pull of deformed positions towards where they are without deformation, so that what does not move stays
//! exactly where it is.
//!
//! `E = weight · mean of ρ(d)`, `d = |q − p|` with canonical p and deformed q, and `ρ(d) = d / (1 + d/c)`:
//! close to the distance itself for small displacements, so that these vanish instead of shrinking, and flat
//! for large ones, which belong to what moves.

use lgs_core::linear::{norm, sub};

/// Displacement, as a part of the scene's extent, beyond which a Gaussian is taken to move.
const ROBUST_SCALE: f32 = 0.01;
/// Displacement, as a part of the scene's extent, below which the pull fades, so that it does not flip signs
/// around rest.
const AT_REST: f32 = 1e-5;

/// The gradient of the energy by the deformed positions; `extent` is the scene's.
pub(super) fn gradient(
    canonical: &[[f32; 3]],
    deformed: &[[f32; 3]],
    weight: f32,
    extent: f32,
) -> Vec<[f32; 3]> {
    let factor = weight / canonical.len().max(1) as f32;
    let (robust_scale, at_rest) = (ROBUST_SCALE * extent, AT_REST * extent);
    let pull = |(p, q): (&[f32; 3], &[f32; 3])| {
        let d = sub(*q, *p);
        let length = norm(d);
        let slope = factor / ((1.0 + length / robust_scale).powi(2) * (length + at_rest));
        d.map(|v| slope * v)
    };
    canonical.iter().zip(deformed).map(pull).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_gradient_is_that_of_the_energy_and_fades_for_what_moves() {
        let extent = 3.0;
        let energy = |d: f32| 2.0 * d / (1.0 + d / (ROBUST_SCALE * extent));
        for d in [0.003_f32, 0.02, 0.3] {
            let found = gradient(&[[0.0; 3]], &[[0.0, d, 0.0]], 2.0, extent)[0];
            let step = 1e-3 * d;
            let expected = (energy(d + step) - energy(d - step)) / (2.0 * step);
            assert!((found[1] - expected).abs() < 2e-2 * expected, "{found:?} {expected}");
            assert_eq!((found[0], found[2]), (0.0, 0.0));
        }
        let pulls = |d: f32| gradient(&[[0.0; 3]], &[[d, 0.0, 0.0]], 1.0, extent)[0][0];
        assert!(pulls(1.0) < 0.01 * pulls(0.01));
        assert_eq!(gradient(&[[1.0; 3]], &[[1.0; 3]], 1.0, extent), [[0.0; 3]]);
    }
}
