//! Fitting a linear law and the initial state of a shared motion to its poses, by rollouts.
//!
//! Start: ridge least squares of the second differences of the smooth poses (Eq. 5 is `q⁺ − 2q + q⁻ = dt²
//! a(q, (q − q⁻)/dt)`, so second and backward differences are exactly consistent with it). Then
//! Levenberg–Marquardt on positions (Eq. 7 restricted to a dozen unknowns): the state is a pose and a
//! velocity field, the particles are the six sigma points, so that a rollout costs microseconds and Jacobians
//! by finite differences are affordable.

use super::candidate::Candidate;
use super::fitted_law::FittedLaw;
use super::least_squares::{Minimum, minimise};
use super::linear::acceleration_match::NormalEquations;
use super::linear::law::Law;
use super::rollout::{Rollout, Start};
use crate::motion::curve::Order;
use crate::motion::pose::{PoseKind, angular_velocity};
use crate::motion::shared_motion::SharedMotion;
use crate::motion::smooth_motion::SmoothMotion;
use crate::shared_support::moments::SupportMoments;
use glam::{DMat3, DVec3};
use lgs_core::geometry::{cross_matrix, nearest_rotation, rotation_by};

/// The fits of one window.
pub(crate) struct LawFit<'a> {
    motion: &'a SharedMotion,
    points: Vec<DVec3>,
    center: DVec3,
    /// The start of the smooth poses.
    base: Start,
    support: Option<SupportMoments>,
    /// Normal equations of the law at the particles.
    at_particles: NormalEquations,
    /// The same at the support's centroid.
    at_centroid: NormalEquations,
}

impl<'a> LawFit<'a> {
    /// Prepares the fits of a window. The laws' stiffness vanishes at `center`; without a support no
    /// candidate may ask for the rigid constraint.
    pub(crate) fn new(motion: &'a SmoothMotion, center: DVec3, support: Option<SupportMoments>) -> Self {
        let mut fit = Self {
            motion: &motion.shared,
            points: motion.shared.sigma_points(),
            center,
            base: smooth_start(motion),
            support,
            at_particles: NormalEquations::default(),
            at_centroid: NormalEquations::default(),
        };
        fit.accumulate(motion);
        fit
    }

    /// Whether candidates may ask for the rigid constraint.
    pub(crate) fn has_support(&self) -> bool {
        self.support.is_some()
    }

    /// Adds every sample's second difference to the normal equations.
    fn accumulate(&mut self, motion: &SmoothMotion) {
        let (dt, center) = (self.motion.dt(), self.center);
        for &t in &self.motion.times {
            let [before, now, after] = [t - dt, t, t + dt].map(|t| motion.at(t, Order::Value));
            let add = |equations: &mut NormalEquations, b: DVec3| {
                let [x0, x1, x2] = [before, now, after].map(|pose| pose.apply(b));
                equations.add(x1 - center, (x1 - x0) / dt, (x0 + x2 - 2.0 * x1) / (dt * dt));
            };
            self.points.iter().for_each(|&b| add(&mut self.at_particles, b));
            if let Some(support) = &self.support {
                add(&mut self.at_centroid, support.centroid);
            }
        }
    }

    /// The fit of a law's form, from the law that matches the particles' accelerations; for a rigid body also
    /// from the one that matches those of the centroid and from none, and the best is kept: rollouts of a
    /// rigid body have valleys of their own, and no one start leads into the deepest every time. `None` if
    /// nothing finite comes of it or the law drives its own motion.
    pub(crate) fn fit(&self, candidate: &Candidate) -> Option<FittedLaw> {
        let matched = |equations: &NormalEquations| equations.solve(&candidate.terms, self.center);
        let mut starts = vec![matched(&self.at_particles)];
        if candidate.rigid_constraint {
            starts.insert(0, matched(&self.at_centroid));
            starts.push(Law::free(self.center));
        }
        let descents = starts.iter().map(|law| self.descend(candidate, law, 0));
        let best = descents.reduce(|best, next| if next.cost < best.cost { next } else { best })?;
        self.fitted(candidate, &best)
    }

    /// The best start of a rigid body that follows a law fitted to independent particles. `None` if nothing
    /// finite comes of it.
    pub(crate) fn constrained(&self, law: &Law, candidate: &Candidate) -> Option<FittedLaw> {
        let candidate = Candidate { rigid_constraint: true, ..*candidate };
        let minimum = self.descend(&candidate, law, candidate.terms.unknowns());
        self.fitted(&candidate, &minimum)
    }

    /// Levenberg–Marquardt from a law and the smooth start; the first `fixed` unknowns stay.
    fn descend(&self, candidate: &Candidate, law: &Law, fixed: usize) -> Minimum {
        let start_unknowns = match self.motion.kind {
            PoseKind::Rigid => 12,
            PoseKind::Affine => 24,
        };
        let mut unknowns = candidate.terms.unknowns_of(law);
        unknowns.resize(unknowns.len() + start_unknowns, 0.0);
        minimise(unknowns, fixed, |unknowns| self.residual(candidate, unknowns))
    }

    /// The law and the start at a minimum.
    fn fitted(&self, candidate: &Candidate, minimum: &Minimum) -> Option<FittedLaw> {
        let (law, start) = self.decode(candidate, &minimum.unknowns);
        let error = (minimum.cost / (self.points.len() * self.motion.poses.len()) as f64).sqrt();
        let support = self.support.filter(|_| candidate.rigid_constraint);
        (error.is_finite() && law.is_passive()).then_some(FittedLaw { support, law, start, error })
    }

    /// Law and initial state of the unknowns: the law's, then changes of the smooth start.
    fn decode(&self, candidate: &Candidate, unknowns: &[f64]) -> (Law, Start) {
        let (of_law, of_start) = unknowns.split_at(candidate.terms.unknowns());
        let law = candidate.terms.law(self.center, of_law);
        let three = |i: usize| DVec3::from_slice(&of_start[i..]);
        let mut start = self.base;
        start.pose.shift += three(0);
        start.rate.shift += three(3);
        match self.motion.kind {
            PoseKind::Rigid => {
                start.pose.linear = rotation_by(three(6)) * start.pose.linear;
                let spin = angular_velocity(&self.base.pose.linear, &self.base.rate.linear);
                start.rate.linear = cross_matrix(spin + three(9)) * start.pose.linear;
            }
            PoseKind::Affine => {
                start.pose.linear += DMat3::from_cols_slice(&of_start[6..15]);
                start.rate.linear += DMat3::from_cols_slice(&of_start[15..24]);
            }
        }
        (law, start)
    }

    /// Position errors of the rollout, every sigma point at every sample.
    fn residual(&self, candidate: &Candidate, unknowns: &[f64]) -> Vec<f64> {
        let (law, start) = self.decode(candidate, unknowns);
        let support = self.support.as_ref().filter(|_| candidate.rigid_constraint);
        let mut rollout = Rollout::new(&law, &start, support, &self.points, self.motion.dt());
        let mut out = Vec::with_capacity(self.points.len() * self.motion.poses.len() * 3);
        for (sample, pose) in self.motion.poses.iter().enumerate() {
            if sample > 0 {
                rollout.step();
            }
            for (i, &b) in self.points.iter().enumerate() {
                out.extend((rollout.position(i) - pose.apply(b)).to_array());
            }
        }
        out
    }
}

/// The start of the smooth poses: of a rigid motion exactly a rotation and an angular velocity.
fn smooth_start(motion: &SmoothMotion) -> Start {
    let t0 = motion.shared.times[0];
    let (mut pose, mut rate) = (motion.at(t0, Order::Value), motion.at(t0, Order::First));
    if motion.shared.kind == PoseKind::Rigid {
        pose.linear = nearest_rotation(&pose.linear);
        rate.linear = cross_matrix(angular_velocity(&pose.linear, &rate.linear)) * pose.linear;
    }
    Start { pose, rate }
}
