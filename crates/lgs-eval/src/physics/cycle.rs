//! Cycle error (method §7): forward from 0 to τ_max, then back to 0 with one of the reversals.
//!
//! `Σ‖q₀ − q̂₀‖ / Σ path length` over moving Gaussians, the path being that of the way forward. `NegatedStep`
//! is expected to be off by `2h/(T + h)` for a fall from rest over a time T in steps of h, `Exact` without
//! alignment by rounding alone.

use lgs_dynamics::{Edit, Reversal, RolloutSpec, State, rollout, rollout_reversed};
use lgs_model::{Dynamics, GeneralisedDynamics, LagrangianScene, MotionConfig, ParticleDynamics};

use super::{distance, window_steps};
use crate::finite::finite;
use crate::metrics::CycleError;

/// Whether local rigid alignment takes part in a cycle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Alignment {
    /// Alignment as the scene has it.
    OfScene,
    /// No alignment, forward and back.
    Off,
}

/// All four cycles.
#[must_use]
pub fn cycle_errors(scene: &LagrangianScene) -> CycleError {
    CycleError {
        negated_step: cycle_error(scene, Reversal::NegatedStep, Alignment::OfScene),
        exact: cycle_error(scene, Reversal::Exact, Alignment::OfScene),
        negated_step_without_alignment: cycle_error(scene, Reversal::NegatedStep, Alignment::Off),
        exact_without_alignment: cycle_error(scene, Reversal::Exact, Alignment::Off),
    }
}

/// One cycle; nothing if nothing moves.
#[must_use]
pub fn cycle_error(scene: &LagrangianScene, reversal: Reversal, alignment: Alignment) -> Option<f64> {
    let (mut error, mut path) = (0.0, 0.0);
    for object in &scene.objects {
        let rows = object.members.clone();
        let start = State::at_start(
            scene.dynamic_gaussians.means[rows.clone()].to_vec(),
            scene.velocities[rows].to_vec(),
        );
        let (e, p) = match &object.dynamics {
            Dynamics::Particles(particles) => {
                cycle_of_particles(scene, particles, &start, (reversal, alignment))
            }
            Dynamics::Generalised(law) => cycle_of_law(&scene.motion, law, &start.q),
        };
        error += e;
        path += p;
    }
    finite(error / path)
}

/// Sums of position errors and path lengths of an object that follows a law, whose inverse is always exact.
fn cycle_of_law(motion: &MotionConfig, law: &GeneralisedDynamics, points: &[[f32; 3]]) -> (f64, f64) {
    let dt = f64::from(motion.dt);
    let times: Vec<f64> = (0..=window_steps(motion)).map(|step| step as f64 * dt).collect();
    let there = law.states(Edit::default(), &times);
    let placed: Vec<State> = there.iter().map(|state| law.placed(points, state)).collect();
    let path = placed.windows(2).map(|pair| sum_of_distances(&pair[0].q, &pair[1].q)).sum();
    let (Some(turn), Some(end)) = (there.last(), times.last()) else { return (0.0, 0.0) };
    let mut turned = GeneralisedDynamics { start: turn.clone(), ..law.clone().with_impacts(*end) };
    // Time begins at the turn; changes of velocity are taken back at the times at which they happened.
    let lgs_mechanics::Law { impacts, impulses, .. } = &mut turned.law;
    impacts.iter_mut().chain(impulses).for_each(|event| event.time -= end);
    let back = turned.states(Edit::default(), &[-end]).remove(0);
    (sum_of_distances(points, &law.placed(points, &back).q), path)
}

/// Sums of position errors and path lengths of an object of particles.
fn cycle_of_particles(
    scene: &LagrangianScene,
    object: &ParticleDynamics,
    start: &State,
    (reversal, alignment): (Reversal, Alignment),
) -> (f64, f64) {
    let spec = RolloutSpec {
        dt: scene.motion.dt,
        steps: window_steps(&scene.motion),
        last_dt: None,
        edit: Edit::default(),
        supports: object.supports.as_deref().filter(|_| alignment == Alignment::OfScene),
        velocity_policy: object.velocity_policy,
    };
    let there = rollout(&object.system, start, &spec);
    let Some(turn) = there.last() else { return (0.0, 0.0) };
    let back = rollout_reversed(&object.system, turn, &spec, reversal);
    let error = back.last().map_or(0.0, |end| sum_of_distances(&start.q, &end.q));
    (error, there.windows(2).map(|pair| sum_of_distances(&pair[0].q, &pair[1].q)).sum())
}

fn sum_of_distances(a: &[[f32; 3]], b: &[[f32; 3]]) -> f64 {
    a.iter().zip(b).map(|(&p, &q)| distance(p, q)).sum()
}

#[cfg(test)]
mod tests {
    use lgs_mechanics::Law;
    use lgs_mechanics::bands::Known;
    use lgs_mechanics::contact::Impact;
    use lgs_mechanics::coordinates::{self, Bodies, Coordinates};

    use super::*;

    #[test]
    fn impulses_of_the_window_are_taken_back_on_the_way_back() {
        let mut law = Law::new(Coordinates::Point, Vec::new(), Vec::new(), 0.01).expect("a law");
        law.impulses = vec![Impact { time: 0.3, change: vec![0.0, 2.0, 0.0] }];
        let start = coordinates::State { x: vec![0.0; 3], v: vec![1.0, 0.0, 0.0] };
        let struck = GeneralisedDynamics { law, bodies: Bodies::default(), start, known: Known::default() };
        let motion = MotionConfig { dt: 0.01, time_window: 0.75 };
        let (error, path) = cycle_of_law(&motion, &struck, &[[0.1, 0.0, 0.0]]);
        assert!(error < 1e-6 && path > 1.0, "{error} of {path}");
    }
}
