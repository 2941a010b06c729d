//! The paper's stage 1: U, Q and every particle's own starting velocity learn from the source's trajectories
//! by rollouts under local rigid alignment (Eq. 7). No law, no shared motion and no constraint stands before
//! or beside it; what the paper leaves open is a configuration key.

mod gradient;
mod learner;
mod lesson;
mod on_device;

use super::descent::{Descent, Tick};
use super::matching::match_accelerations;
use crate::config::{DistillConfig, TargetKind};
use crate::distilled::DistilledParticles;
use crate::error::DistillError;
use crate::motion::denoise::denoise;
use crate::progress::{DistillProgress, DistillStage};
use crate::report::DistillReport;
use crate::trajectories::Trajectories;
use gradient::gradient;
use learner::Learner;
use lesson::Lesson;
use lgs_dynamics::tensor::processor;
use on_device::LessonOnDevice;

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
        device: &config.device,
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
    teach(&lesson, &mut learner, &mut |tick| progress(told(tick)));
    let distilled = learner.distilled(&lesson, DistillReport::of_motion(&motion));
    let diverged = DistillError::Diverged { stage: "distillation" };
    if distilled.is_finite() { Ok(distilled) } else { Err(diverged) }
}

/// Fits parameters and starting velocities to the targets (Eq. 7, in units of the length scale). A step
/// whose rollout leaves the finite numbers changes nothing.
fn teach(lesson: &Lesson<'_>, learner: &mut Learner, tick: &mut dyn FnMut(Tick)) {
    let config = lesson.config;
    let parameters = learner.system.params.len();
    let mut of_system = Descent::new(parameters, config.learning_rate, config.steps);
    let mut of_velocities = Descent::new(learner.changes.len(), config.velocity_learning_rate, config.steps);
    let on_device = (*lesson.device != processor()).then(|| LessonOnDevice::new(lesson));
    let mut exercise = lesson.exercise(0);
    for step in 0..config.steps {
        let (gradient, next) = std::thread::scope(|scope| {
            let next = scope.spawn(|| lesson.exercise(step + 1));
            let gradient = match &on_device {
                Some(on_device) => on_device.gradient(learner, &exercise),
                None => gradient(lesson, learner, &exercise),
            };
            (gradient, next.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
        });
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
        exercise = next;
    }
}
