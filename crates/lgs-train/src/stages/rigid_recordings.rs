//! Objects that no law moves, as rigid bodies (method §6): the tracks of a source slip over round and plain
//! surfaces, so that a rigid body may look like none, and images tell whether it is.

use glam::{DMat3, DQuat, DVec3};
use lgs_core::geometry::{components, narrow, nearest_rotation};
use lgs_data::dataset::Frame;
use lgs_distill::BodyPoses;
use lgs_model::{LagrangianScene, ObjectModel, Recording};

use super::body::rows_of_parts;
use super::held_to_source::put;
use super::image_poses::{ImagePoses, Part};
use super::law_choice::own_law;
use super::newton::squared_error_of;
use super::thresholds::MOST_ERROR_OF_RIGID;
use crate::thresholds::FEWEST_OF_BODY;

/// Whether an object moves by a law in generalised coordinates.
pub(super) fn has_law(object: &ObjectModel) -> bool {
    own_law(object).is_some()
}

/// The bodies as which an object moves: those of its law, or itself as one; none if it is too small to tell how
/// it turns, or moves by laws of parts of the window already.
pub(super) fn parts_of(object: &ObjectModel) -> Vec<Part> {
    let is_settled = object.recording.as_ref().is_some_and(Recording::has_parts);
    if is_settled || (!has_law(object) && object.members.len() < FEWEST_OF_BODY) {
        return Vec::new();
    }
    let deforms = object.deforms();
    rows_of_parts(object).into_iter().map(|rows| Part { rows, deforms }).collect()
}

/// The scene with the nearest rigid motion in place of that of each object that no law moves.
pub(super) fn with_rigid_recordings(scene: &LagrangianScene, times: &[f32]) -> LagrangianScene {
    let poses = ImagePoses::new(scene, times);
    let mut rigid = scene.clone();
    for (index, object) in scene.objects.iter().enumerate().filter(|(_, object)| !has_law(object)) {
        for part in parts_of(object) {
            play(&mut rigid, index, &poses.of_body_in_scene(&part));
        }
    }
    rigid
}

/// The scene with the poses that images show in place of the motion of each object that no law moves, where a
/// rigid body draws the images nearly as well. Until Gaussians are tuned to it, it draws them worse than tracks
/// do that have been fitted with them.
pub(super) fn with_poses_of_images(
    (scene, error): (&LagrangianScene, f64),
    bodies: &[(usize, Vec<BodyPoses>)],
    frames: &[&Frame],
) -> LagrangianScene {
    let mut posed = scene.clone();
    for (index, bodies) in bodies {
        let [body] = bodies.as_slice() else { continue };
        if has_law(&scene.objects[*index]) {
            continue;
        }
        let mut other = posed.clone();
        play(&mut other, *index, body);
        let after = squared_error_of(&other, frames);
        tracing::debug!(index, error, after, "images by tracks, and by poses of a rigid body");
        if after <= MOST_ERROR_OF_RIGID * error {
            posed = other;
        }
    }
    posed
}

/// The scene with the recordings that another one has of the same rows, for objects that still play one.
pub(super) fn with_own_recordings(mut scene: LagrangianScene, own: &LagrangianScene) -> LagrangianScene {
    for object in &mut scene.objects {
        let is_same = |other: &&ObjectModel| other.members == object.members && other.recording.is_some();
        let is_replaced = object.recording.as_ref().is_some_and(|recording| !recording.has_parts());
        if let Some(other) = own.objects.iter().find(is_same).filter(|_| is_replaced) {
            *object = other.clone();
            let rows = other.members.clone();
            let gaussians = own.dynamic_gaussians.select(&rows.clone().collect::<Vec<_>>());
            put(&mut scene.dynamic_gaussians, rows.start, &gaussians);
        }
    }
    scene
}

/// Lets an object move by the poses of its body, if there are two or more; its Gaussians stay as they are
/// turned.
fn play(scene: &mut LagrangianScene, index: usize, body: &BodyPoses) {
    if let Some(recording) = recorded(body, &DMat3::IDENTITY) {
        let members = scene.objects[index].members.clone();
        scene.dynamic_gaussians.means[members].copy_from_slice(recording.start());
        scene.objects[index].recording = Some(recording);
    }
}

/// The motion of a body by its poses, of Gaussians that are turned as `base`; nothing if poses are fewer than
/// two.
pub(super) fn recorded(body: &BodyPoses, base: &DMat3) -> Option<Recording> {
    let times = body.times.iter().map(|time| *time as f32).collect();
    let place = |(linear, shift): &(DMat3, DVec3)| -> Vec<[f32; 3]> {
        body.shape.iter().map(|&point| narrow(*linear * point + *shift)).collect()
    };
    let turn = |(linear, _): &(DMat3, DVec3)| {
        let since = nearest_rotation(&(*linear * base.transpose()));
        vec![components(DQuat::from_mat3(&since)).map(|c| c as f32); body.shape.len()]
    };
    Recording::new(times, body.poses.iter().map(place).collect(), body.poses.iter().map(turn).collect())
}
