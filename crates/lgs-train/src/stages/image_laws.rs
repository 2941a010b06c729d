//! Laws chosen by images (method §6): the poses of a body at the times of the frames, as the images show
//! them, are free of the errors that a source model makes at the ends of a window, and of its smoothness; a
//! law is chosen for them as stage 1 chose one for the source's tracks.

use std::ops::Range;

use glam::{DMat3, DQuat, DVec3};
use lgs_core::geometry::{components, exp, quaternion, solve_positive, wide};
use lgs_core::linear::{norm, quat_mul, sub};
use lgs_core::{GaussianCloud, psnr_of_mse};
use lgs_data::dataset::Frame;
use lgs_distill::{BodyPoses, DistillConfig, DistilledLaw, law_of_poses};
use lgs_dynamics::{Edit, Reversal};
use lgs_mechanics::coordinates::Coordinates;
use lgs_model::{Dynamics, GeneralisedDynamics, LagrangianScene, Motion, ObjectModel};
use nalgebra::DMatrix;
use rayon::prelude::*;

use super::body::rows_of_parts;
use super::initial_pose::mean;
use super::newton::squared_error_of;
use super::observation::{Displacement, Normal, Observation, Pose, displaced, observe};
use crate::thresholds::MOST_BELOW_SOURCE;

/// Rounds of observation; the second is about poses that the first has put right to a tenth of a pixel.
const ROUNDS: usize = 2;
/// Standard deviation of the weak prior on a displacement, in radii and radians: what no image shows, such as
/// the rotation of a plain ball, stays as the motion had it.
const PRIOR_DEVIATION: f64 = 0.05;
/// Errors of neighbouring pixels are correlated: so many count as one independent value.
const CORRELATED_VALUES: f64 = 100.0;

/// The rigid displacement of a body at a time from where the scene's motion has it.
#[derive(Clone, Copy)]
struct Found {
    turn: DQuat,
    shift: DVec3,
    /// Mean square error of the displacement by what each half of the views shows, world units; 0 where there
    /// are no halves.
    square_error: f64,
}

/// The scene with the laws that the images of some frames show, where there are any, and these do not draw
/// the images worse than the scene's own by more than a law may be below its source.
pub(super) fn with_laws_of_images(
    scene: LagrangianScene,
    frames: &[&Frame],
    (config, seed): (&DistillConfig, u64),
) -> LagrangianScene {
    let mut times: Vec<f32> = frames.iter().map(|frame| frame.time).filter(|&time| time >= 0.0).collect();
    times.sort_by(f32::total_cmp);
    times.dedup();
    if times.first() != Some(&0.0) || !scene.objects.iter().any(is_rigid) {
        return scene;
    }
    let (found, mut error) = displacements(&scene, frames, &times);
    let mut found = found.into_iter();
    let mut changed = scene.clone();
    for (index, object) in scene.objects.iter().enumerate() {
        let parts: Vec<_> = rows_of_parts(object).into_iter().zip(&mut found).collect();
        if !is_rigid(object) {
            continue;
        }
        let poses = parts.iter().map(|(rows, found)| poses_of(&scene, rows, (&times, found))).collect();
        let law = law_of_poses(poses, config, seed.wrapping_add(index as u64));
        tracing::debug!(index, law = ?law.as_ref().map(|law| &law.law), "the law that images show");
        let Some(law) = law else { continue };
        let mut other = changed.clone();
        take(law, &mut other, index);
        let after = squared_error_of(&other, frames);
        tracing::debug!(error, after, "images by the law of the source's tracks, and by their own");
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

/// Whether an object moves as one or several rigid bodies by a law.
fn is_rigid(object: &ObjectModel) -> bool {
    let law = object.dynamics.generalised().filter(|_| object.recording.is_none());
    law.is_some_and(|dynamics| !matches!(dynamics.law.coordinates, Coordinates::Modal(_)))
}

/// Rows of the rigid parts of all objects among the dynamic Gaussians.
fn parts_of(scene: &LagrangianScene) -> Vec<Range<usize>> {
    scene.objects.iter().flat_map(rows_of_parts).collect()
}

/// Displacements of the rigid parts of all objects, by part and time, and the squared error of the images
/// without them.
fn displacements(scene: &LagrangianScene, frames: &[&Frame], times: &[f32]) -> (Vec<Vec<Found>>, f64) {
    let mut motion = Motion::new(scene, Edit::default(), Reversal::default());
    let clouds: Vec<GaussianCloud> =
        times.iter().map(|&time| scene.cloud_at(&motion.state_at(time))).collect();
    let still = Found { turn: DQuat::IDENTITY, shift: DVec3::ZERO, square_error: 0.0 };
    let parts = parts_of(scene);
    let mut found = vec![vec![still; times.len()]; parts.len()];
    let mut error = 0.0;
    for round in 0..ROUNDS {
        let bodies: Vec<Vec<Pose>> =
            (0..times.len()).map(|at| bodies_in(scene, &parts, &clouds[at], (&found, at))).collect();
        let moved: Vec<GaussianCloud> =
            (0..times.len()).map(|at| moved(&clouds[at], scene, &parts, (&found, at))).collect();
        let at = |frame: &Frame| times.partition_point(|&time| time < frame.time.max(0.0));
        let observed: Vec<Observation> = frames
            .par_iter()
            .map(|frame| observe(frame, &moved[at(frame)], &bodies[at(frame)], scene.background))
            .collect();
        let values: f64 = frames.iter().map(|frame| 3.0 * frame.pixels.counted() as f64).sum();
        let squared: f64 = observed.iter().map(|o| o.squared_error).sum();
        let mse = squared / values;
        if round == 0 {
            error = squared;
        }
        tracing::debug!(psnr = psnr_of_mse(mse), "poses from images");
        for (part, found) in found.iter_mut().enumerate() {
            for (time, found) in found.iter_mut().enumerate() {
                let own = frames.iter().zip(&observed).filter(|(frame, _)| at(frame) == time);
                let normals: Vec<&Normal> = own.map(|(_, o)| &o.normals[part]).collect();
                found.refine(&normals, bodies[time][part].radius, 1.0 / (CORRELATED_VALUES * mse));
            }
        }
    }
    (found, error)
}

impl Found {
    /// Adds the displacement that the views of a time ask for; `weight` is that of a squared difference.
    fn refine(&mut self, normals: &[&Normal], radius: f32, weight: f64) {
        let [tx, ty, tz, rx, ry, rz] = solved(normals, radius, weight);
        self.turn = (exp(DVec3::new(rx, ry, rz)) * self.turn).normalize();
        self.shift += DVec3::new(tx, ty, tz);
        if normals.len() > 1 {
            let half =
                |first: usize| -> Vec<&Normal> { normals.iter().skip(first).step_by(2).copied().collect() };
            let [even, odd] = [0, 1].map(|first| solved(&half(first), radius, weight));
            let square = |i: usize| {
                let unit = if i < 3 { 1.0 } else { f64::from(radius) };
                (0.5 * unit * (even[i] - odd[i])).powi(2)
            };
            self.square_error = (0..6).map(square).sum::<f64>() / 6.0;
        }
    }
}

/// The least-squares displacement of the views of a time; none if it is not determined.
fn solved(normals: &[&Normal], radius: f32, weight: f64) -> Displacement {
    let (mut a, mut b) = (DMatrix::zeros(6, 6), DMatrix::zeros(6, 1));
    for normal in normals {
        for i in 0..6 {
            b[i] += weight * normal.b[i];
            (0..6).for_each(|j| a[(i, j)] += weight * normal.a[i][j]);
        }
    }
    for i in 0..6 {
        let unit = if i < 3 { f64::from(radius) } else { 1.0 };
        a[(i, i)] += (PRIOR_DEVIATION * unit).powi(-2);
    }
    let found = solve_positive(a, &b).filter(|found| found.iter().all(|x| x.is_finite()));
    found.map_or([0.0; 6], |found| std::array::from_fn(|i| found[i]))
}

/// The bodies where they have been found at a time; `cloud` is that of the scene's motion.
fn bodies_in(
    scene: &LagrangianScene,
    parts: &[Range<usize>],
    cloud: &GaussianCloud,
    (found, at): (&[Vec<Found>], usize),
) -> Vec<Pose> {
    let first = scene.static_gaussians.len();
    let body = |(rows, found): (&Range<usize>, &Vec<Found>)| {
        let rows = first + rows.start..first + rows.end;
        let own = &cloud.means[rows.clone()];
        let center = mean(own);
        let square: f32 = own.iter().map(|&p| norm(sub(p, center)).powi(2)).sum();
        let radius = (square / (3 * own.len().max(1)) as f32).sqrt().max(f32::MIN_POSITIVE);
        let center = (wide(center) + found[at].shift).as_vec3().to_array();
        Pose { rows, center, radius }
    };
    parts.iter().zip(found).map(body).collect()
}

/// A cloud with all bodies where they have been found at a time.
fn moved(
    cloud: &GaussianCloud,
    scene: &LagrangianScene,
    parts: &[Range<usize>],
    (found, at): (&[Vec<Found>], usize),
) -> GaussianCloud {
    let mut cloud = cloud.clone();
    let first = scene.static_gaussians.len();
    for (rows, found) in parts.iter().zip(found) {
        let rows = first + rows.start..first + rows.end;
        let center = mean(&cloud.means[rows.clone()]);
        let body = Pose { rows, center, radius: 1.0 };
        let axis = found[at].turn.to_scaled_axis();
        let [tx, ty, tz] = found[at].shift.to_array();
        (cloud.means, cloud.rotations) = displaced(&cloud, &body, &[tx, ty, tz, axis.x, axis.y, axis.z]);
    }
    cloud
}

/// The points of a rigid part about their centre, and their poses as the images show them. Views that
/// disagree tell of errors of the Gaussians, which are much the same at neighbouring times.
fn poses_of(scene: &LagrangianScene, rows: &Range<usize>, (times, found): (&[f32], &[Found])) -> BodyPoses {
    let points = &scene.dynamic_gaussians.means[rows.clone()];
    let center = wide(mean(points));
    let shape = points.iter().map(|&p| wide(p) - center).collect();
    let mut motion = Motion::new(scene, Edit::default(), Reversal::default());
    let pose = |(&time, found): (&f32, &Found)| {
        let state = motion.state_at(time);
        let turn = quaternion(&state.rotation[rows.start].map(f64::from)).normalize();
        let at = wide(mean(&state.q[rows.clone()]));
        (DMat3::from_quat(found.turn * turn), at + found.shift)
    };
    let square_error = found.iter().map(|found| found.square_error).sum::<f64>() / found.len().max(1) as f64;
    BodyPoses {
        times: times.iter().map(|&time| f64::from(time)).collect(),
        poses: times.iter().zip(found).map(pose).collect(),
        shape,
        slow_error: square_error.sqrt(),
        surroundings: scene.static_gaussians.means.iter().map(|p| p.map(f64::from)).collect(),
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
    scene.objects[object].dynamics = Dynamics::Generalised(GeneralisedDynamics { law, bodies, start, known });
}
