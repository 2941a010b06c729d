//! The shape that the published renderer draws for a quaternion that is not of unit length: the covariance of
//! another ellipsoid.

use lgs_core::linear::{Mat3, mat_mul, matrix_from_quat, quat_from_matrix, quat_normalize, transpose};

/// Sweeps over the three planes; cyclic Jacobi rotations converge quadratically, and three by three needs
/// fewer.
const SWEEPS: usize = 8;

/// Smallest variance, world units squared: keeps logarithms finite.
const LEAST_VARIANCE: f64 = 1e-14;

/// Unit quaternion and log standard deviations of the ellipsoid that `q`, taken as it is, makes of a
/// Gaussian's. Nothing if `q` is not a number: such a Gaussian is not drawn.
pub(super) fn drawn_shape(q: [f32; 4], log_scales: [f32; 3]) -> Option<([f32; 4], [f32; 3])> {
    if q.iter().any(|v| !v.is_finite()) {
        return None;
    }
    let length = q.iter().map(|v| v * v).sum::<f32>().sqrt();
    if (length - 1.0).abs() < 1e-6 {
        return Some((quat_normalize(q), log_scales));
    }
    // The published matrix of a quaternion of length n: (1 − n²) I + n² R.
    let turned = matrix_from_quat(quat_normalize(q));
    let square = length * length;
    let axes: Mat3 = std::array::from_fn(|r| {
        std::array::from_fn(|c| {
            ((if r == c { 1.0 - square } else { 0.0 }) + square * turned[r][c]) * log_scales[c].exp()
        })
    });
    let (variances, columns) = eigen(mat_mul(&axes, &transpose(&axes)).map(|row| row.map(f64::from)));
    let mut frame: Mat3 = columns.map(|row| row.map(|v| v as f32));
    if determinant(&frame) < 0.0 {
        frame.iter_mut().for_each(|row| row[0] = -row[0]);
    }
    Some((
        quat_normalize(quat_from_matrix(&frame)),
        variances.map(|v| 0.5 * v.max(LEAST_VARIANCE).ln() as f32),
    ))
}

fn determinant(m: &Mat3) -> f32 {
    let minor = |a: usize, b: usize| m[1][a] * m[2][b] - m[1][b] * m[2][a];
    m[0][0] * minor(1, 2) - m[0][1] * minor(0, 2) + m[0][2] * minor(0, 1)
}

/// Eigenvalues of a symmetric matrix, and the eigenvectors as columns.
fn eigen(mut m: [[f64; 3]; 3]) -> ([f64; 3], [[f64; 3]; 3]) {
    let mut vectors = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    for _ in 0..SWEEPS {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            if m[p][q] == 0.0 {
                continue;
            }
            let theta = 0.5 * (m[q][q] - m[p][p]) / m[p][q];
            let tan = theta.signum() / (theta.abs() + theta.hypot(1.0));
            let cos = 1.0 / tan.hypot(1.0);
            let sin = tan * cos;
            for row in &mut m {
                (row[p], row[q]) = (cos * row[p] - sin * row[q], sin * row[p] + cos * row[q]);
            }
            let (upper, lower) = (m[p], m[q]);
            m[p] = std::array::from_fn(|c| cos * upper[c] - sin * lower[c]);
            m[q] = std::array::from_fn(|c| sin * upper[c] + cos * lower[c]);
            for row in &mut vectors {
                (row[p], row[q]) = (cos * row[p] - sin * row[q], sin * row[p] + cos * row[q]);
            }
        }
    }
    ([m[0][0], m[1][1], m[2][2]], vectors)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The published covariance, entry by entry from the quaternion's own components.
    fn published_covariance([w, x, y, z]: [f32; 4], log_scales: [f32; 3]) -> Mat3 {
        let m = [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
            [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
            [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
        ];
        let axes: Mat3 = m.map(|row| std::array::from_fn(|c| row[c] * log_scales[c].exp()));
        mat_mul(&axes, &transpose(&axes))
    }

    #[test]
    fn the_drawn_ellipsoid_has_the_published_covariance() {
        let log_scales = [-1.0, -2.0, -0.5];
        for length in [1.0, 0.8, 1.3] {
            let q = quat_normalize([0.6, -0.3, 0.5, 0.2]).map(|v| length * v);
            let (unit, scales) = drawn_shape(q, log_scales).expect("finite");
            let axes: Mat3 =
                matrix_from_quat(unit).map(|row| std::array::from_fn(|c| row[c] * scales[c].exp()));
            let (found, expected) = (mat_mul(&axes, &transpose(&axes)), published_covariance(q, log_scales));
            for (f, e) in found.as_flattened().iter().zip(expected.as_flattened()) {
                assert!((f - e).abs() < 1e-5, "length {length}: {found:?} {expected:?}");
            }
        }
    }

    #[test]
    fn a_quaternion_that_is_not_a_number_is_not_drawn() {
        assert_eq!(drawn_shape([f32::NAN, 0.0, 0.0, 1.0], [0.0; 3]), None);
    }
}
