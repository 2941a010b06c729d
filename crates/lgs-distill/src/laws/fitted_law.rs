//! A law fitted to a shared motion, with the state that it starts from: its errors at other samples, and the
//! states of all particles.

use super::linear::law::Law;
use super::rollout::{Rollout, Start};
use crate::motion::shared_motion::SharedMotion;
use crate::shared_support::moments::SupportMoments;
use glam::DVec3;
use lgs_core::geometry::narrow;

/// A law with its initial state.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FittedLaw {
    /// The shared support that keeps the object rigid; none where particles are independent.
    pub(crate) support: Option<SupportMoments>,
    /// The law.
    pub(crate) law: Law,
    /// The state at the first sample of the fitted window.
    pub(crate) start: Start,
    /// Root mean square position error per particle over the fitted window.
    pub(crate) error: f64,
}

/// A sample outside of a fitted window.
#[derive(Clone, Copy, Debug)]
pub(crate) struct HeldOutSample {
    /// Steps from the window's first sample.
    pub(crate) step: i64,
    /// Index of the sample in the whole motion.
    pub(crate) sample: usize,
}

impl FittedLaw {
    /// Shape points under the law, at the first sample of the fitted window.
    pub(crate) fn rollout<'a>(&'a self, shape: &'a [DVec3], dt: f64) -> Rollout<'a> {
        Rollout::new(&self.law, &self.start, self.support.as_ref(), shape, dt)
    }

    /// Root mean square position error at samples outside of the fitted window, walked through in order.
    pub(crate) fn error_at(
        &self,
        motion: &SharedMotion,
        points: &[DVec3],
        held_out: &[HeldOutSample],
    ) -> f64 {
        let mut rollout = self.rollout(points, motion.dt());
        let (mut sum, mut at) = (0.0, 0);
        for &HeldOutSample { step, sample } in held_out {
            while at < step {
                rollout.step();
                at += 1;
            }
            while at > step {
                rollout.step_back();
                at -= 1;
            }
            let pose = &motion.poses[sample];
            let error = |(i, &b): (usize, &DVec3)| rollout.position(i).distance_squared(pose.apply(b));
            sum += points.iter().enumerate().map(error).sum::<f64>();
        }
        let mean = sum / (points.len() * held_out.len()).max(1) as f64;
        if mean.is_finite() { mean.sqrt() } else { f64::INFINITY }
    }

    /// Positions and starting velocities of all particles of a motion.
    pub(crate) fn initial_states(&self, motion: &SharedMotion) -> (Vec<[f32; 3]>, Vec<[f32; 3]>) {
        let rollout = self.rollout(&motion.shape, motion.dt());
        let state = |i: usize| (narrow(rollout.position(i)), narrow(rollout.velocity(i)));
        (0..motion.shape.len()).map(state).unzip()
    }
}
