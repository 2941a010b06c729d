//! Energy: the mean of U + T over moving Gaussians (unit mass each), along a rollout to 3 τ_max.
//!
//! U has an arbitrary constant, so changes are relative to the largest mean kinetic energy on the way. With γ
//! = 0 the system is conservative and the drift is the integrator's and the alignment's; with γ = 1 it
//! contains what the force takes or gives.

use lgs_dynamics::{Edit, Reversal};
use lgs_model::{LagrangianScene, Motion};

use super::long_steps;
use crate::finite::finite;

/// Largest change of the mean energy from its start, over the largest mean kinetic energy; nothing if nothing
/// moves.
#[must_use]
pub fn energy_drift(scene: &LagrangianScene, force_scale: f32) -> Option<f64> {
    if scene.dynamic_gaussians.is_empty() {
        return None;
    }
    let edit = Edit { force_scale, ..Edit::default() };
    let mut motion = Motion::new(scene, edit, Reversal::Exact);
    let energies: Vec<(f64, f64)> =
        (0..=long_steps(&scene.motion)).map(|step| mean_energies(scene, &mut motion, step)).collect();
    let &(potential, kinetic) = energies.first()?;
    let start = potential + kinetic;
    // A NaN on the way must not hide behind a maximum, which ignores it.
    let worst = energies
        .iter()
        .map(|(u, t)| (u + t - start).abs())
        .try_fold(0.0_f64, |m, v| v.is_finite().then(|| m.max(v)))?;
    let largest_kinetic = energies.iter().map(|&(_, t)| t).fold(0.0, f64::max);
    finite(worst / largest_kinetic)
}

/// Mean potential and kinetic energy.
fn mean_energies(scene: &LagrangianScene, motion: &mut Motion<'_>, step: usize) -> (f64, f64) {
    let n = scene.dynamic_gaussians.len() as f64;
    let (mut potential, mut kinetic) = (0.0, 0.0);
    for index in 0..scene.objects.len() {
        let fields = motion.fields(index, step);
        potential += fields.potential;
        kinetic += fields.kinetic;
    }
    (potential / n, kinetic / n)
}
