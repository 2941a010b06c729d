//! The paper's stage 1: U, Q and every particle's own starting velocity learn from the source's trajectories
//! by rollouts under local rigid alignment (Eq. 7). No law, no shared motion and no constraint stands before
//! or beside it; what the paper leaves open is a configuration key.

use super::descent::{Descent, Tick};
use super::force_ratio::force_ratio;
use super::matching::{add_force_penalty, match_accelerations};
use crate::config::{Alignment, DistillConfig, RolloutConfig, TargetKind};
use crate::distilled::DistilledParticles;
use crate::error::DistillError;
use crate::motion::curve::{Curve, Order};
use crate::motion::denoise::denoise;
use crate::motion::object_motion::ObjectMotion;
use crate::progress::{DistillProgress, DistillStage};
use crate::report::DistillReport;
use crate::thresholds::VELOCITY_SAMPLES;
use crate::trajectories::Trajectories;
use lgs_core::geometry::wide;
use lgs_core::linear;
use lgs_dynamics::{
    RolloutSpec, State, StateCotangents, Supports, System, SystemConfig, rollout, rollout_vjp,
};
use rand::RngExt;
use rand::seq::index::sample;

/// Learns the networks and starting velocities of an object; an error if they left the finite numbers.
pub(crate) fn distill_networks(
    trajectories: &Trajectories,
    config: &DistillConfig,
    seed: u64,
    progress: &mut dyn FnMut(DistillProgress),
) -> Result<DistilledParticles, DistillError> {
    let motion = denoise(trajectories, config);
    let denoised = (config.rollout.targets == TargetKind::Denoised).then(|| motion.paths.positions());
    let lesson = Lesson {
        targets: denoised.as_ref().unwrap_or(&trajectories.positions),
        dt: trajectories.dt(),
        config: &config.rollout,
        alignment: config.alignment,
        seed,
    };
    let mut learner = Learner::new(&lesson, &motion, config);
    let tell = |stage, steps| {
        move |tick: Tick| DistillProgress { stage, step: tick.step + 1, steps, loss: Some(tick.loss) }
    };
    let matching = &config.matching;
    if matching.steps > 0 {
        let told = tell(DistillStage::Matching, matching.steps);
        let paths = motion.paths.part(&motion.paths.spread(matching.particles), motion.paths.samples());
        let system = &mut learner.system;
        match_accelerations(system, &paths, matching, seed, &mut |tick| progress(told(tick)));
    }
    let told = tell(DistillStage::Rollout, config.rollout.steps);
    lesson.teach(&mut learner, &mut |tick| progress(told(tick)));
    let distilled = learner.distilled(&lesson, DistillReport::of_motion(&motion));
    let diverged = DistillError::Diverged { stage: "distillation" };
    if distilled.is_finite() { Ok(distilled) } else { Err(diverged) }
}

/// What is learned: U, Q, and every starting velocity as its change from a first value.
struct Learner {
    system: System,
    first_velocities: Vec<[f32; 3]>,
    /// `[3 n]`, in units of the speed scale.
    changes: Vec<f32>,
}

impl Learner {
    fn new(lesson: &Lesson<'_>, motion: &ObjectMotion, config: &DistillConfig) -> Self {
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

    fn distilled(self, lesson: &Lesson<'_>, before: DistillReport) -> DistilledParticles {
        let all: Vec<usize> = (0..self.first_velocities.len()).collect();
        let supports = lesson.supports_among(&all);
        let states = lesson.roll(&self, &all, (lesson.targets.len() - 1, supports.as_ref()));
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

/// The trajectories that rollouts learn from.
struct Lesson<'a> {
    /// `[T][n]` positions at samples that are a step apart, world units.
    targets: &'a [Vec<[f32; 3]>],
    dt: f32,
    config: &'a RolloutConfig,
    alignment: Option<Alignment>,
    seed: u64,
}

/// Loss of a rollout, and its gradients by the parameters and the starting velocities `[n, 3]`.
struct Gradient {
    loss: f32,
    of_system: Vec<f32>,
    of_velocities: Vec<[f32; 3]>,
}

/// The particles of a step, the samples that they are rolled over, and how far gradients reach back.
struct Exercise {
    particles: Vec<usize>,
    horizon: usize,
    window: usize,
    /// Sample whose forces are penalised: one drawn at random stands for the mean over all.
    penalised: usize,
}

impl Lesson<'_> {
    /// Starting velocities `[n]` from parabolas through the first samples, half a kick behind (method §4.3).
    fn first_velocities(&self) -> Vec<[f32; 3]> {
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
    fn supports_among(&self, particles: &[usize]) -> Option<Supports> {
        let points: Vec<[f32; 3]> = particles.iter().map(|&j| self.targets[0][j]).collect();
        self.alignment.filter(|_| points.len() > 1).map(|own| Supports::nearest(&points, own.support))
    }

    fn spec<'s>(&self, steps: usize, supports: Option<&'s Supports>) -> RolloutSpec<'s> {
        let spec = RolloutSpec::new(self.dt, steps);
        match (supports, self.alignment) {
            (Some(supports), Some(own)) => spec.aligned(supports, own.velocity_policy),
            _ => spec,
        }
    }

    /// States of some particles from the first sample on, one per step.
    fn roll(
        &self,
        learner: &Learner,
        particles: &[usize],
        (steps, supports): (usize, Option<&Supports>),
    ) -> Vec<State> {
        let q = particles.iter().map(|&j| self.targets[0][j]).collect();
        let v = particles.iter().map(|&j| learner.velocity(j)).collect();
        rollout(&learner.system, &State::at_start(q, v), &self.spec(steps, supports))
    }

    /// Fits parameters and starting velocities to the targets (Eq. 7, in units of the length scale). A step
    /// whose rollout leaves the finite numbers changes nothing.
    fn teach(&self, learner: &mut Learner, tick: &mut dyn FnMut(Tick)) {
        let config = self.config;
        let parameters = learner.system.params.len();
        let mut of_system = Descent::new(parameters, config.learning_rate, config.steps);
        let mut of_velocities =
            Descent::new(learner.changes.len(), config.velocity_learning_rate, config.steps);
        for step in 0..config.steps {
            let exercise = self.exercise(step);
            let gradient = self.gradient(learner, &exercise);
            let loss = gradient.as_ref().map_or(f32::INFINITY, |gradient| gradient.loss);
            if let Some(gradient) = gradient {
                let speed = learner.system.config.normalisation.speed;
                let mut changes = vec![0.0; learner.changes.len()];
                for (&particle, row) in exercise.particles.iter().zip(&gradient.of_velocities) {
                    (0..3).for_each(|i| changes[3 * particle + i] = speed * row[i]);
                }
                of_system.step(step, &mut learner.system.params, gradient.of_system);
                of_velocities.step(step, &mut learner.changes, changes);
            }
            tick(Tick { step, loss });
        }
    }

    fn exercise(&self, step: usize) -> Exercise {
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
        Exercise { particles, horizon, window, penalised: rng.random_range(0..=horizon) }
    }

    /// Nothing if the rollout leaves the finite numbers.
    fn gradient(&self, learner: &Learner, exercise: &Exercise) -> Option<Gradient> {
        let &Exercise { ref particles, horizon, window, penalised } = exercise;
        let supports = self.supports_among(particles);
        let states = self.roll(learner, particles, (horizon, supports.as_ref()));
        let unit = learner.system.config.normalisation.length;
        let weight = 2.0 / (unit * unit * (particles.len() * horizon) as f32);
        let mut loss = 0.0;
        let mut cotangents_of = |(state, targets): (&State, &Vec<[f32; 3]>)| {
            let error = |(&q, &j): (&[f32; 3], &usize)| linear::sub(q, targets[j]);
            let errors: Vec<[f32; 3]> = state.q.iter().zip(particles).map(error).collect();
            loss += errors.iter().map(|&e| 0.5 * weight * linear::dot(e, e)).sum::<f32>();
            let q = errors.into_iter().map(|e| linear::scale(e, weight)).collect();
            StateCotangents { q, ..StateCotangents::default() }
        };
        let mut cotangents: Vec<StateCotangents> =
            states.iter().zip(self.targets).map(&mut cotangents_of).collect();
        if !loss.is_finite() {
            return None;
        }
        let mut of_system = vec![0.0; learner.system.params.len()];
        let mut of_velocities = Vec::new();
        for first in (0..horizon).step_by(window.max(1)) {
            let last = (first + window).min(horizon);
            // The state that a window starts from is a constant of it; its error belongs to the one before.
            cotangents[first] = StateCotangents::default();
            let spec = self.spec(last - first, supports.as_ref());
            let part = rollout_vjp(&learner.system, &spec, &states[first..=last], &cotangents[first..=last]);
            of_system.iter_mut().zip(part.params).for_each(|(sum, own)| *sum += own);
            if first == 0 {
                of_velocities = part.v0;
            }
        }
        let State { q, v, .. } = &states[penalised];
        add_force_penalty(&learner.system, q, v, self.config.force_penalty, &mut of_system);
        let is_finite = of_system.iter().chain(of_velocities.as_flattened()).all(|g| g.is_finite());
        is_finite.then_some(Gradient { loss, of_system, of_velocities })
    }
}
