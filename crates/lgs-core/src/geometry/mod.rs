//! Vectors, matrices and rotations in double precision: small functions on `glam` and `nalgebra`, of which
//! the workspace has no second set.
//!
//! Positions and quaternions in single precision, as kernels and files have them, are arrays
//! ([`crate::linear`]). Rigid fits, least squares and mechanics are small problems that difference close
//! numbers, and run here.

mod kabsch;
mod positive;
mod rotation;

pub use kabsch::{RotationFit, fit_rotation, nearest_rotation};
pub use positive::PositiveFactor;
pub use rotation::{components, exp, quaternion, right_jacobian, rotate_by, rotation_by, rotation_vector};

use glam::{DMat3, DVec3};
use nalgebra::{DMatrix, Matrix3};

use crate::thresholds::AFFINE_RIDGE;

/// Single to double precision.
#[inline]
#[must_use]
pub fn wide(a: [f32; 3]) -> DVec3 {
    DVec3::from(a.map(f64::from))
}

/// Double to single precision.
#[inline]
#[must_use]
pub fn narrow(a: DVec3) -> [f32; 3] {
    a.as_vec3().to_array()
}

/// `a bᵀ`.
#[inline]
#[must_use]
pub fn outer(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(a * b.x, a * b.y, a * b.z)
}

/// `[a]×`, the matrix of the cross product with `a`.
#[inline]
#[must_use]
pub fn cross_matrix(a: DVec3) -> DMat3 {
    DMat3::from_cols(DVec3::new(0.0, a.z, -a.y), DVec3::new(-a.z, 0.0, a.x), DVec3::new(a.y, -a.x, 0.0))
}

/// The vector `a` with `m − mᵀ = [a]×`.
#[inline]
#[must_use]
pub fn axial(m: &DMat3) -> DVec3 {
    DVec3::new(m.y_axis.z - m.z_axis.y, m.z_axis.x - m.x_axis.z, m.x_axis.y - m.y_axis.x)
}

/// The sum of a matrix' diagonal.
#[inline]
#[must_use]
pub fn trace(m: &DMat3) -> f64 {
    m.x_axis.x + m.y_axis.y + m.z_axis.z
}

/// `s` times the identity.
#[inline]
#[must_use]
pub fn scalar(s: f64) -> DMat3 {
    DMat3::from_diagonal(DVec3::splat(s))
}

/// The symmetric matrix of its entries xx yy zz xy xz yz.
///
/// # Panics
/// If there are fewer than six.
#[must_use]
pub fn symmetric(entries: &[f64]) -> DMat3 {
    let [xx, yy, zz, xy, xz, yz] = std::array::from_fn(|i| entries[i]);
    DMat3::from_cols_array(&[xx, xy, xz, xy, yy, yz, xz, yz, zz])
}

/// The inverse of a 3×3 matrix; `None` if it is singular or not finite.
#[must_use]
pub fn inverse(m: &DMat3) -> Option<DMat3> {
    let determinant = m.determinant();
    (determinant.abs() > f64::MIN_POSITIVE && determinant.is_finite()).then(|| m.inverse())
}

/// Least squares `linear` of `moment = linear · covariance`, for `moment = Σ target sourceᵀ` and
/// `covariance = Σ source sourceᵀ` of centred points; drawn to another map where the source is thin.
#[must_use]
pub fn fit_affine(moment: &DMat3, covariance: &DMat3, otherwise: &DMat3) -> DMat3 {
    let ridge = AFFINE_RIDGE * trace(covariance);
    inverse(&(*covariance + scalar(ridge)))
        .map_or(*otherwise, |inverse| (*moment + ridge * *otherwise) * inverse)
}

/// The solution of the symmetric positive definite `gram x = rhs`; `None` if `gram` is not positive definite.
#[must_use]
pub fn solve_positive(gram: DMatrix<f64>, rhs: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    gram.cholesky().map(|factor| factor.solve(rhs))
}

/// Eigenvalues of a symmetric matrix, the largest first, with their unit eigenvectors.
#[must_use]
pub fn principal_axes(m: &DMat3) -> [(f64, DVec3); 3] {
    let eigen = Matrix3::from_column_slice(&m.to_cols_array()).symmetric_eigen();
    let axis = |i: usize| DVec3::from_slice(eigen.eigenvectors.column(i).as_slice());
    let mut axes: [(f64, DVec3); 3] = std::array::from_fn(|i| (eigen.eigenvalues[i], axis(i)));
    axes.sort_by(|a, b| b.0.total_cmp(&a.0));
    axes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_axial_vector_is_that_of_its_matrix() {
        let a = DVec3::new(0.4, -1.7, 0.9);
        assert_eq!(axial(&cross_matrix(a)), 2.0 * a);
        assert_eq!(cross_matrix(a) * DVec3::Y, a.cross(DVec3::Y));
    }

    #[test]
    fn principal_axes_are_sorted_and_diagonalise() {
        let m = symmetric(&[2.0, 0.5, 1.0, 0.3, -0.2, 0.1]);
        let axes = principal_axes(&m);
        assert!(axes[0].0 >= axes[1].0 && axes[1].0 >= axes[2].0);
        for (value, axis) in axes {
            assert!((m * axis).distance(axis * value) < 1e-12);
        }
    }
}
