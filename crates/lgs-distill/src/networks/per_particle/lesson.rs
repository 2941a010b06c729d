//! The trajectories that the paper's networks learn from, and what is taken from them in a step.

use crate::config::{Alignment, RolloutConfig};
use crate::motion::curve::{Curve, Order};
use crate::thresholds::VELOCITY_SAMPLES;
use burn::tensor::Device;
use lgs_dynamics::tensor::RolloutCall;
use lgs_dynamics::{Edit, Supports, SystemConfig};
use rand::RngExt;
use rand::seq::index::sample;
use std::sync::Arc;

/// The trajectories that rollouts learn from.
pub(super) struct Lesson<'a> {
    /// `[T][n]` positions at samples that are a step apart, world units.
    pub(super) targets: &'a [Vec<[f32; 3]>],
    pub(super) dt: f32,
    pub(super) config: &'a RolloutConfig,
    pub(super) alignment: Option<Alignment>,
    /// Where particles are rolled.
    pub(super) device: &'a Device,
    pub(super) seed: u64,
}

/// The particles of a step, the samples that they are rolled over, and how far gradients reach back.
pub(super) struct Exercise {
    pub(super) particles: Vec<usize>,
    /// The particles' supports among themselves.
    pub(super) supports: Option<Arc<Supports>>,
    pub(super) horizon: usize,
    pub(super) window: usize,
    /// Sample whose forces are penalised: one drawn at random stands for the mean over all.
    pub(super) penalised: usize,
}

impl Lesson<'_> {
    /// Starting velocities `[n]` from parabolas through the first samples, half a kick behind (method §4.3).
    pub(super) fn first_velocities(&self) -> Vec<[f32; 3]> {
        let known = &self.targets[..VELOCITY_SAMPLES.min(self.targets.len())];
        let times: Vec<f64> = (0..known.len()).map(|sample| f64::from(self.dt) * sample as f64).collect();
        let values: Vec<f64> = known.iter().flatten().flatten().map(|&x| f64::from(x)).collect();
        let curve = Curve::fit(&times, &values, 3 * known[0].len(), 2);
        let (velocity, acceleration) = (curve.at(0.0, Order::First), curve.at(0.0, Order::Second));
        let half = 0.5 * f64::from(self.dt);
        let start: Vec<f32> = velocity.iter().zip(acceleration).map(|(v, a)| (v - half * a) as f32).collect();
        start.as_chunks::<3>().0.to_vec()
    }

    /// Supports of some particles among themselves, at the first sample.
    pub(super) fn supports_among(&self, particles: &[usize]) -> Option<Supports> {
        let points: Vec<[f32; 3]> = particles.iter().map(|&j| self.targets[0][j]).collect();
        self.alignment.filter(|_| points.len() > 1).map(|own| Supports::nearest(&points, own.support))
    }

    /// The constants of a rollout over some steps, within supports if there are any.
    pub(super) fn call(
        &self,
        config: SystemConfig,
        steps: usize,
        supports: Option<Arc<Supports>>,
    ) -> RolloutCall {
        let velocity_policy = self.alignment.map(|own| own.velocity_policy).unwrap_or_default();
        let (dt, edit) = (self.dt, Edit::default());
        RolloutCall { config, dt, steps, last_dt: None, edit, supports, velocity_policy }
    }

    /// What is exercised in a step.
    pub(super) fn exercise(&self, step: usize) -> Exercise {
        let config = self.config;
        let mut rng = lgs_core::stream(self.seed, "networks by rollouts", step as u64);
        let all = self.targets[0].len();
        let mut particles = sample(&mut rng, all, config.particles.min(all)).into_vec();
        particles.sort_unstable();
        let last = self.targets.len() - 1;
        let first = config.first_horizon.min(last);
        let horizon = (first + (last - first) * 2 * step / config.steps.max(1)).min(last);
        let is_full = config.full_window_every > 0 && step.is_multiple_of(config.full_window_every);
        let window = if is_full || config.window_steps == 0 { horizon } else { config.window_steps };
        let supports = self.supports_among(&particles).map(Arc::new);
        Exercise { particles, supports, horizon, window, penalised: rng.random_range(0..=horizon) }
    }
}
