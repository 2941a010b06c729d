//! Poses of an object, rigid or affine, at a moment and as smooth functions of time.

use super::curve::{Curve, Order};
use glam::{DMat3, DVec3};
use lgs_core::geometry::axial;

/// The maps that poses are taken from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PoseKind {
    /// A rotation and a shift.
    Rigid,
    /// Any linear map and a shift.
    Affine,
}

/// A pose: `x_j(t) = linear b_j + shift`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pose {
    /// World axes from shape axes.
    pub(crate) linear: DMat3,
    /// World position of the shape's centroid.
    pub(crate) shift: DVec3,
}

impl Pose {
    /// The world position of a shape point.
    #[inline]
    pub(crate) fn apply(&self, shape: DVec3) -> DVec3 {
        self.linear * shape + self.shift
    }

    /// The twelve entries: the columns of `linear`, then `shift`.
    pub(crate) fn entries(&self) -> [f64; 12] {
        let (linear, shift) = (self.linear.to_cols_array(), self.shift.to_array());
        std::array::from_fn(|i| if i < 9 { linear[i] } else { shift[i - 9] })
    }

    /// The pose of twelve entries.
    pub(crate) fn from_entries(entries: &[f64]) -> Self {
        Self { linear: DMat3::from_cols_slice(&entries[..9]), shift: DVec3::from_slice(&entries[9..12]) }
    }
}

/// A pose as a function of time.
#[derive(Clone, Debug)]
pub(crate) struct SmoothPose {
    pub(crate) curve: Curve,
}

impl SmoothPose {
    /// The pose, or its derivative, at a time.
    pub(crate) fn at(&self, time: f64, order: Order) -> Pose {
        Pose::from_entries(&self.curve.at(time, order))
    }
}

/// The angular velocity of a turning rotation, world axes: the antisymmetric part of `rate linearᵀ`.
pub(crate) fn angular_velocity(linear: &DMat3, rate: &DMat3) -> DVec3 {
    0.5 * axial(&(*rate * linear.transpose()))
}
