//! Rotation vectors and quaternions, accurate for small angles.

use glam::{DMat3, DQuat, DVec3};

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

/// `[a]×`, the matrix of the cross product.
#[must_use]
pub fn cross_matrix(a: DVec3) -> DMat3 {
    DMat3::from_cols(DVec3::new(0.0, a.z, -a.y), DVec3::new(-a.z, 0.0, a.x), DVec3::new(a.y, -a.x, 0.0))
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
