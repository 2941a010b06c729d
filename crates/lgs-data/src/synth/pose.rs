//! Poses of bodies: rigid, or deformed linearly.

use glam::{DMat3, DVec3};

/// Where a body is: a point `p` of the body lies at `linear · p + position`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pose {
    /// A rotation, and for a body that deforms a stretch on top.
    pub(super) linear: DMat3,
    /// The inverse of `linear`.
    pub(super) inverse: DMat3,
    pub(super) position: DVec3,
    /// Bound of how much `linear` lengthens any vector.
    pub(super) stretch: f64,
}

impl Pose {
    /// A rotation and a displacement.
    pub(super) fn rigid(rotation: DMat3, position: DVec3) -> Self {
        Self { linear: rotation, inverse: rotation.transpose(), position, stretch: 1.0 }
    }

    /// An invertible linear map and a displacement.
    pub(super) fn affine(linear: DMat3, position: DVec3) -> Self {
        let squares: f64 = linear.to_cols_array().iter().map(|v| v * v).sum();
        Self { linear, inverse: linear.inverse(), position, stretch: squares.sqrt() }
    }
}
