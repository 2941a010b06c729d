//! How laws are chosen by images, and what a scene needs to move by another law.

use glam::{DMat3, DQuat, DVec3};
use lgs_core::GaussianCloud;
use lgs_core::geometry::{components, nearest_rotation};
use lgs_core::linear::quat_mul;
use lgs_distill::{DistillConfig, DistilledLaw};
use lgs_model::{Dynamics, GeneralisedDynamics, LagrangianScene, ObjectModel, mapped_shape};

/// How laws are chosen.
#[derive(Clone, Copy)]
pub(super) struct LawChoice<'a> {
    pub(super) config: &'a DistillConfig,
    pub(super) seed: u64,
    pub(super) sought: Sought,
}

/// Which laws are sought.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Sought {
    /// Those of objects that have one: another one may be likelier by the images.
    Known,
    /// Also those of objects without one.
    OfEach,
    /// Also those of parts of the window, where none explains all of it, and of two objects that act on each
    /// other.
    All,
}

impl LawChoice<'_> {
    /// The same for an object of a scene.
    pub(super) fn of_object(self, index: usize) -> Self {
        Self { seed: self.seed.wrapping_add(index as u64), ..self }
    }
}

/// The law in generalised coordinates by which an object moves.
pub(super) fn own_law(object: &ObjectModel) -> Option<&GeneralisedDynamics> {
    object.dynamics.generalised().filter(|_| object.recording.is_none())
}

/// Gives an object of a scene another law.
pub(super) fn take(found: DistilledLaw, scene: &mut LagrangianScene, object: usize) {
    let DistilledLaw { law, start, bodies, bases, known, q0, v0, .. } = found;
    let members = scene.objects[object].members.clone();
    scene.dynamic_gaussians.means[members.clone()].copy_from_slice(&q0);
    scene.velocities[members].copy_from_slice(&v0);
    let model = &mut scene.objects[object];
    model.dynamics = Dynamics::Generalised(GeneralisedDynamics { law, bodies, start, known });
    model.recording = None;
    turn_shapes(scene, object, &bases);
}

/// Turns the Gaussians of each body of an object, or stretches them, as the body is at the start.
pub(super) fn turn_shapes(scene: &mut LagrangianScene, object: usize, bases: &[(DMat3, DVec3)]) {
    for (rows, (linear, _)) in scene.objects[object].bodies().into_iter().zip(bases) {
        let turn = components(DQuat::from_mat3(&nearest_rotation(linear))).map(|c| c as f32);
        let deforms = scene.objects[object].deforms();
        scene.dynamic_gaussians.turn_harmonics(rows.clone(), turn);
        let GaussianCloud { rotations, log_scales, .. } = &mut scene.dynamic_gaussians;
        for (rotation, log_scales) in rotations[rows.clone()].iter_mut().zip(&mut log_scales[rows]) {
            if deforms {
                (*rotation, *log_scales) = mapped_shape(linear, *rotation, *log_scales);
            } else {
                *rotation = quat_mul(turn, *rotation);
            }
        }
    }
}
