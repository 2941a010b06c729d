//! The rotation that fits one point set to another, on arrays, and its derivative (Eq. 6, method §4.6).
//!
//! The fit is that of [`lgs_core::geometry::fit_rotation`], in f64. The derivative needs no singular vectors.
//! Alignment runs the same method on many supports in SIMD lanes ([`crate::kabsch_lanes`]) and comes here
//! with those whose rotation the lanes can't certify.

use glam::DMat3;
use lgs_core::geometry::{axial, cross_matrix, fit_rotation, nearest_rotation};
use lgs_core::linear::Mat3;

/// The rotation `R ∈ SO(3)` that maximises `tr(RᵀA)`, for `A = Σ target sourceᵀ` of centred points (Eq. 6),
/// row by row.
///
/// Where the points leave rotations open (collinear, coincident, fewer than three) the smallest of them is
/// taken.
#[must_use]
pub fn kabsch(a: &Mat3) -> Mat3 {
    narrow(&nearest_rotation(&wide(a)))
}

/// Backwards through [`kabsch`]: the cotangent of `A` given that of `R`; zero where the rotation has no
/// derivative.
#[must_use]
pub fn kabsch_vjp(a: &Mat3, v_rotation: &Mat3) -> Mat3 {
    let fitted = fit_rotation(&wide(a));
    let Some(curvature) = fitted.curvature else { return [[0.0; 3]; 3] };
    let r = DMat3::from_quat(fitted.rotation);
    let pulled = axial(&(r.transpose() * wide(v_rotation)));
    narrow(&(r * cross_matrix(curvature.solve(pulled.to_array()).into())))
}

/// A matrix in double precision.
fn wide(m: &Mat3) -> DMat3 {
    DMat3::from_cols_array_2d(&m.map(|row| row.map(f64::from))).transpose()
}

/// A matrix as rows in single precision.
fn narrow(m: &DMat3) -> Mat3 {
    m.transpose().to_cols_array_2d().map(|row| row.map(|v| v as f32))
}

#[cfg(test)]
mod tests;
