//! A shared motion that can be differentiated by time.

use super::curve::{Curve, Order};
use super::pose::{Pose, SmoothPose};
use super::shared_motion::SharedMotion;
use std::ops::RangeInclusive;

/// A shared motion with its poses as smooth functions of time.
#[derive(Clone, Debug)]
pub(crate) struct SmoothMotion {
    /// Poses sample by sample, and the shape.
    pub(crate) shared: SharedMotion,
    /// The poses as polynomials.
    pub(crate) smooth: SmoothPose,
    /// Degree of the polynomials.
    pub(crate) degree: usize,
}

impl SmoothMotion {
    /// The motion with its poses as smooth functions of time, of the degree that cross validation chooses.
    pub(crate) fn new(shared: SharedMotion, degrees: RangeInclusive<usize>) -> Self {
        let covariance = shared.covariance();
        let spread: [f64; 3] = std::array::from_fn(|i| covariance.col(i)[i].sqrt().max(1e-12));
        // A pose's entries count as far as they move the shape: column i of `linear` by its extent along i.
        let emphasis: Vec<f64> = (0..12).map(|i| if i < 9 { spread[i / 3] } else { 1.0 }).collect();
        let values: Vec<f64> = shared.poses.iter().flat_map(Pose::entries).collect();
        let (curve, degree) = Curve::fit_by_cross_validation(&shared.times, &values, &emphasis, degrees);
        Self { shared, smooth: SmoothPose { curve }, degree }
    }

    /// The smooth pose, or its derivative, at a time.
    pub(crate) fn at(&self, time: f64, order: Order) -> Pose {
        self.smooth.at(time, order)
    }
}
