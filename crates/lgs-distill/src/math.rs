//! Double-precision helpers between `glam` (vectors and 3×3 matrices) and `nalgebra` (decompositions).
//!
//! The fits of this crate difference positions twice, hence double precision; they have a few dozen unknowns
//! at most.

use glam::{DMat3, DQuat, DVec3};
use nalgebra::{DMatrix, Matrix3, Matrix4};

/// Single to double precision.
#[inline]
pub(crate) fn wide(a: [f32; 3]) -> DVec3 {
    DVec3::from(a.map(f64::from))
}

/// Double to single precision.
#[inline]
pub(crate) fn narrow(a: DVec3) -> [f32; 3] {
    a.as_vec3().to_array()
}

/// `a bᵀ`.
#[inline]
pub(crate) fn outer(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(a * b.x, a * b.y, a * b.z)
}

/// `[a]×`, the matrix of the cross product with `a`.
#[inline]
pub(crate) fn skew(a: DVec3) -> DMat3 {
    DMat3::from_cols(DVec3::new(0.0, a.z, -a.y), DVec3::new(-a.z, 0.0, a.x), DVec3::new(a.y, -a.x, 0.0))
}

/// The vector `a` with `m − mᵀ = [a]×`.
#[inline]
pub(crate) fn axial(m: &DMat3) -> DVec3 {
    DVec3::new(m.y_axis.z - m.z_axis.y, m.z_axis.x - m.x_axis.z, m.x_axis.y - m.y_axis.x)
}

/// The sum of a matrix' diagonal.
#[inline]
pub(crate) fn trace(m: &DMat3) -> f64 {
    m.x_axis.x + m.y_axis.y + m.z_axis.z
}

/// `s` times the identity.
#[inline]
pub(crate) fn scalar(s: f64) -> DMat3 {
    DMat3::from_diagonal(DVec3::splat(s))
}

/// The inverse of a 3×3 matrix; `None` if it is singular or not finite.
pub(crate) fn inverse(m: &DMat3) -> Option<DMat3> {
    let determinant = m.determinant();
    (determinant.abs() > f64::MIN_POSITIVE && determinant.is_finite()).then(|| m.inverse())
}

/// The solution of the symmetric positive definite `gram x = rhs`; `None` if `gram` is not positive definite.
pub(crate) fn solve_positive(gram: DMatrix<f64>, rhs: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    gram.cholesky().map(|factor| factor.solve(rhs))
}

/// Eigenvalues of a symmetric matrix, the largest first, with their unit eigenvectors.
pub(crate) fn principal_axes(m: &DMat3) -> [(f64, DVec3); 3] {
    let eigen = Matrix3::from_column_slice(&m.to_cols_array()).symmetric_eigen();
    let axis = |i: usize| DVec3::from_slice(eigen.eigenvectors.column(i).as_slice());
    let mut axes: [(f64, DVec3); 3] = std::array::from_fn(|i| (eigen.eigenvalues[i], axis(i)));
    axes.sort_by(|a, b| b.0.total_cmp(&a.0));
    axes
}

/// The rotation `R` that maximises `tr(Rᵀ a)` (Horn 1987: the quaternion is the eigenvector of the largest
/// eigenvalue of a 4×4 matrix), the identity if there is none.
pub(crate) fn nearest_rotation(a: &DMat3) -> DMat3 {
    let (scalar_part, vector) = (trace(a), axial(a));
    let symmetric = *a + a.transpose() - scalar(scalar_part);
    let mut horn = Matrix4::zeros();
    horn[(0, 0)] = scalar_part;
    for i in 0..3 {
        horn[(0, i + 1)] = vector[i];
        horn[(i + 1, 0)] = vector[i];
        for j in 0..3 {
            horn[(i + 1, j + 1)] = symmetric.col(j)[i];
        }
    }
    if !horn.iter().all(|v| v.is_finite()) {
        return DMat3::IDENTITY;
    }
    let eigen = horn.symmetric_eigen();
    let largest = eigen.eigenvalues.imax();
    if eigen.eigenvalues[largest] <= 0.0 {
        return DMat3::IDENTITY;
    }
    let q = eigen.eigenvectors.column(largest);
    DMat3::from_quat(DQuat::from_xyzw(q[1], q[2], q[3], q[0]).normalize())
}

/// The rotation by a vector, its axis times the angle.
pub(crate) fn rotation_by(vector: DVec3) -> DMat3 {
    DMat3::from_quat(DQuat::from_scaled_axis(vector))
}

/// The middle value of a list (0 for an empty one); the upper of the two in an even one.
pub(crate) fn median(mut values: Vec<f64>) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_rotation_of_a_stretched_rotation_is_that_rotation() {
        let r = rotation_by(DVec3::new(0.4, -1.7, 0.9));
        let stretch = DMat3::from_cols_array(&[2.0, 0.1, 0.0, 0.1, 1.0, 0.2, 0.0, 0.2, 0.5]);
        let found = nearest_rotation(&(r * stretch));
        assert!(found.abs_diff_eq(r, 1e-12), "{found} {r}");
        assert_eq!(nearest_rotation(&DMat3::ZERO), DMat3::IDENTITY);
    }

    #[test]
    fn an_axial_vector_is_that_of_its_matrix() {
        let a = DVec3::new(0.4, -1.7, 0.9);
        assert_eq!(axial(&skew(a)), 2.0 * a);
        assert_eq!(skew(a) * DVec3::Y, a.cross(DVec3::Y));
    }
}
