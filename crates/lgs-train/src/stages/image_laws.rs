//! Laws chosen by images (method §6): the poses of a body at the times of the frames, as the images show
//! them, are free of the errors that a source model makes at the ends of a window, and of its smoothness; a
//! law is chosen for them as stage 1 chose one for the source's tracks.

use glam::DQuat;
use lgs_core::GaussianCloud;
use lgs_core::geometry::{components, nearest_rotation};
use lgs_core::linear::quat_mul;
use lgs_data::dataset::Frame;
use lgs_distill::{DistillConfig, DistilledLaw, law_of_poses};
use lgs_mechanics::bands::Verdict;
use lgs_model::{Dynamics, GeneralisedDynamics, LagrangianScene, ObjectModel, mapped_shape};
use rayon::prelude::*;

use super::body::rows_of_parts;
use super::image_poses::{ImagePoses, Part};
use super::newton::squared_error_of;
use crate::thresholds::{FEWEST_OF_BODY, MOST_BELOW_SOURCE};

/// The scene with the laws that the images of some frames show, where there are any, and these do not draw
/// the images worse than the scene's own motion by more than a law may be below its source.
///
/// Objects without a law in generalised coordinates are offered one if they move like a rigid body, and take
/// it if it claims to explain or to describe them. Tells by how many decibels the images are drawn better.
pub(super) fn with_laws_of_images(
    scene: LagrangianScene,
    frames: &[&Frame],
    (config, seed): (&DistillConfig, u64),
) -> (LagrangianScene, f64) {
    let mut times: Vec<f32> = frames.iter().map(|frame| frame.time).filter(|&time| time >= 0.0).collect();
    times.sort_by(f32::total_cmp);
    times.dedup();
    if times.first() != Some(&0.0) || !config.chooses_laws() {
        return (scene, 0.0);
    }
    let poses = ImagePoses::new(&scene, &times);
    let parts = scene.objects.iter().map(|object| parts_of(object, &poses, config.unresolved()));
    let (offered, parts): (Vec<usize>, Vec<Vec<Part>>) =
        parts.enumerate().filter(|(_, parts)| !parts.is_empty()).unzip();
    if offered.is_empty() {
        return (scene, 0.0);
    }
    let (found, before) = poses.displacements(&parts.concat(), frames);
    let (mut found, mut error) = (found.iter(), before);
    let mut poses_of = |part| Some(poses.of_body(part, found.next()?));
    let bodies = parts.iter().map(|parts| parts.iter().filter_map(&mut poses_of).collect::<Vec<_>>());
    let bodies: Vec<_> = offered.iter().copied().zip(bodies).collect();
    let law_of = |(index, bodies)| law_of_poses(bodies, config, seed.wrapping_add(index as u64));
    let laws: Vec<Option<DistilledLaw>> = bodies.into_par_iter().map(law_of).collect();
    let mut changed = scene.clone();
    for (&index, law) in offered.iter().zip(laws) {
        tracing::debug!(index, law = ?law.as_ref().map(|law| &law.law), "the law that images show");
        let has_law = has_law(&scene.objects[index]);
        let admitted = admitted_verdicts(&scene.objects[index]);
        let Some(law) = law.filter(|law| has_law || admitted.contains(&law.known.verdict)) else { continue };
        let mut other = changed.clone();
        take(law, &mut other, index);
        let after = squared_error_of(&other, frames);
        tracing::debug!(error, after, "images by the motion that the scene had, and by their own law");
        if decibels_between(error, after) <= MOST_BELOW_SOURCE {
            (changed, error) = (other, after);
        }
    }
    (changed, decibels_between(error, before))
}

/// Decibels by which a squared error is worse than another.
fn decibels_between(error: f64, worse: f64) -> f64 {
    10.0 * (worse / error.max(f64::MIN_POSITIVE)).log10()
}

/// Verdicts of laws that an object without one may take: where laws of parts of the window explain these, one
/// of all of it has to explain it.
fn admitted_verdicts(object: &ObjectModel) -> &'static [Verdict] {
    let has_parts = object.recording.as_ref().is_some_and(|r| r.parts().iter().any(Option::is_some));
    if has_parts { &[Verdict::Explained] } else { &[Verdict::Explained, Verdict::Described] }
}

/// Whether an object moves by a law in generalised coordinates.
fn has_law(object: &ObjectModel) -> bool {
    object.recording.is_none() && object.dynamics.generalised().is_some()
}

/// The bodies as which an object moves: those of its law, or one that is rigid up to what images do not
/// resolve; none if it moves otherwise.
fn parts_of(object: &ObjectModel, poses: &ImagePoses<'_>, unresolved: f64) -> Vec<Part> {
    let rows = &object.members;
    let parts =
        object.recording.as_ref().is_some_and(|recording| recording.parts().iter().any(Option::is_some));
    if parts {
        return Vec::new();
    }
    if !has_law(object) && (rows.len() < FEWEST_OF_BODY || poses.deformation(rows) > unresolved) {
        return Vec::new();
    }
    let deforms = object.deforms();
    rows_of_parts(object).into_iter().map(|rows| Part { rows, deforms }).collect()
}

/// Gives an object of a scene another law.
fn take(found: DistilledLaw, scene: &mut LagrangianScene, object: usize) {
    let DistilledLaw { law, start, bodies, bases, known, q0, v0, .. } = found;
    let members = scene.objects[object].members.clone();
    scene.dynamic_gaussians.means[members.clone()].copy_from_slice(&q0);
    scene.velocities[members.clone()].copy_from_slice(&v0);
    for (rows, (linear, _)) in rows_of_parts(&scene.objects[object]).into_iter().zip(bases) {
        let turn = components(DQuat::from_mat3(&nearest_rotation(&linear))).map(|c| c as f32);
        let deforms = scene.objects[object].deforms();
        let GaussianCloud { rotations, log_scales, .. } = &mut scene.dynamic_gaussians;
        for (rotation, log_scales) in rotations[rows.clone()].iter_mut().zip(&mut log_scales[rows]) {
            if deforms {
                (*rotation, *log_scales) = mapped_shape(&linear, *rotation, *log_scales);
            } else {
                *rotation = quat_mul(turn, *rotation);
            }
        }
    }
    let object = &mut scene.objects[object];
    object.dynamics = Dynamics::Generalised(GeneralisedDynamics { law, bodies, start, known });
    object.recording = None;
}
