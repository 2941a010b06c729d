//! How much of the acceleration is force and how much is potential, and a summary of each object.
//!
//! Scaling the potential means something only where Q is small, since Q can contain a gradient.

use lgs_model::{LagrangianScene, Motion, ObjectModel, SceneState};

use super::{centroid, length, window_steps};
use crate::finite;
use crate::metrics::ObjectSummary;
use crate::thresholds::STATE_STRIDE;

/// Sums of magnitudes at the states visited.
#[derive(Clone, Copy, Default)]
struct Magnitudes {
    force: f64,
    gradient: f64,
}

/// Mean ‖Q‖ over mean ‖∇U‖ over the captured window, and a summary of every object.
#[must_use]
pub fn forces_and_objects(
    scene: &LagrangianScene,
    motion: &mut Motion<'_>,
) -> (Option<f64>, Vec<ObjectSummary>) {
    let states = motion.states(window_steps(&scene.motion));
    let per_object: Vec<Magnitudes> = scene.objects.iter().map(|object| magnitudes(object, states)).collect();
    let total = per_object.iter().fold(Magnitudes::default(), |sum, m| Magnitudes {
        force: sum.force + m.force,
        gradient: sum.gradient + m.gradient,
    });
    let objects =
        scene.objects.iter().zip(&per_object).map(|(object, m)| summary(scene, object, states, *m)).collect();
    (ratio(total), objects)
}

fn ratio(m: Magnitudes) -> Option<f64> {
    finite(m.force / m.gradient)
}

fn magnitudes(object: &ObjectModel, states: &[SceneState]) -> Magnitudes {
    let mut sum = Magnitudes::default();
    for state in states.iter().step_by(STATE_STRIDE) {
        let (q, v) = (&state.q[object.members.clone()], &state.v[object.members.clone()]);
        sum.force += object.system.forces(q, v).iter().map(|&f| length(f)).sum::<f64>();
        sum.gradient += object.system.potential_gradients(q).iter().map(|&g| length(g)).sum::<f64>();
    }
    sum
}

fn summary(
    scene: &LagrangianScene,
    object: &ObjectModel,
    states: &[SceneState],
    m: Magnitudes,
) -> ObjectSummary {
    let center_of = |state: &SceneState| centroid(&state.q[object.members.clone()]);
    let (start, end) = match states {
        [first, .., last] => (center_of(first), center_of(last)),
        _ => ([0.0; 3], [0.0; 3]),
    };
    let span = (states.len().max(2) - 1) as f64 * f64::from(scene.motion.dt);
    ObjectSummary {
        gaussians: object.members.len(),
        center: start.map(|c| c as f32),
        mean_velocity: std::array::from_fn(|c| ((end[c] - start[c]) / span) as f32),
        force_ratio: ratio(m),
        law: None,
    }
}
