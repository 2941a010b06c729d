//! From a source model to the initial Lagrangian scene: sample trajectories, distil them, and take the
//! Gaussians as they are at t = 0.
//!
//! A scene's Gaussians lie in spatial order, body by body: what kernels read together then lies together in
//! memory.

use std::ops::Range;
use std::sync::Arc;

use lgs_core::{GaussianCloud, spatial_order};
use lgs_distill::{
    DistillConfig, DistillObserver, DistillReport, Distilled, DistilledLaw, DistilledParticles, Partition,
    SceneDistillation, Trajectories, find_objects_beside,
};
use lgs_dynamics::{Supports, VelocityPolicy};
use lgs_model::source::SourceModel;
use lgs_model::{
    Dynamics, GeneralisedDynamics, LagrangianScene, MotionConfig, ObjectModel, ParticleDynamics, Recording,
};

use super::continuation::{Known, carried_on};
use super::counterfactual::ComparedFrames;
use super::joined_objects::joined;
use super::motion_options::MotionOptions;
use super::observed_motion::{observed_to_move, rises_at_rest};
use super::recorder::{Recorder, SourceTracks, append};
use super::rest_retuned::{Objects, doubtful, moving};
use super::scene_request::InitialSceneRequest;
use super::shown_motions::shown_motions;
use super::things::HandledThings;
use crate::error::TrainError;
use crate::thresholds::{EVEN, FEWEST_FRAMES};

/// A distilled scene with the report of every object.
pub struct InitialScene {
    /// The scene before photometric tuning.
    pub scene: LagrangianScene,
    /// What distillation found, object by object.
    pub reports: Vec<DistillReport>,
    /// The source's Gaussian that each Gaussian is, the static ones first, then the dynamic ones.
    pub source_rows: Vec<usize>,
}

/// Stage 1: samples the source every Δτ over the window, distils, and assembles the scene at t = 0 (method
/// §5).
///
/// # Errors
/// If the source's trajectories are not finite, or the distillation fails.
pub fn initialise_scene(
    source: &dyn SourceModel,
    request: &InitialSceneRequest<'_>,
    observer: &mut dyn DistillObserver,
) -> Result<InitialScene, TrainError> {
    let times = sampled_times(source, request.time_window, request.motion.dt);
    let dt = times[1] - times[0];
    let positions = times.iter().map(|&t| source.positions_at(t)).collect();
    let mut cloud = source.unshaded_at(0.0);
    let weights: Vec<f32> = (0..cloud.len()).map(|i| cloud.opacity(i)).collect();
    let trajectories = Trajectories { times, positions, weights: Some(weights) };
    let rigid_constraint = request.distill.rigid_constraint && request.motion.alignment;
    let object = DistillConfig {
        rigid_constraint,
        alignment: request.motion.alignment(),
        device: request.device.clone(),
        ..request.distill.resolving(request.pixel_size)
    };
    let things = source.carried();
    let found = find_objects_beside(things, &trajectories, request.partition)?;
    let moves = found.object.clone();
    let partition = seen_to_move((source, &trajectories), found, request);
    let window = [trajectories.times[0], trajectories.times[trajectories.times.len() - 1]];
    let handled = HandledThings::of(source, window, &object);
    let distilled = handled.distilled(&trajectories, partition, (&object, request.seed), observer)?;
    let tracks = SourceTracks { source, times: &trajectories.times };
    let is_left = |i: &usize| moves[*i] >= 0 && distilled.partition.object[*i] < 0;
    let left: Vec<usize> = (0..cloud.len()).filter(is_left).collect();
    tracks.bring_to_rest(&mut cloud, &left, &trajectories);
    let recorder = Recorder { tracks, trajectories: &trajectories, config: &object, handled: &handled };
    Ok(assemble(&cloud, distilled, (request, dt), &recorder))
}

/// The objects that images show to move, those put together that they do not show to move apart; all of them
/// without images, or where every motion counts as seen.
fn seen_to_move(
    (source, trajectories): (&dyn SourceModel, &Trajectories),
    found: Partition,
    request: &InitialSceneRequest<'_>,
) -> Partition {
    let frames = ComparedFrames::new(request.frames, request.background);
    let tolerance = f64::from(request.partition.unseen_motion);
    if frames.len() == 0 || tolerance <= 0.0 {
        return found;
    }
    let rises = rises_at_rest(source, &found, &frames);
    let mut seen = observed_to_move(&rises, tolerance);
    // What silhouettes have found to fly is seen to move, by itself.
    let things = source.carried();
    for (object, _) in found.object.iter().zip(things).filter(|(_, thing)| **thing > 0) {
        seen[*object as usize] = true;
    }
    let partition = found.with_only(&seen);
    if things.iter().any(|&thing| thing > 0) {
        return partition;
    }
    let of_kept = |rises: Vec<f64>, kept: &[bool]| -> Vec<f64> {
        rises.into_iter().zip(kept).filter_map(|(rise, kept)| kept.then_some(rise)).collect()
    };
    let rises = of_kept(rises, &seen);
    let times: Vec<f32> = frames.times().collect();
    let shown = |partition: &Partition| {
        shown_motions(&Objects::new(source, trajectories, partition), request, &times)
    };
    let in_doubt = doubtful(&rises);
    if in_doubt.is_empty() {
        return joined(source, partition, (&frames, &rises), tolerance, &shown);
    }
    let moving = moving((source, trajectories), &partition, &in_doubt, request);
    let (partition, rises) = (partition.with_only(&moving), of_kept(rises, &moving));
    joined(source, partition, (&frames, &rises), tolerance, &shown)
}

/// Times at which the source is sampled: those of its frames, if these lie evenly apart and are enough for
/// everything that is fitted to them, else a grid of Δτ. What is between frames is a guess, above all at an
/// impact.
pub(super) fn sampled_times(source: &dyn SourceModel, window: f32, step: f32) -> Vec<f32> {
    let known = source.known_times().unwrap_or_default();
    let in_window = known.iter().filter(|&&time| time >= 0.0 && time <= window * (1.0 + EVEN)).count();
    let frames = &known[known.partition_point(|&time| time < 0.0)..][..in_window];
    if let [first, .., last] = *frames
        && frames.len() >= FEWEST_FRAMES
    {
        let dt = (last - first) / (frames.len() - 1) as f32;
        let is_even = |(i, time): (usize, &f32)| (time - i as f32 * dt).abs() <= EVEN * dt;
        if frames.iter().enumerate().all(is_even) {
            return frames.to_vec();
        }
    }
    let steps = (window / step).round().max(1.0) as usize;
    (0..=steps).map(|i| i as f32 * step).collect()
}

fn assemble(
    cloud: &GaussianCloud,
    distilled: SceneDistillation,
    (request, dt): (&InitialSceneRequest<'_>, f32),
    recorder: &Recorder<'_>,
) -> InitialScene {
    let mut source_rows = at_rest(cloud, &distilled);
    let static_gaussians = cloud.select(&source_rows);
    let mut dynamic_gaussians = cloud.select(&[]);
    let (mut velocities, mut objects, mut reports) = (Vec::new(), Vec::new(), Vec::new());
    for (rows, object) in distilled.objects {
        let start = dynamic_gaussians.len();
        let order = order_within(&object);
        let object = object.in_order(&order);
        let rows: Vec<usize> = order.iter().map(|&i| rows[i as usize]).collect();
        append(&mut dynamic_gaussians, &cloud.select(&rows));
        let recording = recorder.recording(&rows, &object);
        let at_start = recording.as_ref().map_or(object.q0(), Recording::start);
        dynamic_gaussians.means[start..].copy_from_slice(at_start);
        velocities.extend(object.v0());
        source_rows.extend(rows);
        reports.push(object.report().clone());
        let (members, dynamics) = (start..dynamic_gaussians.len(), dynamics(object, request.motion));
        objects.push(ObjectModel { members, dynamics, recording });
    }
    let shading = recorder.tracks.source.shading().map(|shading| shading.select(&source_rows));
    let motion = MotionConfig { dt, time_window: request.time_window };
    let scene = LagrangianScene {
        dynamic_gaussians,
        velocities,
        objects,
        shading,
        ..LagrangianScene::still(static_gaussians, motion, request.background)
    };
    InitialScene { scene: with_continuations(scene, &reports, request.distill), reports, source_rows }
}

/// The scene with what carries on the recordings of its objects.
fn with_continuations(
    mut scene: LagrangianScene,
    reports: &[DistillReport],
    config: &DistillConfig,
) -> LagrangianScene {
    let carried_on = |(object, report): (ObjectModel, &DistillReport)| {
        let velocities = &scene.velocities[object.members.clone()];
        let (motion, forecast_error) = (scene.motion, report.forecast_error);
        carried_on(object, Known { velocities, motion, forecast_error, config })
    };
    scene.objects = std::mem::take(&mut scene.objects).into_iter().zip(reports).map(carried_on).collect();
    scene
}

fn dynamics(object: Distilled, options: &MotionOptions) -> Dynamics {
    match object {
        Distilled::Particles(object) => {
            let (supports, velocity_policy) = alignment(&object, options);
            Dynamics::Particles(ParticleDynamics { system: object.system, supports, velocity_policy })
        }
        Distilled::Generalised(object) => {
            let DistilledLaw { law, bodies, start, known, .. } = *object;
            Dynamics::Generalised(GeneralisedDynamics { law, bodies, start, known })
        }
    }
}

/// Spatial order of an object's particles, body by body.
fn order_within(object: &Distilled) -> Vec<u32> {
    let of_body = |rows: Range<usize>| {
        let first = rows.start as u32;
        spatial_order(&object.q0()[rows]).into_iter().map(move |i| first + i)
    };
    object.ranges().into_iter().flat_map(of_body).collect()
}

/// Supports and velocity policy of an object: what its law was fitted with if it holds for the body as a
/// whole, else what the options say.
fn alignment(
    object: &DistilledParticles,
    options: &MotionOptions,
) -> (Option<Arc<Supports>>, VelocityPolicy) {
    if object.shared_support.is_some() {
        return (Some(Arc::new(object.supports(0))), VelocityPolicy::Rigid);
    }
    let aligned = options.alignment().filter(|_| object.q0.len() > 1);
    (aligned.map(|alignment| Arc::new(object.supports(alignment.support))), options.velocity_policy)
}

/// Rows of the Gaussians at rest, in spatial order.
fn at_rest(cloud: &GaussianCloud, distilled: &SceneDistillation) -> Vec<usize> {
    let rows: Vec<usize> = (0..cloud.len()).filter(|&i| distilled.partition.object[i] < 0).collect();
    let means: Vec<[f32; 3]> = rows.iter().map(|&i| cloud.means[i]).collect();
    spatial_order(&means).iter().map(|&i| rows[i as usize]).collect()
}
