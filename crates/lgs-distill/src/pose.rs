//! Poses of an object, rigid or affine, at a moment and as smooth functions of time.

use crate::chebyshev::{Curve, Order};
use crate::dense::{M3, V3, add, dot, mat_vec};

/// Which poses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PoseKind {
    /// Rotation and shift.
    Rigid,
    /// Any linear map and shift.
    Affine,
}

/// `x_j(t) = linear b_j + shift`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pose {
    /// World axes from shape axes.
    pub(crate) linear: M3,
    /// Where the shape's centroid is.
    pub(crate) shift: V3,
}

impl Pose {
    /// The position of a shape point.
    #[inline]
    pub(crate) fn apply(&self, shape: V3) -> V3 {
        add(mat_vec(&self.linear, shape), self.shift)
    }

    /// The twelve entries, `linear` row by row and then `shift`.
    pub(crate) fn entries(&self) -> [f64; 12] {
        std::array::from_fn(|i| if i < 9 { self.linear[i / 3][i % 3] } else { self.shift[i - 9] })
    }

    /// The pose of twelve entries.
    pub(crate) fn from_entries(entries: &[f64]) -> Self {
        Self {
            linear: std::array::from_fn(|i| std::array::from_fn(|j| entries[3 * i + j])),
            shift: [entries[9], entries[10], entries[11]],
        }
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

/// The rotation vector rate of a rigid velocity field `linear' linearᵀ` (the antisymmetric part).
pub(crate) fn angular_velocity(linear: &M3, rate: &M3) -> V3 {
    let spin = |i: usize, j: usize| dot(rate[i], linear[j]);
    [0.5 * (spin(2, 1) - spin(1, 2)), 0.5 * (spin(0, 2) - spin(2, 0)), 0.5 * (spin(1, 0) - spin(0, 1))]
}
