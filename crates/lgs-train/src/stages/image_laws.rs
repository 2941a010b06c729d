//! Laws chosen by images (method §6): the poses of a body at the times of the frames, as the images show
//! them, are free of the errors that a source model makes at the ends of a window, and of its smoothness; a
//! law is chosen for them as stage 1 chose one for the source's tracks.

use std::ops::Range;

use glam::DQuat;
use lgs_core::geometry::components;
use lgs_core::linear::quat_mul;
use lgs_data::dataset::Frame;
use lgs_distill::{DistillConfig, DistilledLaw, law_of_poses};
use lgs_mechanics::bands::Verdict;
use lgs_mechanics::coordinates::Coordinates;
use lgs_model::{Dynamics, GeneralisedDynamics, LagrangianScene, ObjectModel};

use super::body::rows_of_parts;
use super::image_poses::ImagePoses;
use super::newton::squared_error_of;
use crate::thresholds::{FEWEST_OF_BODY, MOST_BELOW_SOURCE};

/// The scene with the laws that the images of some frames show, where there are any, and these do not draw
/// the images worse than the scene's own motion by more than a law may be below its source.
///
/// Objects without a law in generalised coordinates are offered one if they move like a rigid body, and take
/// it if it claims to explain or to describe them.
pub(super) fn with_laws_of_images(
    scene: LagrangianScene,
    frames: &[&Frame],
    (config, seed): (&DistillConfig, u64),
) -> LagrangianScene {
    let mut times: Vec<f32> = frames.iter().map(|frame| frame.time).filter(|&time| time >= 0.0).collect();
    times.sort_by(f32::total_cmp);
    times.dedup();
    if times.first() != Some(&0.0) || !config.chooses_laws() {
        return scene;
    }
    let poses = ImagePoses::new(&scene, &times);
    let rigid: Vec<usize> = (0..scene.objects.len())
        .filter(|&object| is_rigid(&scene.objects[object], &poses, config.unresolved()))
        .collect();
    if rigid.is_empty() {
        return scene;
    }
    let parts: Vec<Vec<Range<usize>>> =
        rigid.iter().map(|&object| rows_of_parts(&scene.objects[object])).collect();
    let (found, mut error) = poses.displacements(&parts.concat(), frames);
    let mut found = found.iter();
    let mut changed = scene.clone();
    for (&index, parts) in rigid.iter().zip(&parts) {
        let bodies = parts.iter().zip(&mut found).map(|(rows, found)| poses.of_body(rows, found)).collect();
        let law = law_of_poses(bodies, config, seed.wrapping_add(index as u64));
        tracing::debug!(index, law = ?law.as_ref().map(|law| &law.law), "the law that images show");
        let has_law = has_law(&scene.objects[index]);
        let Some(law) = law.filter(|law| has_law || law.known.verdict != Verdict::Outside) else { continue };
        let mut other = changed.clone();
        take(law, &mut other, index);
        let after = squared_error_of(&other, frames);
        tracing::debug!(error, after, "images by the motion that the scene had, and by their own law");
        if decibels_between(error, after) <= MOST_BELOW_SOURCE {
            (changed, error) = (other, after);
        }
    }
    changed
}

/// Decibels by which a squared error is worse than another.
fn decibels_between(error: f64, worse: f64) -> f64 {
    10.0 * (worse / error.max(f64::MIN_POSITIVE)).log10()
}

/// Whether an object moves by a law in generalised coordinates.
fn has_law(object: &ObjectModel) -> bool {
    object.recording.is_none() && object.dynamics.generalised().is_some()
}

/// Whether an object moves as one or several rigid bodies: by its law, or as its motion is seen to, up to
/// what images do not resolve.
fn is_rigid(object: &ObjectModel, poses: &ImagePoses<'_>, unresolved: f64) -> bool {
    match object.dynamics.generalised().filter(|_| object.recording.is_none()) {
        Some(dynamics) => !matches!(dynamics.law.coordinates, Coordinates::Modal(_)),
        None => {
            let rows = &object.members;
            rows.len() >= FEWEST_OF_BODY && poses.deformation(rows) <= unresolved
        }
    }
}

/// Gives an object of a scene another law.
fn take(found: DistilledLaw, scene: &mut LagrangianScene, object: usize) {
    let DistilledLaw { law, start, bodies, bases, known, q0, v0, .. } = found;
    let members = scene.objects[object].members.clone();
    scene.dynamic_gaussians.means[members.clone()].copy_from_slice(&q0);
    scene.velocities[members.clone()].copy_from_slice(&v0);
    for (rows, (linear, _)) in rows_of_parts(&scene.objects[object]).into_iter().zip(bases) {
        let turn = components(DQuat::from_mat3(&linear).normalize()).map(|c| c as f32);
        for rotation in &mut scene.dynamic_gaussians.rotations[rows] {
            *rotation = quat_mul(turn, *rotation);
        }
    }
    let object = &mut scene.objects[object];
    object.dynamics = Dynamics::Generalised(GeneralisedDynamics { law, bodies, start, known });
    object.recording = None;
}
