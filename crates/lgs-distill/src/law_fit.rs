//! Fitting a linear law and the initial state of a shared motion to its poses, by rollouts.
//!
//! Start: ridge least squares of the second differences of the smooth poses (Eq. 5 is `q⁺ − 2q + q⁻ = dt²
//! a(q, (q − q⁻)/dt)`, so second and backward differences are exactly consistent with it). Then
//! Levenberg–Marquardt on positions (Eq. 7 restricted to a dozen unknowns): the state is a pose and a
//! velocity field, the particles are the six sigma points, so that a rollout costs microseconds and Jacobians
//! by finite differences are affordable.

use crate::acceleration_match::NormalEquations;
use crate::chebyshev::Order;
use crate::dense::{M3, V3, add, cross, mat_mul, rotation_of_vector, scale, solve_positive, sub};
use crate::fitted_law::{Candidate, FittedLaw, Start};
use crate::law::Law;
use crate::pose::{PoseKind, SmoothPose, angular_velocity};
use crate::rigid_body::Anchoring;
use crate::shared_motion::SharedMotion;

/// Iterations of Levenberg–Marquardt; it stops by itself long before.
const ITERATIONS: usize = 40;
/// Relative improvement at which it stops.
const CONVERGED: f64 = 1e-9;

/// The problem of one window.
pub(crate) struct LawFit<'a> {
    motion: &'a SharedMotion,
    points: Vec<V3>,
    dt: f64,
    center: V3,
    /// The smooth poses' start.
    base: Start,
    anchoring: Anchoring,
    /// Normal equations of the full linear law at particles.
    particles: NormalEquations,
    /// The same at the anchors' centroid.
    centroid: NormalEquations,
}

impl<'a> LawFit<'a> {
    /// Prepares the fits of a window.
    pub(crate) fn new(
        motion: &'a SharedMotion,
        smooth: &SmoothPose,
        center: V3,
        anchoring: Anchoring,
    ) -> Self {
        let dt = (motion.times[motion.times.len() - 1] - motion.times[0]) / (motion.times.len() - 1) as f64;
        let t0 = motion.times[0];
        let mut rate = smooth.at(t0, Order::First);
        let pose = match motion.kind {
            PoseKind::Affine => smooth.at(t0, Order::Value),
            PoseKind::Rigid => {
                let mut pose = smooth.at(t0, Order::Value);
                pose.linear = crate::dense::nearest_rotation(&pose.linear);
                let spin = angular_velocity(&pose.linear, &rate.linear);
                rate.linear = spun(spin, &pose.linear);
                pose
            }
        };
        let mut fit = Self {
            motion,
            points: motion.sigma_points(),
            dt,
            center,
            base: Start { pose, rate },
            anchoring,
            particles: NormalEquations::EMPTY,
            centroid: NormalEquations::EMPTY,
        };
        fit.accumulate(smooth);
        fit
    }

    /// Adds every sample's second difference to the normal equations.
    fn accumulate(&mut self, smooth: &SmoothPose) {
        let dt = self.dt;
        for &t in &self.motion.times {
            let [before, now, after] = [t - dt, t, t + dt].map(|t| smooth.at(t, Order::Value));
            let center = self.center;
            let equation = |b: V3| {
                let (x0, x1, x2) = (before.apply(b), now.apply(b), after.apply(b));
                let acceleration = scale(sub(add(x0, x2), scale(x1, 2.0)), 1.0 / (dt * dt));
                (sub(x1, center), scale(sub(x1, x0), 1.0 / dt), acceleration)
            };
            for &b in &self.points {
                let (q, v, a) = equation(b);
                self.particles.add(q, v, a);
            }
            let (q, v, a) = equation(self.anchoring.centroid);
            self.centroid.add(q, v, a);
        }
    }

    /// Levenberg–Marquardt from the law that matches the particles' accelerations; for a rigid body also from
    /// the one that matches those of the centroid and from none, and the best is kept: rollouts of a rigid
    /// body have valleys of their own, and no one start leads into the deepest every time. `None` if nothing
    /// finite comes of it or the damping is negative.
    pub(crate) fn fit(&self, candidate: &Candidate) -> Option<FittedLaw> {
        let by_particles = self.particles.solve(&candidate.terms, self.center);
        let starts = if candidate.rigid_constraint {
            vec![self.centroid.solve(&candidate.terms, self.center), by_particles, Law::free(self.center)]
        } else {
            vec![by_particles]
        };
        let descents = starts.iter().map(|law| {
            let mut unknowns = law.unknowns(&candidate.terms);
            unknowns.resize(unknowns.len() + self.start_unknowns(), 0.0);
            self.descend(candidate, unknowns, 0)
        });
        let (unknowns, cost) = descents.reduce(|best, next| if next.1 < best.1 { next } else { best })?;
        self.fitted(candidate, &unknowns, cost)
    }

    /// The best start of a body that is held rigid and follows a law fitted to independent particles. `None`
    /// if nothing finite comes of it.
    pub(crate) fn held(&self, law: &Law, candidate: &Candidate) -> Option<FittedLaw> {
        let candidate = Candidate { rigid_constraint: true, ..*candidate };
        let mut unknowns = law.unknowns(&candidate.terms);
        let fixed = unknowns.len();
        unknowns.resize(fixed + self.start_unknowns(), 0.0);
        let (unknowns, cost) = self.descend(&candidate, unknowns, fixed);
        self.fitted(&candidate, &unknowns, cost)
    }

    /// What a descent came to.
    fn fitted(&self, candidate: &Candidate, unknowns: &[f64], cost: f64) -> Option<FittedLaw> {
        let (law, start) = self.decode(candidate, unknowns);
        let error = (cost / (self.points.len() * self.motion.poses.len()) as f64).sqrt();
        (error.is_finite() && law.damping >= 0.0).then_some(FittedLaw {
            anchoring: candidate.rigid_constraint.then_some(self.anchoring),
            law,
            start,
            error,
        })
    }

    /// Levenberg–Marquardt over the unknowns from `fixed` on: the unknowns where it stops, and the sum of
    /// squares there.
    fn descend(&self, candidate: &Candidate, mut unknowns: Vec<f64>, fixed: usize) -> (Vec<f64>, f64) {
        let mut residual = self.residual(candidate, &unknowns);
        let mut cost = sum_of_squares(&residual);
        let mut lambda = 1e-4;
        for _ in 0..ITERATIONS {
            let jacobian = self.jacobian(candidate, &unknowns, fixed, &residual);
            let mut improved = false;
            for _ in 0..8 {
                let Some(step) = damped_step(&jacobian, &residual, lambda) else {
                    lambda *= 10.0;
                    continue;
                };
                let mut trial = unknowns.clone();
                trial[fixed..].iter_mut().zip(&step).for_each(|(p, s)| *p -= s);
                let trial_residual = self.residual(candidate, &trial);
                let trial_cost = sum_of_squares(&trial_residual);
                if trial_cost < cost {
                    improved = cost - trial_cost > CONVERGED * cost;
                    (unknowns, residual, cost) = (trial, trial_residual, trial_cost);
                    lambda = (0.1 * lambda).max(1e-12);
                    break;
                }
                lambda *= 10.0;
            }
            if !improved {
                break;
            }
        }
        (unknowns, cost)
    }

    /// Unknowns of the initial state.
    fn start_unknowns(&self) -> usize {
        match self.motion.kind {
            PoseKind::Rigid => 12,
            PoseKind::Affine => 24,
        }
    }

    /// Law and initial state of the unknowns.
    fn decode(&self, candidate: &Candidate, unknowns: &[f64]) -> (Law, Start) {
        let (p, s) = unknowns.split_at(candidate.terms.unknowns());
        let law = Law::with_unknowns(self.center, &candidate.terms, p);
        let three = |i: usize| [s[i], s[i + 1], s[i + 2]];
        let mut start = self.base;
        start.pose.shift = add(start.pose.shift, three(0));
        start.rate.shift = add(start.rate.shift, three(3));
        match self.motion.kind {
            PoseKind::Rigid => {
                start.pose.linear = mat_mul(&rotation_of_vector(three(6)), &start.pose.linear);
                let spin = angular_velocity(&self.base.pose.linear, &self.base.rate.linear);
                start.rate.linear = spun(add(spin, three(9)), &start.pose.linear);
            }
            PoseKind::Affine => {
                for i in 0..9 {
                    start.pose.linear[i / 3][i % 3] += s[6 + i];
                    start.rate.linear[i / 3][i % 3] += s[15 + i];
                }
            }
        }
        (law, start)
    }

    /// Position errors of the rollout, every sigma point at every sample.
    fn residual(&self, candidate: &Candidate, unknowns: &[f64]) -> Vec<f64> {
        let (law, start) = self.decode(candidate, unknowns);
        let mut out = Vec::with_capacity(self.points.len() * self.motion.poses.len() * 3);
        if candidate.rigid_constraint {
            let mut body = start.body(&law, &self.anchoring, self.dt);
            for (i, pose) in self.motion.poses.iter().enumerate() {
                if i > 0 {
                    body.step(&law, &self.anchoring, self.dt);
                }
                out.extend(
                    self.points.iter().flat_map(|&b| sub(body.position(b, &self.anchoring), pose.apply(b))),
                );
            }
            return out;
        }
        for &b in &self.points {
            let (mut q, mut v) = start.state(&law, b, self.dt);
            for (i, pose) in self.motion.poses.iter().enumerate() {
                if i > 0 {
                    law.step(&mut q, &mut v, self.dt);
                }
                out.extend(sub(q, pose.apply(b)));
            }
        }
        out
    }

    /// Forward differences of the residual, one row per unknown from `fixed` on.
    fn jacobian(
        &self,
        candidate: &Candidate,
        unknowns: &[f64],
        fixed: usize,
        residual: &[f64],
    ) -> Vec<Vec<f64>> {
        let mut shifted = unknowns.to_vec();
        (fixed..unknowns.len())
            .map(|i| {
                let step = 1e-6 * unknowns[i].abs().max(1e-2);
                shifted[i] = unknowns[i] + step;
                let moved = self.residual(candidate, &shifted);
                shifted[i] = unknowns[i];
                moved.iter().zip(residual).map(|(a, b)| (a - b) / step).collect()
            })
            .collect()
    }
}

/// The Marquardt step: `(JJᵀ + λ diag) step = J r` for a Jacobian stored by unknown.
fn damped_step(jacobian: &[Vec<f64>], residual: &[f64], lambda: f64) -> Option<Vec<f64>> {
    let n = jacobian.len();
    let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
    let mut gram = vec![0.0; n * n];
    for i in 0..n {
        for j in 0..=i {
            gram[i * n + j] = product(&jacobian[i], &jacobian[j]);
        }
    }
    let largest = (0..n).map(|i| gram[i * n + i]).fold(0.0, f64::max);
    for i in 0..n {
        gram[i * n + i] += lambda * gram[i * n + i] + 1e-15 * largest + 1e-300;
    }
    let mut step: Vec<f64> = jacobian.iter().map(|row| product(row, residual)).collect();
    let solved = solve_positive(&mut gram, &mut step, n, 1);
    (solved && step.iter().all(|s| s.is_finite())).then_some(step)
}

/// Sum of squares, infinite if anything is not finite.
fn sum_of_squares(values: &[f64]) -> f64 {
    let sum: f64 = values.iter().map(|v| v * v).sum();
    if sum.is_finite() { sum } else { f64::INFINITY }
}

/// The derivative of a rotation that turns at `spin`.
fn spun(spin: V3, linear: &M3) -> M3 {
    let columns: [V3; 3] = std::array::from_fn(|j| cross(spin, [linear[0][j], linear[1][j], linear[2][j]]));
    std::array::from_fn(|i| std::array::from_fn(|j| columns[j][i]))
}
