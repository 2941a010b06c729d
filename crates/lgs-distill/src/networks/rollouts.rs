//! Rollout distillation (Eq. 7): U, Q and the starting velocities learn from whole rollouts with a growing
//! horizon, which removes what smoothing and discretisation have left.

use super::descent::{Descent, Tick};
use super::matching::add_force_penalty;
use super::velocity_field::{UNKNOWNS, VelocityField};
use crate::config::RolloutConfig;
use crate::motion::paths::Paths;
use lgs_core::geometry::{narrow, wide};
use lgs_core::linear;
use lgs_dynamics::{
    RolloutSpec, State, StateCotangents, Supports, System, VelocityPolicy, rollout, rollout_vjp,
};
use rand::RngExt;
use std::ops::Range;

/// The paths that rollouts learn from, and the constraint they are under.
#[derive(Clone, Copy)]
pub(crate) struct Lesson<'a> {
    /// Smooth paths of the particles.
    pub(crate) paths: &'a Paths,
    /// Supports of all particles of the paths, which are then rolled out together; none: particles are
    /// independent.
    pub(crate) supports: Option<&'a Supports>,
    /// Whether Q is left as it is.
    pub(crate) force_is_fixed: bool,
}

/// A system with the correction of its starting velocities.
#[derive(Clone)]
pub(crate) struct Pupil {
    /// U and Q.
    pub(crate) system: System,
    /// Correction of the starting velocities.
    pub(crate) field: VelocityField,
}

impl Lesson<'_> {
    /// States of some particles from the first sample on, one per step.
    pub(crate) fn rollout(&self, pupil: &Pupil, particles: &[usize], steps: usize) -> Vec<State> {
        let start = pupil.field.start(&pupil.system, self.paths, particles);
        rollout(&pupil.system, &start, &self.spec(steps))
    }

    /// Root mean square position error of rollouts of these particles at some samples of the paths (infinite
    /// if not finite).
    pub(crate) fn error(&self, pupil: &Pupil, particles: &[usize], samples: Range<usize>) -> f64 {
        let states = self.rollout(pupil, particles, samples.end - 1);
        let mut sum = 0.0;
        for sample in samples.clone() {
            for (&q, &j) in states[sample].q.iter().zip(particles) {
                sum += wide(q).distance_squared(self.paths.position(j, sample));
            }
        }
        let mean = sum / (samples.len() * particles.len()).max(1) as f64;
        if mean.is_finite() { mean.sqrt() } else { f64::INFINITY }
    }

    /// Fits parameters and velocity field to the positions of the paths (Eq. 7, in units of the length
    /// scale).
    pub(crate) fn refine(
        &self,
        pupil: &mut Pupil,
        config: &RolloutConfig,
        seed: u64,
        tick: &mut dyn FnMut(Tick),
    ) {
        let parameters = pupil.system.params.len();
        let mut of_system = Descent::new(parameters, config.learning_rate, config.steps);
        let mut of_field = Descent::new(UNKNOWNS, config.velocity_learning_rate, config.steps);
        let window = self.paths.samples() - 1;
        let first = config.first_horizon.min(window);
        for step in 0..config.steps {
            let particles = self.batch(config.particles, seed, step);
            let horizon = (first + (window - first) * 2 * step / config.steps.max(1)).min(window);
            let mut gradient = self.gradient(pupil, &particles, horizon, config.force_penalty);
            if self.force_is_fixed {
                let arrays = pupil.system.layout().into_iter();
                let of_force = arrays.filter(|array| array.name.starts_with("force."));
                of_force.for_each(|array| gradient.of_system[array.range].fill(0.0));
            }
            of_system.step(step, &mut pupil.system.params, gradient.of_system);
            of_field.step(step, &mut pupil.field.values, gradient.of_field);
            tick(Tick { step, loss: gradient.loss });
        }
    }

    fn spec(&self, steps: usize) -> RolloutSpec<'_> {
        let spec = RolloutSpec::new(self.paths.dt(), steps);
        match self.supports {
            Some(supports) => spec.aligned(supports, VelocityPolicy::Rigid),
            None => spec,
        }
    }

    /// Particles of a step: all where they are rolled out together, else up to `count` at random.
    fn batch(&self, count: usize, seed: u64, step: usize) -> Vec<usize> {
        let all = self.paths.len();
        if self.supports.is_some() {
            return (0..all).collect();
        }
        let mut rng = lgs_core::stream(seed, "rollout distillation", step as u64);
        (0..count.min(all)).map(|_| rng.random_range(0..all)).collect()
    }

    fn gradient(&self, pupil: &Pupil, particles: &[usize], horizon: usize, force_penalty: f32) -> Gradient {
        let spec = self.spec(horizon);
        let states = self.rollout(pupil, particles, horizon);
        let unit = pupil.system.config.normalisation.length;
        let weight = 2.0 / (unit * unit * (particles.len() * horizon) as f32);
        let mut loss = 0.0;
        let mut cotangents_of = |(sample, state): (usize, &State)| {
            let error = |(&q, &j)| narrow(wide(q) - self.paths.position(j, sample));
            let errors: Vec<[f32; 3]> = state.q.iter().zip(particles).map(error).collect();
            loss += errors.iter().map(|&e| 0.5 * weight * linear::dot(e, e)).sum::<f32>();
            let q = errors.into_iter().map(|e| linear::scale(e, weight)).collect();
            StateCotangents { q, ..StateCotangents::default() }
        };
        let cotangents: Vec<StateCotangents> = states.iter().enumerate().map(&mut cotangents_of).collect();
        let mut gradients = rollout_vjp(&pupil.system, &spec, &states, &cotangents);
        let middle = &states[horizon / 2];
        add_force_penalty(&pupil.system, &middle.q, &middle.v, force_penalty, &mut gradients.params);
        let of_field = VelocityField::start_vjp(&pupil.system, &states[0].q, &gradients.v0);
        Gradient { loss, of_system: gradients.params, of_field }
    }
}

/// Loss of a batch of rollouts, and its gradients.
struct Gradient {
    loss: f32,
    of_system: Vec<f32>,
    of_field: Vec<f32>,
}
