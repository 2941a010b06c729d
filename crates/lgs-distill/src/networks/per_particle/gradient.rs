//! The gradient of a step on the processor.

use super::learner::Learner;
use super::lesson::{Exercise, Lesson};
use crate::networks::matching::add_force_penalty;
use lgs_core::linear;
use lgs_dynamics::{State, StateCotangents, rollout, rollout_vjp};

/// Loss of a rollout, and its gradients by the parameters and the starting velocities `[n, 3]`.
pub(super) struct Gradient {
    pub(super) loss: f32,
    pub(super) of_system: Vec<f32>,
    pub(super) of_velocities: Vec<[f32; 3]>,
}

/// Nothing if the rollout leaves the finite numbers.
pub(super) fn gradient(lesson: &Lesson<'_>, learner: &Learner, exercise: &Exercise) -> Option<Gradient> {
    let &Exercise { ref particles, ref supports, horizon, window, penalised } = exercise;
    let call = |steps| lesson.call(learner.system.config, steps, supports.clone());
    let states = rollout(&learner.system, &learner.start(lesson, particles), &call(horizon).spec());
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
        states.iter().zip(lesson.targets).map(&mut cotangents_of).collect();
    if !loss.is_finite() {
        return None;
    }
    let mut of_system = vec![0.0; learner.system.params.len()];
    let mut of_velocities = Vec::new();
    for first in (0..horizon).step_by(window.max(1)) {
        let last = (first + window).min(horizon);
        // The state that a window starts from is a constant of it; its error belongs to the one before.
        cotangents[first] = StateCotangents::default();
        let (call, part) = (call(last - first), first..=last);
        let part = rollout_vjp(&learner.system, &call.spec(), &states[part.clone()], &cotangents[part]);
        of_system.iter_mut().zip(part.params).for_each(|(sum, own)| *sum += own);
        if first == 0 {
            of_velocities = part.v0;
        }
    }
    let State { q, v, .. } = &states[penalised];
    add_force_penalty(&learner.system, q, v, lesson.config.force_penalty, &mut of_system);
    let is_finite = of_system.iter().chain(of_velocities.as_flattened()).all(|g| g.is_finite());
    is_finite.then_some(Gradient { loss, of_system, of_velocities })
}
