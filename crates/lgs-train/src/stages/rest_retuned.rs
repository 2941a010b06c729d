//! Objects that images show as well at rest once Gaussians are tuned to it.
//!
//! Where a moment has few images, a source model fits by motion what it has not learnt otherwise: a part of a
//! floor drifts. Its Gaussians have been learnt with that motion, so that the training images are drawn worse
//! by these Gaussians at rest, and the motion counts as seen. Gaussians that are tuned to one half of the
//! images with the motion and without it tell by the other half whether anything moves (method §5.1).

use lgs_data::dataset::Frame;
use lgs_distill::{Partition, Trajectories};
use lgs_mechanics::bands::Known;
use lgs_mechanics::coordinates::{Bodies, Coordinates, State};
use lgs_mechanics::{Law, MechanicsError};
use lgs_model::source::SourceModel;
use lgs_model::{Dynamics, GeneralisedDynamics, LagrangianScene, MotionConfig, ObjectModel, Recording};

use super::newton::squared_error_of;
use super::recorder::{SourceTracks, append};
use super::scene_request::InitialSceneRequest;
use super::thresholds::{OBSERVED_FRACTION, RETUNING_STEPS};
use super::{TrainingData, TuneGaussians, TuneGaussiansConfig};
use crate::driver::{SceneTrainer, Trainer};

/// Objects whose motion shows little beside that of another one, by how much the images are worse with each
/// at rest; those that show least first.
pub(super) fn doubtful(rises: &[f64]) -> Vec<usize> {
    let most = rises.iter().copied().fold(0.0, f64::max);
    let mut found: Vec<usize> = (0..rises.len()).filter(|&o| rises[o] < OBSERVED_FRACTION * most).collect();
    found.sort_by(|&a, &b| rises[a].total_cmp(&rises[b]));
    found
}

/// For every object whether it moves: those in doubt do if tuned Gaussians draw images that they were not
/// tuned to worse with the object at rest. All do where there are no two halves of the images.
pub(super) fn moving(
    (source, trajectories): (&dyn SourceModel, &Trajectories),
    partition: &Partition,
    doubtful: &[usize],
    request: &InitialSceneRequest<'_>,
) -> Vec<bool> {
    let mut moving = vec![true; partition.objects];
    let halves = halves(request.frames);
    if halves.iter().any(Vec::is_empty) {
        return moving;
    }
    let objects = Objects::new(source, trajectories, partition);
    let error = |moving: &[bool]| {
        let scene = objects.playing(moving, request).ok()?;
        Some(error_after_tuning(scene, &halves, request))
    };
    let Some(mut least) = error(&moving) else { return moving };
    for &object in doubtful {
        let mut without = moving.clone();
        without[object] = false;
        let Some(at_rest) = error(&without) else { continue };
        tracing::debug!(
            object,
            moving = least,
            at_rest,
            "error of images after tuning, in motion and at rest"
        );
        if at_rest <= least {
            (moving, least) = (without, at_rest);
        }
    }
    moving
}

/// Two halves of the frames, each of which has frames of all times and of all cameras, as far as these have
/// several.
fn halves(frames: &[Frame]) -> [Vec<Frame>; 2] {
    let mut ordered: Vec<&Frame> = frames.iter().collect();
    ordered.sort_by(|a, b| a.time.total_cmp(&b.time));
    let mut halves = [Vec::new(), Vec::new()];
    for (number, of_time) in ordered.chunk_by(|a, b| a.time == b.time).enumerate() {
        // Every other time begins with the other half.
        for (index, frame) in of_time.iter().enumerate() {
            halves[(number + index) % 2].push(Frame::clone(frame));
        }
    }
    halves
}

/// Squared error of the images of one half after Gaussians have been tuned to the other.
fn error_after_tuning(
    scene: LagrangianScene,
    [seen, others]: &[Vec<Frame>; 2],
    request: &InitialSceneRequest<'_>,
) -> f64 {
    let &InitialSceneRequest { viewing_distance, seed, device, .. } = request;
    let data = TrainingData { frames: seen, viewing_distance, seed, device };
    let config =
        TuneGaussiansConfig { stretch: 1.0, iterations: RETUNING_STEPS, ..TuneGaussiansConfig::default() };
    let mut trainer = TuneGaussians::new(scene, data, &config);
    for _ in 0..RETUNING_STEPS {
        trainer.step();
    }
    squared_error_of(&trainer.scene(), &others.iter().collect::<Vec<_>>())
}

/// The objects of a partition of a source's Gaussians, with the motion of each.
pub(super) struct Objects<'a> {
    tracks: SourceTracks<'a>,
    trajectories: &'a Trajectories,
    partition: &'a Partition,
    /// By object.
    recordings: Vec<Option<Recording>>,
}

impl<'a> Objects<'a> {
    pub(super) fn new(
        source: &'a dyn SourceModel,
        trajectories: &'a Trajectories,
        partition: &'a Partition,
    ) -> Self {
        let tracks = SourceTracks { source, times: &trajectories.times };
        let of = |object| tracks.recording(&partition.members(object), &trajectories.positions);
        let recordings = (0..partition.objects).map(of).collect();
        Self { tracks, trajectories, partition, recordings }
    }

    /// Number of objects.
    pub(super) fn len(&self) -> usize {
        self.partition.objects
    }

    /// The scene in which some of them play the source's tracks, and the others are at rest.
    pub(super) fn playing(
        &self,
        moving: &[bool],
        request: &InitialSceneRequest<'_>,
    ) -> Result<LagrangianScene, MechanicsError> {
        let Self { tracks, partition, .. } = self;
        let (chosen, left): (Vec<usize>, Vec<usize>) = (0..partition.objects).partition(|&o| moving[o]);
        let left: Vec<usize> = left.into_iter().flat_map(|object| partition.members(object)).collect();
        let mut cloud = tracks.source.unshaded_at(tracks.times[0]);
        tracks.bring_to_rest(&mut cloud, &left, self.trajectories);
        let rests = |i: &usize| usize::try_from(partition.object[*i]).map_or(true, |object| !moving[object]);
        let mut rows: Vec<usize> = (0..cloud.len()).filter(rests).collect();
        let dt = tracks.times[1] - tracks.times[0];
        let motion = MotionConfig { dt, time_window: request.time_window };
        let mut scene = LagrangianScene::still(cloud.select(&rows), motion, request.background);
        for object in chosen {
            let own = partition.members(object);
            let members = scene.dynamic_gaussians.len()..scene.dynamic_gaussians.len() + own.len();
            append(&mut scene.dynamic_gaussians, &cloud.select(&own));
            let recording = self.recordings[object].clone();
            scene.objects.push(ObjectModel { members, dynamics: at_rest(dt)?, recording });
            rows.extend(own);
        }
        scene.velocities = vec![[0.0; 3]; scene.dynamic_gaussians.len()];
        scene.shading = tracks.source.shading().map(|shading| shading.select(&rows));
        Ok(scene)
    }
}

/// The dynamics of an object whose recording is played.
fn at_rest(dt: f32) -> Result<Dynamics, MechanicsError> {
    let law = Law::new(Coordinates::Point, Vec::new(), Vec::new(), f64::from(dt))?;
    let start = State { x: vec![0.0; 3], v: vec![0.0; 3] };
    let (bodies, known) = (Bodies::default(), Known::default());
    Ok(Dynamics::Generalised(GeneralisedDynamics { law, bodies, start, known }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use lgs_core::{Camera, Exposure};

    fn frame(time: f32, camera_id: usize) -> Frame {
        Frame {
            name: String::new(),
            camera_id,
            camera: Camera::look_at([0.0, -1.0, 0.0], [0.0; 3], 0.5, 1, 1),
            time,
            exposure: Exposure::IDENTITY,
            pixels: vec![0; 4].into(),
        }
    }

    #[test]
    fn motions_that_show_little_beside_another_one_are_in_doubt() {
        assert_eq!(doubtful(&[60.0, 1.3, 7.0, 1.1]), [3, 1]);
        assert!(doubtful(&[0.2]).is_empty() && doubtful(&[]).is_empty(), "what shows most moves");
    }

    #[test]
    fn both_halves_have_all_times_and_all_cameras() {
        let frames: Vec<Frame> = (0..8).map(|k| frame((k / 4) as f32, k % 4)).collect();
        let [first, second] = halves(&frames);
        for half in [&first, &second] {
            let mut cameras: Vec<usize> = half.iter().map(|frame| frame.camera_id).collect();
            cameras.sort_unstable();
            assert_eq!(cameras, [0, 1, 2, 3], "each once");
            assert_eq!(half.iter().filter(|frame| frame.time == 0.0).count(), 2);
        }
        let one_each: Vec<Frame> = (0..6).map(|k| frame(k as f32, k)).collect();
        assert_eq!(halves(&one_each).map(|half| half.len()), [3, 3], "one image of each time");
    }
}
