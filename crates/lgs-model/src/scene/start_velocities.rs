//! The velocities that the motion of a scene starts with.

use lgs_dynamics::Edit;

use super::dynamics::Dynamics;
use super::{LagrangianScene, ObjectModel};

impl LagrangianScene {
    /// The velocities that an edited motion starts with, `[n_dynamic]`, world units per unit of time.
    ///
    /// The stored velocities of particles lag half a kick behind those at t = 0, with which Eq. 5 tracks
    /// positions to second order (method §4.3): `v(0) = v₀ + ½ dt a(q₀, v₀)`. An edit scales v(0) and changes
    /// the accelerations, so its own half kick is taken off: `α v(0) − ½ dt a_edit`. Without an edit these
    /// are the stored velocities, bit for bit.
    #[must_use]
    pub fn start_velocities(&self, edit: Edit) -> Vec<[f32; 3]> {
        self.start_velocities_of(&vec![edit; self.objects.len()])
    }

    /// The same with an edit for each object.
    pub(super) fn start_velocities_of(&self, edits: &[Edit]) -> Vec<[f32; 3]> {
        let of_object = |(ObjectModel { members, dynamics, .. }, &edit): (&ObjectModel, &Edit)| {
            let q = &self.dynamic_gaussians.means[members.clone()];
            let stored = &self.velocities[members.clone()];
            match dynamics {
                Dynamics::Particles(_) if edit == Edit::default() => stored.to_vec(),
                Dynamics::Particles(particles) => {
                    particles.start_velocities((q, stored), self.motion.dt, edit)
                }
                Dynamics::Generalised(generalised) => generalised.start_velocities(q, edit),
            }
        };
        self.objects.iter().zip(edits).flat_map(of_object).collect()
    }
}
