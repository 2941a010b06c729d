//! Rotation vectors and quaternions, accurate for small angles.

use super::cross_matrix;
use glam::{DMat3, DQuat, DVec3};

/// The quaternion that a list begins with: w, x, y, z.
///
/// # Panics
/// If the list has fewer than four values.
#[inline]
#[must_use]
pub fn quaternion(list: &[f64]) -> DQuat {
    DQuat::from_xyzw(list[1], list[2], list[3], list[0])
}

/// The components w, x, y, z of a quaternion.
#[inline]
#[must_use]
pub fn components(rotation: DQuat) -> [f64; 4] {
    [rotation.w, rotation.x, rotation.y, rotation.z]
}

/// The quaternion of a rotation vector.
#[must_use]
pub fn exp(vector: DVec3) -> DQuat {
    let half = 0.5 * vector.length();
    // sin(h)/h to the last bit where the quotient is 0/0.
    let part = if half < 1e-4 { 1.0 - half * half / 6.0 } else { half.sin() / half };
    let xyz = vector * (0.5 * part);
    DQuat::from_xyzw(xyz.x, xyz.y, xyz.z, half.cos())
}

/// `rotation · exp(vector)`, normalised: a change in body axes.
#[must_use]
pub fn rotate_by(rotation: DQuat, vector: DVec3) -> DQuat {
    (rotation * exp(vector)).normalize()
}

/// The rotation vector of a quaternion, of a length up to π.
#[must_use]
pub fn rotation_vector(rotation: DQuat) -> DVec3 {
    let rotation = if rotation.w < 0.0 { -rotation } else { rotation };
    let xyz = DVec3::new(rotation.x, rotation.y, rotation.z);
    let sine = xyz.length();
    let part = if sine < 1e-8 { 2.0 } else { 2.0 * sine.atan2(rotation.w) / sine };
    xyz * part
}

/// The rotation matrix of a rotation vector.
#[must_use]
pub fn rotation_by(vector: DVec3) -> DMat3 {
    DMat3::from_quat(exp(vector))
}

/// The right Jacobian of the exponential: `exp(u + δ) ≈ exp(u) exp(J δ)`.
#[must_use]
pub fn right_jacobian(vector: DVec3) -> DMat3 {
    let square = vector.length_squared();
    let angle = square.sqrt();
    let (first, second) = if angle < 1e-3 {
        (0.5 - square / 24.0, 1.0 / 6.0 - square / 120.0)
    } else {
        ((1.0 - angle.cos()) / square, (angle - angle.sin()) / (square * angle))
    };
    let k = cross_matrix(vector);
    DMat3::IDENTITY - k * first + k * k * second
}
