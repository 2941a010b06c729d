//! The rotation that fits one point set to another (Kabsch, orthogonal Procrustes), with the curvature that
//! its derivative needs.
//!
//! `R = argmax tr(RᵀA)` over SO(3) is found by Newton's method from the identity: with `K = RᵀA`, the
//! gradient in body axes is `axial(K)` and the negative Hessian `M = tr(K) I − sym(K)`. A stationary point
//! with `M` positive definite is the global maximum (the others are saddles), so success is certified;
//! otherwise the quaternion is the eigenvector of the largest eigenvalue of a 4×4 matrix (Horn 1987).
//! Derivative: method §4.6.

use super::{PositiveFactor, axial, scalar, trace};
use crate::thresholds::{DEGENERATE_PULL, LEAST_PIVOT};
use glam::{DMat3, DQuat, DVec3};
use nalgebra::Matrix4;

/// A fitted rotation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RotationFit {
    /// The rotation, of unit length.
    pub rotation: DQuat,
    /// The factor of `M`; `None` where the points leave rotations open and the rotation has no derivative.
    pub curvature: Option<PositiveFactor>,
}

impl RotationFit {
    /// No rotation, which is all that can be said of points without directions.
    const NONE: Self = Self { rotation: DQuat::IDENTITY, curvature: None };
}

/// The rotation `R` that maximises `tr(RᵀA)`, for `A = Σ target sourceᵀ` of centred points.
///
/// Where the points leave rotations open (collinear, coincident, fewer than three) the smallest of them is
/// taken.
#[must_use]
pub fn fit_rotation(a: &DMat3) -> RotationFit {
    const ITERATIONS: usize = 12;
    let mut rotation = DQuat::IDENTITY;
    for _ in 0..ITERATIONS {
        let k = pulled_back(a, rotation);
        let Some(curvature) = curvature(&k) else { break };
        let turn = DVec3::from(curvature.solve(axial(&k).to_array()));
        let half = 0.5 * turn;
        rotation = (rotation * DQuat::from_xyzw(half.x, half.y, half.z, 1.0)).normalize();
        // Newton's error is the square of the one before: what is left is rounding.
        if turn.length_squared() < f64::EPSILON {
            return RotationFit { rotation, curvature: Some(curvature) };
        }
    }
    fit_by_eigenvector(a)
}

/// The matrix of [`fit_rotation`].
#[must_use]
pub fn nearest_rotation(a: &DMat3) -> DMat3 {
    DMat3::from_quat(fit_rotation(a).rotation)
}

fn fit_by_eigenvector(a: &DMat3) -> RotationFit {
    let norm = a.to_cols_array().iter().map(|v| v * v).sum::<f64>().sqrt();
    if !norm.is_finite() || norm < LEAST_PIVOT {
        return RotationFit::NONE;
    }
    let rotation = leading_quaternion(a);
    if let Some(curvature) = curvature(&pulled_back(a, rotation)) {
        return RotationFit { rotation, curvature: Some(curvature) };
    }
    let drawn = *a + scalar(DEGENERATE_PULL * norm);
    RotationFit { rotation: leading_quaternion(&drawn), curvature: None }
}

/// `RᵀA`.
fn pulled_back(a: &DMat3, rotation: DQuat) -> DMat3 {
    DMat3::from_quat(rotation).transpose() * *a
}

/// The factor of `tr(K) I − sym(K)`, if that is positive definite by a margin.
fn curvature(k: &DMat3) -> Option<PositiveFactor> {
    let trace = trace(k);
    let m = scalar(trace) - 0.5 * (*k + k.transpose());
    let [x, y, z] = [m.x_axis, m.y_axis, m.z_axis];
    PositiveFactor::new([x.x, x.y, y.y, x.z, y.z, z.z], trace)
}

/// The quaternion of the best rotation: the eigenvector of the largest eigenvalue of Horn's symmetric matrix.
fn leading_quaternion(a: &DMat3) -> DQuat {
    let (trace, vector) = (trace(a), axial(a));
    let symmetric = *a + a.transpose() - scalar(trace);
    let horn = Matrix4::from_fn(|i, j| match (i, j) {
        (0, 0) => trace,
        (0, i) | (i, 0) => vector[i - 1],
        (i, j) => symmetric.col(j - 1)[i - 1],
    });
    let eigen = horn.symmetric_eigen();
    let q = eigen.eigenvectors.column(eigen.eigenvalues.imax());
    let q = DQuat::from_xyzw(q[1], q[2], q[3], q[0]).normalize();
    if q.w < 0.0 { -q } else { q }
}

#[cfg(test)]
mod tests {
    use super::super::rotation_by;
    use super::*;

    #[test]
    fn the_nearest_rotation_of_a_stretched_rotation_is_that_rotation() {
        let stretch = DMat3::from_cols_array(&[2.0, 0.1, 0.0, 0.1, 1.0, 0.2, 0.0, 0.2, 0.5]);
        for step in 0..32 {
            let r = rotation_by(DVec3::new(0.3, -0.8, 0.5) * (0.2 * f64::from(step)));
            let found = nearest_rotation(&(r * stretch));
            assert!(found.abs_diff_eq(r, 1e-12), "{found} {r}");
        }
    }

    #[test]
    fn points_without_directions_are_not_turned() {
        assert_eq!(fit_rotation(&DMat3::ZERO), RotationFit::NONE);
        assert_eq!(fit_rotation(&DMat3::NAN), RotationFit::NONE);
        assert_eq!(fit_rotation(&(DMat3::IDENTITY * f64::INFINITY)), RotationFit::NONE);
    }
}
