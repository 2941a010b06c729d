//! Acceleration matching: U and Q learn the accelerations at visited states.
//!
//! It comes before rollouts because a force that is right everywhere rolls out right, and each state teaches
//! by itself.

use super::descent::{Descent, Tick};
use crate::config::MatchingConfig;
use crate::motion::paths::Paths;
use lgs_core::geometry::narrow;
use lgs_core::linear;
use lgs_dynamics::{Edit, ForceKind, System, acceleration_vjp};
use rand::RngExt;

/// The edit that leaves Q alone.
pub(crate) const FORCE_ONLY: Edit = Edit { velocity_scale: 1.0, potential_scale: 0.0, force_scale: 1.0 };

/// Fits the parameters to the accelerations of the paths. The loss is the mean squared error in units of the
/// acceleration scale.
pub(crate) fn match_accelerations(
    system: &mut System,
    paths: &Paths,
    config: &MatchingConfig,
    seed: u64,
    tick: &mut dyn FnMut(Tick),
) {
    let mut descent = Descent::new(system.params.len(), config.learning_rate, config.steps);
    let unit = system.config.normalisation.acceleration;
    for step in 0..config.steps {
        let mut rng = lgs_core::stream(seed, "acceleration matching", step as u64);
        let (mut q, mut v, mut target) = (Vec::new(), Vec::new(), Vec::new());
        for _ in 0..config.batch {
            let (particle, sample) = (rng.random_range(0..paths.len()), rng.random_range(0..paths.samples()));
            q.push(narrow(paths.position(particle, sample)));
            v.push(narrow(paths.velocity(particle, sample)));
            target.push(narrow(paths.acceleration(particle, sample)));
        }
        let found = system.accelerations(&q, &v, &Edit::default());
        let weight = 2.0 / (unit * unit * config.batch as f32);
        let errors: Vec<[f32; 3]> = found.iter().zip(&target).map(|(&a, &b)| linear::sub(a, b)).collect();
        let loss = errors.iter().map(|&e| linear::dot(e, e)).sum::<f32>() * 0.5 * weight;
        let cotangents: Vec<_> = errors.iter().map(|&e| linear::scale(e, weight)).collect();
        let mut gradient = acceleration_vjp(system, &q, &v, &Edit::default(), &cotangents).params;
        add_force_penalty(system, &q, &v, config.force_penalty, &mut gradient);
        descent.step(step, &mut system.params, gradient);
        tick(Tick { step, loss });
    }
}

/// Adds the gradient of `weight · mean |Q/σ_a|²` by the parameters: motion that a potential explains is to
/// belong to the potential.
pub(crate) fn add_force_penalty(
    system: &System,
    q: &[[f32; 3]],
    v: &[[f32; 3]],
    weight: f32,
    gradient: &mut [f32],
) {
    if weight == 0.0 || system.config.force == ForceKind::None {
        return;
    }
    let unit = system.config.normalisation.acceleration;
    let factor = 2.0 * weight / (unit * unit * q.len() as f32);
    let cotangents: Vec<_> = system.forces(q, v).iter().map(|&f| linear::scale(f, factor)).collect();
    let own = acceleration_vjp(system, q, v, &FORCE_ONLY, &cotangents).params;
    gradient.iter_mut().zip(own).for_each(|(g, o)| *g += o);
}
