//! Configurations of a joint nearest to observed poses: rotations and places tell of them together.

use lgs_core::geometry::solve_positive;
use lgs_mechanics::coordinates::Coordinates;
use nalgebra::DMatrix;

/// One step of Gauss–Newton for the configuration at every sample, by whitened least squares of the poses:
/// `left` gives for other configurations what they leave of the poses, sample by sample, and `step` is a
/// change of a configuration as small as the noise.
pub(super) fn nearest(
    coordinates: &Coordinates,
    x: &[Vec<f64>],
    step: f64,
    left: impl Fn(&[Vec<f64>]) -> Vec<Vec<f64>>,
) -> Vec<Vec<f64>> {
    let freedoms = coordinates.freedoms();
    let moved_along = |freedom: usize| {
        let change: Vec<f64> = (0..freedoms).map(|i| if i == freedom { step } else { 0.0 }).collect();
        left(&x.iter().map(|x| coordinates.retract(x, &change)).collect::<Vec<_>>())
    };
    let (own, moved) = (left(x), (0..freedoms).map(moved_along).collect::<Vec<_>>());
    let of_sample = |k: usize| {
        let values = own[k].len();
        let slopes = DMatrix::from_fn(values, freedoms, |i, j| (moved[j][k][i] - own[k][i]) / step);
        let right = DMatrix::from_fn(values, 1, |i, _| -own[k][i]);
        let change = solve_positive(slopes.transpose() * &slopes, &(slopes.transpose() * right));
        change.map_or_else(|| x[k].clone(), |change| coordinates.retract(&x[k], change.as_slice()))
    };
    (0..x.len()).map(of_sample).collect()
}
