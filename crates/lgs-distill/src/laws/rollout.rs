//! Points of a shape that follow a law from a start, step by step: each by itself, or as a rigid body.

use super::linear::law::Law;
use super::rigid_body::Body;
use crate::motion::pose::{Pose, angular_velocity};
use crate::shared_support::moments::SupportMoments;
use glam::DVec3;

/// Pose and velocity field of a shared motion at its first sample.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Start {
    /// Positions from shape.
    pub(crate) pose: Pose,
    /// Derivative of the pose by time.
    pub(crate) rate: Pose,
}

impl Start {
    /// Position of a shape point and the velocity Eq. 5 starts from.
    #[inline]
    fn state(&self, law: &Law, shape: DVec3, dt: f64) -> (DVec3, DVec3) {
        let q = self.pose.apply(shape);
        (q, law.starting_velocity(q, self.rate.apply(shape), dt))
    }

    /// The rigid body that starts here.
    fn body(&self, law: &Law, support: &SupportMoments, dt: f64) -> Body {
        let (center, velocity) = self.state(law, support.centroid, dt);
        let spin = angular_velocity(&self.pose.linear, &self.rate.linear);
        Body { rotation: self.pose.linear, center, velocity, spin }
    }
}

/// Points under a law.
pub(crate) struct Rollout<'a> {
    law: &'a Law,
    dt: f64,
    points: Points<'a>,
}

/// The state of the points.
enum Points<'a> {
    /// Position and velocity of each.
    Independent(Vec<(DVec3, DVec3)>),
    /// Shape points of a body with a shared support.
    Rigid { body: Body, support: &'a SupportMoments, shape: &'a [DVec3] },
}

impl<'a> Rollout<'a> {
    /// Points at their start; with a support they are those of a rigid body.
    pub(crate) fn new(
        law: &'a Law,
        start: &Start,
        support: Option<&'a SupportMoments>,
        shape: &'a [DVec3],
        dt: f64,
    ) -> Self {
        let points = match support {
            Some(support) => Points::Rigid { body: start.body(law, support, dt), support, shape },
            None => Points::Independent(shape.iter().map(|&b| start.state(law, b, dt)).collect()),
        };
        Self { law, dt, points }
    }

    /// One step of Eq. 5, with Eq. 6 for a rigid body.
    pub(crate) fn step(&mut self) {
        match &mut self.points {
            Points::Rigid { body, support, .. } => body.step(self.law, support, self.dt),
            Points::Independent(states) => {
                states.iter_mut().for_each(|(q, v)| self.law.step(q, v, self.dt));
            }
        }
    }

    /// The inverse of a step.
    pub(crate) fn step_back(&mut self) {
        match &mut self.points {
            Points::Rigid { body, support, .. } => body.step_back(self.law, support, self.dt),
            Points::Independent(states) => {
                states.iter_mut().for_each(|(q, v)| self.law.step_back(q, v, self.dt));
            }
        }
    }

    /// Position of a point of the shape.
    pub(crate) fn position(&self, point: usize) -> DVec3 {
        match &self.points {
            Points::Rigid { body, support, shape } => body.position(shape[point], support),
            Points::Independent(states) => states[point].0,
        }
    }

    /// Velocity of a point of the shape.
    pub(crate) fn velocity(&self, point: usize) -> DVec3 {
        match &self.points {
            Points::Rigid { body, support, shape } => body.velocity_at(shape[point], support),
            Points::Independent(states) => states[point].1,
        }
    }
}
