//! What the paper's stage 1 learns.

use super::lesson::Lesson;
use crate::config::DistillConfig;
use crate::distilled::DistilledParticles;
use crate::motion::object_motion::ObjectMotion;
use crate::networks::force_ratio::force_ratio;
use crate::report::DistillReport;
use lgs_core::geometry::wide;
use lgs_dynamics::{State, System, SystemConfig};
use std::sync::Arc;

/// What is learned: U, Q, and every starting velocity as its change from a first value.
pub(super) struct Learner {
    pub(super) system: System,
    first_velocities: Vec<[f32; 3]>,
    /// `[3 n]`, in units of the speed scale.
    pub(super) changes: Vec<f32>,
}

impl Learner {
    /// Networks from a random start, and starting velocities from the first samples.
    pub(super) fn new(lesson: &Lesson<'_>, motion: &ObjectMotion, config: &DistillConfig) -> Self {
        let system = SystemConfig {
            potential: config.potential,
            force: config.force,
            hidden: config.hidden,
            hidden_layers: config.hidden_layers,
            normalisation: motion.scales,
        };
        let first_velocities = lesson.first_velocities();
        let changes = vec![0.0; 3 * first_velocities.len()];
        Self { system: System::init(system, lesson.seed), first_velocities, changes }
    }

    fn velocity(&self, particle: usize) -> [f32; 3] {
        let (first, speed) = (self.first_velocities[particle], self.system.config.normalisation.speed);
        std::array::from_fn(|i| first[i] + speed * self.changes[3 * particle + i])
    }

    /// Some particles at the first sample.
    pub(super) fn start(&self, lesson: &Lesson<'_>, particles: &[usize]) -> State {
        let q = particles.iter().map(|&j| lesson.targets[0][j]).collect();
        State::at_start(q, particles.iter().map(|&j| self.velocity(j)).collect())
    }

    /// The result, with the errors of its rollout.
    pub(super) fn distilled(self, lesson: &Lesson<'_>, before: DistillReport) -> DistilledParticles {
        let all: Vec<usize> = (0..self.first_velocities.len()).collect();
        let supports = lesson.supports_among(&all).map(Arc::new);
        let start = self.start(lesson, &all);
        let call = lesson.call(self.system.config, lesson.targets.len() - 1, supports);
        let states = start.rolled_on(lesson.device, &self.system.params, call);
        let distance = |(&a, &b): (&[f32; 3], &[f32; 3])| wide(a).distance_squared(wide(b));
        let squares =
            states.iter().zip(lesson.targets).flat_map(|(s, row)| s.q.iter().zip(row).map(distance));
        let window_error = (squares.sum::<f64>() / (all.len() * states.len()) as f64).sqrt();
        let q: Vec<[f32; 3]> = states.iter().flat_map(|state| state.q.iter().copied()).collect();
        let v: Vec<[f32; 3]> = states.iter().flat_map(|state| state.v.iter().copied()).collect();
        let force_ratio = force_ratio(&self.system, &q, &v);
        DistilledParticles {
            q0: lesson.targets[0].clone(),
            v0: all.iter().map(|&particle| self.velocity(particle)).collect(),
            system: self.system,
            shared_support: None,
            report: DistillReport { networks: true, window_error, force_ratio, ..before },
        }
    }
}
