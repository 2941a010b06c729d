//! A law fitted to a shared motion, with the state that it starts from: its rollouts and its errors at other
//! samples.

use crate::dense::{V3, norm2, sub};
use crate::law::{Law, Terms};
use crate::pose::{Pose, angular_velocity};
use crate::rigid_body::{Anchoring, Body};
use crate::shared_motion::SharedMotion;

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
    pub(crate) fn state(&self, law: &Law, shape: V3, dt: f64) -> (V3, V3) {
        let q = self.pose.apply(shape);
        (q, law.starting_velocity(q, self.rate.apply(shape), dt))
    }

    /// The rigid body that starts here.
    pub(crate) fn body(&self, law: &Law, anchoring: &Anchoring, dt: f64) -> Body {
        let (center, velocity) = self.state(law, anchoring.centroid, dt);
        Body {
            rotation: self.pose.linear,
            center,
            velocity,
            spin: angular_velocity(&self.pose.linear, &self.rate.linear),
        }
    }
}

/// A law's form.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Candidate {
    /// Its terms.
    pub(crate) terms: Terms,
    /// Whether the object is held rigid by one support (Eq. 6), or its particles move independently.
    pub(crate) rigid_constraint: bool,
}

/// A law with its initial state.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FittedLaw {
    /// What holds the object together, if anything.
    pub(crate) anchoring: Option<Anchoring>,
    /// The law.
    pub(crate) law: Law,
    /// The state at the first sample of the fitted window.
    pub(crate) start: Start,
    /// Root mean square position error per particle over the fitted window.
    pub(crate) error: f64,
}

impl FittedLaw {
    /// Root mean square position error at samples outside of the fitted window; `steps` holds pairs of the
    /// step from the window's first sample and the index of the sample in `motion`, walked through in order.
    pub(crate) fn error_at(
        &self,
        motion: &SharedMotion,
        points: &[V3],
        dt: f64,
        steps: &[(i64, usize)],
    ) -> f64 {
        let mut sum = 0.0;
        match &self.anchoring {
            Some(anchoring) => {
                let mut body = self.start.body(&self.law, anchoring, dt);
                let mut at = 0;
                for &(step, sample) in steps {
                    while at < step {
                        body.step(&self.law, anchoring, dt);
                        at += 1;
                    }
                    while at > step {
                        body.step_back(&self.law, anchoring, dt);
                        at -= 1;
                    }
                    let pose = &motion.poses[sample];
                    sum += points
                        .iter()
                        .map(|&b| norm2(sub(body.position(b, anchoring), pose.apply(b))))
                        .sum::<f64>();
                }
            }
            None => sum = self.independent_error(motion, points, dt, steps),
        }
        let mean = sum / (points.len() * steps.len()).max(1) as f64;
        if mean.is_finite() { mean.sqrt() } else { f64::INFINITY }
    }

    /// Sum of squares for independent particles.
    fn independent_error(
        &self,
        motion: &SharedMotion,
        points: &[V3],
        dt: f64,
        steps: &[(i64, usize)],
    ) -> f64 {
        let Some(inverse) = self.law.velocity_operator(dt) else { return f64::INFINITY };
        let mut sum = 0.0;
        for &b in points {
            let (mut q, mut v) = self.start.state(&self.law, b, dt);
            let mut at = 0;
            for &(step, sample) in steps {
                while at < step {
                    self.law.step(&mut q, &mut v, dt);
                    at += 1;
                }
                while at > step {
                    self.law.step_back(&mut q, &mut v, dt, &inverse);
                    at -= 1;
                }
                sum += norm2(sub(q, motion.poses[sample].apply(b)));
            }
        }
        sum
    }

    /// Positions and starting velocities of all particles of a motion.
    pub(crate) fn initial_states(&self, motion: &SharedMotion, dt: f64) -> (Vec<[f32; 3]>, Vec<[f32; 3]>) {
        let narrow = |(q, v)| (crate::dense::narrow(q), crate::dense::narrow(v));
        match &self.anchoring {
            Some(anchoring) => {
                let body = self.start.body(&self.law, anchoring, dt);
                motion
                    .shape
                    .iter()
                    .map(|&b| narrow((body.position(b, anchoring), body.velocity_at(b, anchoring))))
                    .unzip()
            }
            None => motion.shape.iter().map(|&b| narrow(self.start.state(&self.law, b, dt))).unzip(),
        }
    }

    /// Positions of shape points after each of `steps` steps, the start first: `[steps + 1][points]`.
    pub(crate) fn rollout(&self, shape: &[V3], dt: f64, steps: usize) -> Vec<Vec<V3>> {
        match &self.anchoring {
            Some(anchoring) => {
                let mut body = self.start.body(&self.law, anchoring, dt);
                (0..=steps)
                    .map(|step| {
                        if step > 0 {
                            body.step(&self.law, anchoring, dt);
                        }
                        shape.iter().map(|&b| body.position(b, anchoring)).collect()
                    })
                    .collect()
            }
            None => {
                let mut states: Vec<(V3, V3)> =
                    shape.iter().map(|&b| self.start.state(&self.law, b, dt)).collect();
                (0..=steps)
                    .map(|step| {
                        if step > 0 {
                            states.iter_mut().for_each(|(q, v)| self.law.step(q, v, dt));
                        }
                        states.iter().map(|(q, _)| *q).collect()
                    })
                    .collect()
            }
        }
    }
}
