//! How much of the acceleration is force and how much is potential, and a summary of each object.
//!
//! Scaling the potential means something only where Q is small, since Q can contain a gradient.

use lgs_model::{LagrangianScene, Motion, ObjectFields, ObjectModel, SceneState};

use super::{centroid, length, window_steps};
use crate::finite::finite;
use crate::metrics::ObjectSummary;
use crate::object_law::LawOutline;
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
    let steps = window_steps(&scene.motion);
    let per_object: Vec<Magnitudes> =
        (0..scene.objects.len()).map(|object| magnitudes(motion, object, steps)).collect();
    let total = per_object.iter().fold(Magnitudes::default(), |sum, m| Magnitudes {
        force: sum.force + m.force,
        gradient: sum.gradient + m.gradient,
    });
    let states = motion.states(steps);
    let objects =
        scene.objects.iter().zip(&per_object).map(|(object, m)| summary(scene, object, states, *m)).collect();
    (ratio(total), objects)
}

fn ratio(m: Magnitudes) -> Option<f64> {
    finite(m.force / m.gradient)
}

fn magnitudes(motion: &mut Motion<'_>, object: usize, steps: usize) -> Magnitudes {
    let mut sum = Magnitudes::default();
    for step in (0..=steps).step_by(STATE_STRIDE) {
        let ObjectFields { conservative, force, .. } = motion.fields(object, step);
        sum.force += force.iter().map(|&f| length(f)).sum::<f64>();
        sum.gradient += conservative.iter().map(|&g| length(g)).sum::<f64>();
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
    let networks = object.dynamics.particles().is_some_and(|particles| particles.system.has_networks());
    let span = (states.len().max(2) - 1) as f64 * f64::from(scene.motion.dt);
    ObjectSummary {
        gaussians: object.members.len(),
        center: start.map(|c| c as f32),
        mean_velocity: std::array::from_fn(|c| ((end[c] - start[c]) / span) as f32),
        force_ratio: ratio(m),
        outline: LawOutline::of_particles(networks),
        law: None,
    }
}
