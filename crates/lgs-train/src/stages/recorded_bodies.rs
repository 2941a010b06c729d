//! Objects that no law moves, as bodies (method §6): the tracks of a source slip over round and plain surfaces,
//! so that a body may look like none, and images tell whether it is. It is rigid, or deforms as a whole where
//! that explains the tracks better.

use glam::{DMat3, DQuat, DVec3};
use lgs_core::geometry::{components, narrow, nearest_rotation};
use lgs_data::dataset::Frame;
use lgs_distill::BodyPoses;
use lgs_model::{LagrangianScene, ObjectModel, Recording};

use super::body::rows_of_parts;
use super::image_poses::{ImagePoses, Part};
use super::law_choice::own_law;
use super::newton::squared_error_of;
use super::thresholds::{MOST_LEFT_IF_DEFORMING, MOST_UNEXPLAINED_BY_BODY};
use crate::thresholds::FEWEST_OF_BODY;

/// Whether an object moves by a law in generalised coordinates.
pub(super) fn has_law(object: &ObjectModel) -> bool {
    own_law(object).is_some()
}

/// The bodies as which each object moves, by its index: those of its law, or itself as one; objects are left out
/// that are too small to tell how they turn, or move by laws of parts of the window already.
pub(super) fn bodies_of(scene: &LagrangianScene, times: &[f32]) -> Vec<(usize, Vec<Part>)> {
    let poses = ImagePoses::new(scene, times);
    let of_object = |(index, object): (usize, &ObjectModel)| {
        let is_settled = object.recording.as_ref().is_some_and(Recording::has_parts);
        let is_body = has_law(object) || (!is_settled && object.members.len() >= FEWEST_OF_BODY);
        let part = |rows| Part { rows, deforms: object.deforms() };
        let mut parts: Vec<Part> = rows_of_parts(object).into_iter().map(part).collect();
        if !has_law(object) {
            parts.iter_mut().for_each(|part| part.deforms = deforms_as_a_whole(&poses, part));
        }
        is_body.then_some((index, parts))
    };
    scene.objects.iter().enumerate().filter_map(of_object).collect()
}

/// Whether a body that deforms explains a motion better than a rigid one by far: noise of tracks is left by both.
fn deforms_as_a_whole(poses: &ImagePoses<'_>, part: &Part) -> bool {
    let left = |deforms| poses.left_of_motion(&Part { deforms, ..part.clone() });
    left(true) <= MOST_LEFT_IF_DEFORMING * left(false)
}

/// The scene with the nearest motion of a body in place of that of each object that no law moves.
pub(super) fn with_recorded_bodies(
    scene: &LagrangianScene,
    bodies: &[(usize, Vec<Part>)],
    times: &[f32],
) -> LagrangianScene {
    let poses = ImagePoses::new(scene, times);
    let mut recorded = scene.clone();
    for (index, parts) in bodies.iter().filter(|(index, _)| !has_law(&scene.objects[*index])) {
        parts.iter().for_each(|part| play(&mut recorded, *index, &poses.of_body_in_scene(part)));
    }
    recorded
}

/// The scene with the poses that images show in place of the motion of each object that no law moves, where they
/// explain nearly all that its motion does. Until the Gaussians are tuned to a body, it draws the images worse
/// than tracks do that have been fitted with them.
pub(super) fn with_poses_of_images(
    scene: &LagrangianScene,
    bodies: &[(usize, Vec<BodyPoses>)],
    frames: &[&Frame],
) -> LagrangianScene {
    let error = squared_error_of(scene, frames);
    let mut posed = scene.clone();
    for (index, bodies) in bodies {
        let [body] = bodies.as_slice() else { continue };
        // One view of a time does not show where along its line of sight a body is.
        if has_law(&scene.objects[*index]) || frames.len() < 2 * body.times.len() {
            continue;
        }
        let mut alone = scene.clone();
        play(&mut alone, *index, body);
        let after = squared_error_of(&alone, frames);
        let at_rest = squared_error_of(&with_object_at_rest(scene, *index), frames);
        tracing::debug!(index, error, after, at_rest, "images by tracks, by poses of a body, and at rest");
        if after - error <= MOST_UNEXPLAINED_BY_BODY * (at_rest - error) {
            play(&mut posed, *index, body);
        }
    }
    posed
}

/// The scene with an object that stays where it is at the start.
fn with_object_at_rest(scene: &LagrangianScene, index: usize) -> LagrangianScene {
    let mut other = scene.clone();
    let object = &mut other.objects[index];
    let start = scene.dynamic_gaussians.means[object.members.clone()].to_vec();
    let turns = vec![[1.0, 0.0, 0.0, 0.0]; start.len()];
    let times = vec![0.0, scene.motion.time_window];
    object.recording = Recording::new(times, vec![start.clone(), start], vec![turns.clone(), turns]);
    other
}

/// Lets an object move by the poses of its body, if there are two or more; its Gaussians stay as they are
/// turned.
fn play(scene: &mut LagrangianScene, index: usize, body: &BodyPoses) {
    let Some(recording) = recorded(body, &DMat3::IDENTITY) else { return };
    let object = &mut scene.objects[index];
    let continuation = object.recording.as_ref().map(Recording::continuation).unwrap_or_default();
    scene.dynamic_gaussians.means[object.members.clone()].copy_from_slice(recording.start());
    object.recording = Some(recording.continued_by(continuation));
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
