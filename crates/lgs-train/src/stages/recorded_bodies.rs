//! Objects that no law moves, as bodies (method §6): the tracks of a source slip over round and plain
//! surfaces, so that a body may look like none, and images tell whether it is. It is rigid, or deforms as a
//! whole where that explains the tracks better.

use glam::{DMat3, DQuat, DVec3};
use lgs_core::geometry::{components, narrow, nearest_rotation};
use lgs_data::dataset::Frame;
use lgs_distill::BodyPoses;
use lgs_model::{LagrangianScene, ObjectModel, Recording};

use super::image_poses::{ImagePoses, Part};
use super::law_choice::own_law;
use super::newton::squared_error_of;
use super::thresholds::{MOST_LEFT_IF_DEFORMING, MOST_UNEXPLAINED_BY_BODY};
use crate::thresholds::FEWEST_OF_BODY;

/// Whether an object moves by a law in generalised coordinates.
pub(super) fn has_law(object: &ObjectModel) -> bool {
    own_law(object).is_some()
}

/// Whether an object moves by laws of parts of the window.
pub(super) fn has_parts(object: &ObjectModel) -> bool {
    object.recording.as_ref().is_some_and(Recording::has_parts)
}

/// The bodies as which each object moves, by its index: those of its law, by their rows, or itself as one;
/// objects are left out that are too small to tell how they turn, or are held by a hand.
pub(super) fn bodies_of(scene: &LagrangianScene, times: &[f32]) -> Vec<(usize, Vec<Part>)> {
    let poses = ImagePoses::new(scene, times);
    let of_object = |(index, object): (usize, &ObjectModel)| {
        let is_handled = object.recording.as_ref().is_some_and(Recording::is_handled);
        let is_body = has_law(object) || (!is_handled && object.members.len() >= FEWEST_OF_BODY);
        let part = |rows| Part { rows, deforms: object.deforms() };
        let mut parts: Vec<Part> = object.bodies().into_iter().map(part).collect();
        parts.sort_by_key(|part| part.rows.start);
        if !has_law(object) {
            parts.iter_mut().for_each(|part| part.deforms = deforms_as_a_whole(&poses, part));
        }
        is_body.then_some((index, parts))
    };
    scene.objects.iter().enumerate().filter_map(of_object).collect()
}

/// Whether a body that deforms explains a motion better than a rigid one by far: noise of tracks is left by
/// both.
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

/// A scene, which draws the frames with a squared error, with the poses that images show in place of the
/// motion of each object that no law moves, of all the window or of parts, where they explain nearly all that
/// its motion does; other objects without a law are no bodies, and are left out of `bodies`. Until the
/// Gaussians are tuned to a body, it draws the images worse than tracks do that have been fitted with them.
pub(super) fn with_poses_of_images(
    (scene, error): (&LagrangianScene, f64),
    bodies: &mut Vec<(usize, Vec<BodyPoses>)>,
    frames: &[&Frame],
) -> LagrangianScene {
    let mut posed = scene.clone();
    bodies.retain(|(index, bodies)| {
        let [body] = bodies.as_slice() else { return true };
        if has_law(&scene.objects[*index]) || has_parts(&scene.objects[*index]) {
            return true;
        }
        let mut alone = scene.clone();
        play(&mut alone, *index, body);
        let after = squared_error_of(&alone, frames);
        let at_rest = squared_error_of(&with_object_at_rest(scene, *index), frames);
        tracing::debug!(index, error, after, at_rest, "images by tracks, by poses of a body, and at rest");
        let is_body = after - error <= MOST_UNEXPLAINED_BY_BODY * (at_rest - error);
        // One view of a time does not show where along its line of sight a body is.
        if is_body && frames.len() >= 2 * body.times.len() {
            play(&mut posed, *index, body);
        }
        is_body
    });
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
    object.recording = Some(recording.continued_by(continuation).of_deforming(body.deforms));
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

#[cfg(test)]
mod tests {
    use super::*;
    use lgs_core::GaussianCloud;
    use lgs_core::geometry::rotation_by;
    use lgs_mechanics::coordinates::{Bodies, Coordinates, State};
    use lgs_mechanics::{Law, bands};
    use lgs_model::{Dynamics, GeneralisedDynamics, MotionConfig};

    const TIMES: [f32; 3] = [0.0, 0.5, 1.0];

    /// A scene of one object without a law, whose particles at the corners of a cube are recorded by `place`.
    fn recorded_by(place: impl Fn(DVec3, usize, f64) -> DVec3) -> LagrangianScene {
        let corner = |i: u32| DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2)) - 0.5;
        let row = |&t: &f32| (0..8).map(|i| narrow(place(corner(i), i as usize, f64::from(t)))).collect();
        let positions: Vec<Vec<[f32; 3]>> = TIMES.iter().map(row).collect();
        let cloud = GaussianCloud::isotropic(positions[0].clone(), 0.1, [0.5; 3], 0.9);
        let turns = vec![vec![[1.0, 0.0, 0.0, 0.0]; 8]; TIMES.len()];
        let law = Law::new(Coordinates::Point, Vec::new(), Vec::new(), 0.05).expect("a law");
        let start = State { x: vec![0.0; 3], v: vec![0.0; 3] };
        let known = bands::Known::default();
        let dynamics = GeneralisedDynamics { law, bodies: Bodies::default(), start, known };
        LagrangianScene {
            velocities: vec![[0.0; 3]; 8],
            objects: vec![ObjectModel {
                members: 0..8,
                dynamics: Dynamics::Generalised(dynamics),
                recording: Recording::new(TIMES.to_vec(), positions, turns),
            }],
            dynamic_gaussians: cloud,
            ..LagrangianScene::still(
                GaussianCloud::default(),
                MotionConfig { dt: 0.05, time_window: 1.0 },
                [1.0; 3],
            )
        }
    }

    /// Distance of two particles at the end.
    fn apart(scene: &LagrangianScene) -> f64 {
        let end =
            scene.objects[0].recording.as_ref().expect("a recording").positions().last().expect("an end");
        DVec3::from(end[0].map(f64::from)).distance(DVec3::from(end[7].map(f64::from)))
    }

    #[test]
    fn tracks_that_slip_are_those_of_a_rigid_body_and_ones_that_stretch_of_one_that_deforms() {
        let slip = |i: usize, t: f64| {
            0.2 * t * DVec3::new((7 * i) as f64, (3 * i) as f64, (5 * i) as f64).map(f64::sin)
        };
        let slips = recorded_by(|p, i, t| rotation_by(DVec3::Z * t) * p + slip(i, t));
        let bodies = bodies_of(&slips, &TIMES);
        assert!(!bodies[0].1[0].deforms);
        let rigid = with_recorded_bodies(&slips, &bodies, &TIMES);
        assert!((apart(&slips) - 3f64.sqrt()).abs() > 0.02);
        assert!((apart(&rigid) - 3f64.sqrt()).abs() < 1e-5);
        let stretches = recorded_by(|p, _, t| p * DVec3::new(1.0 + t, 1.0, 1.0 - 0.5 * t));
        let bodies = bodies_of(&stretches, &TIMES);
        assert!(bodies[0].1[0].deforms);
        let whole = with_recorded_bodies(&stretches, &bodies, &TIMES);
        assert!(whole.objects[0].deforms() && (apart(&whole) - apart(&stretches)).abs() < 1e-5);
    }
}
