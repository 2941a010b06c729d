//! How the coefficients of spherical harmonics change as a body turns (method §2.3).

use std::ops::Range;
use std::sync::OnceLock;

use nalgebra::DMatrix;

use crate::cloud::{GaussianCloud, sh_coefficients};
use crate::harmonics::sh_basis;
use crate::linear::{mat_vec, matrix_from_quat, quat_conjugate, quat_normalize};
use crate::thresholds::DIRECTIONS_OF_HARMONICS;

/// How the coefficients above the constant one change as what they belong to is turned, so that it looks from
/// a turned direction as it did before from that direction.
#[derive(Clone, Debug, PartialEq)]
pub struct TurnedHarmonics {
    /// `[K − 1, K − 1]`, new from old, row by row.
    matrix: Vec<f32>,
    /// K − 1.
    size: usize,
}

impl TurnedHarmonics {
    /// Those of a rotation, a quaternion w x y z of any length but zero, for coefficients of a degree.
    #[must_use]
    pub fn new(turn: [f32; 4], degree: usize) -> Self {
        // The rotated functions are linear in the functions themselves, which their values at many directions
        // tell: with A the values there and B those in the directions before, A new = B old.
        let inverse = matrix_from_quat(quat_conjugate(quat_normalize(turn)));
        let before = values(degree, |direction| mat_vec(&inverse, direction));
        let new_from_old = &pseudo_inverses()[degree] * before;
        let size = sh_coefficients(degree) - 1;
        let entry = |at: usize| new_from_old[(at / size, at % size)] as f32;
        Self { matrix: (0..size * size).map(entry).collect(), size }
    }

    /// Number of coefficients above the constant one, and the matrix of the new by the old ones, row by row.
    #[must_use]
    pub fn matrix(&self) -> (usize, &[f32]) {
        (self.size, &self.matrix)
    }

    /// Turns the coefficients `[K, 3]` of one Gaussian.
    fn apply(&self, coefficients: &mut [f32]) {
        let mut old = [0.0_f32; 45];
        let above = &mut coefficients[3..3 + 3 * self.size];
        let old = &mut old[..above.len()];
        old.copy_from_slice(above);
        for (new, row) in above.as_chunks_mut::<3>().0.iter_mut().zip(self.matrix.chunks_exact(self.size)) {
            *new = [0.0; 3];
            for (weight, old) in row.iter().zip(old.as_chunks::<3>().0) {
                (0..3).for_each(|channel| new[channel] += weight * old[channel]);
            }
        }
    }
}

impl GaussianCloud {
    /// Turns the harmonics of some Gaussians, which look from a turned direction as they did from that
    /// direction before; the rotation is a quaternion w x y z.
    pub fn turn_harmonics(&mut self, rows: Range<usize>, turn: [f32; 4]) {
        let stride = self.sh_stride();
        if self.sh_degree == 0 || turn[1..] == [0.0; 3] {
            return;
        }
        let turned = TurnedHarmonics::new(turn, self.sh_degree);
        let own = &mut self.sh[rows.start * stride..rows.end * stride];
        own.chunks_exact_mut(stride).for_each(|row| turned.apply(row));
    }
}

/// Values of the functions above the constant one at all directions: `[directions, K − 1]`.
fn values(degree: usize, of: impl Fn([f32; 3]) -> [f32; 3]) -> DMatrix<f64> {
    let golden = std::f32::consts::PI * (3.0 - 5.0_f32.sqrt());
    let mut values = DMatrix::zeros(DIRECTIONS_OF_HARMONICS, sh_coefficients(degree) - 1);
    for (index, mut row) in values.row_iter_mut().enumerate() {
        // Points of a spiral that fill the sphere evenly.
        let z = 1.0 - (2 * index + 1) as f32 / DIRECTIONS_OF_HARMONICS as f32;
        let (radius, (sine, cosine)) = ((1.0 - z * z).sqrt(), (golden * index as f32).sin_cos());
        let basis = sh_basis(of([radius * cosine, radius * sine, z]), degree);
        row.iter_mut().zip(&basis[1..]).for_each(|(value, &basis)| *value = f64::from(basis));
    }
    values
}

/// By degree: the coefficients from values at all directions, by least squares.
fn pseudo_inverses() -> &'static [DMatrix<f64>; 4] {
    static INVERSES: OnceLock<[DMatrix<f64>; 4]> = OnceLock::new();
    INVERSES.get_or_init(|| {
        [0, 1, 2, 3].map(|degree| {
            let values = values(degree, |direction| direction);
            let normal = (values.transpose() * &values).cholesky().map(|normal| normal.inverse());
            normal.unwrap_or_else(|| DMatrix::zeros(0, 0)) * values.transpose()
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linear::dot;

    fn color(coefficients: &[f32], direction: [f32; 3], degree: usize) -> [f32; 3] {
        let basis = sh_basis(direction, degree);
        std::array::from_fn(|channel| {
            basis.iter().zip(coefficients.as_chunks::<3>().0).map(|(b, c)| b * c[channel]).sum()
        })
    }

    #[test]
    fn turned_gaussians_look_from_turned_directions_as_before() {
        let turn = quat_normalize([0.4, -0.7, 0.2, 0.5]);
        let matrix = matrix_from_quat(turn);
        for degree in 0..=3 {
            let mut cloud = GaussianCloud::isotropic(vec![[0.0; 3]; 2], 0.1, [0.4; 3], 0.5);
            cloud.sh_degree = degree;
            cloud.sh = (0..2 * cloud.sh_stride()).map(|i| ((i * 37) % 11) as f32 / 5.0 - 1.0).collect();
            let mut turned = cloud.clone();
            turned.turn_harmonics(1..2, turn);
            let stride = cloud.sh_stride();
            assert_eq!(turned.sh[..stride], cloud.sh[..stride]);
            for direction in [[1.0, 0.0, 0.0], [0.0, 0.6, 0.8], [-0.48, 0.6, -0.64]] {
                assert!((dot(direction, direction) - 1.0).abs() < 1e-6);
                let expected = color(&cloud.sh[stride..], direction, degree);
                let found = color(&turned.sh[stride..], mat_vec(&matrix, direction), degree);
                let near = expected.iter().zip(found).all(|(a, b)| (a - b).abs() < 1e-5);
                assert!(near, "degree {degree}: {expected:?} {found:?}");
            }
        }
    }
}
