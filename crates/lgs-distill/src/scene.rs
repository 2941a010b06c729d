//! Stage 1 for a whole scene: partition, then every object by itself.

use crate::config::{DistillConfig, PartitionConfig};
use crate::distill::{DistillProgress, Distilled, distill};
use crate::partition::{Partition, partition};
use crate::regroup::{dissolve, left_by_others, regroup};
use crate::{DistillError, Trajectories};
use serde::{Deserialize, Serialize};

/// An object whose system leaves more than this part of its displacement has not been understood.
const UNLEARNED: f64 = 0.5;
/// One whose system misses the end of the window, forecast from its beginning, by more than this part of its
/// displacement …
const UNFORESEEN: f64 = 0.07;
/// … is a part of others that the source follows badly, if their motions leave less than this of what rest
/// leaves of its paths.
const ANOTHERS: f64 = 0.6;

/// Stage 1 of a scene.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SceneConfig {
    /// Static/moving split and objects.
    pub partition: PartitionConfig,
    /// Every object's fit.
    pub object: DistillConfig,
}

/// What came of a scene.
#[derive(Clone, Debug)]
pub struct SceneDistillation {
    /// Labels of all particles.
    pub partition: Partition,
    /// Every object's particles (indices into the scene's) and system.
    pub objects: Vec<(Vec<usize>, Distilled)>,
}

/// Partitions a scene and distils each of its objects; `progress` also gets the object and the number of
/// objects.
///
/// # Errors
/// If trajectories, weights or configuration are malformed, or a fit left the finite numbers.
pub fn distill_scene(
    trajectories: &Trajectories,
    weights: Option<&[f32]>,
    config: &SceneConfig,
    seed: u64,
    progress: &mut dyn FnMut(usize, usize, DistillProgress),
) -> Result<SceneDistillation, DistillError> {
    let partition = find_objects(trajectories, weights, &config.partition)?;
    distill_objects(trajectories, weights, partition, &config.object, seed, progress)
}

/// The static particles and the objects of a scene, regrouped.
///
/// # Errors
/// If trajectories or weights are malformed.
pub fn find_objects(
    trajectories: &Trajectories,
    weights: Option<&[f32]>,
    config: &PartitionConfig,
) -> Result<Partition, DistillError> {
    if let Some(found) = weights.map(<[f32]>::len).filter(|&len| len != trajectories.len()) {
        return Err(DistillError::Length { field: "weights", expected: trajectories.len(), found });
    }
    regroup(trajectories, weights, partition(trajectories, config)?, config)
}

/// Distils each object of a partition of the same particles.
///
/// What no system follows is no object, nor is what its system forecasts badly while the motions of others
/// explain it roughly: its particles go to the others or to rest, and all is distilled again, until something
/// follows every object or none. The partition returned is the one that came of it.
///
/// # Errors
/// If trajectories, weights or configuration are malformed, or a fit left the finite numbers.
pub fn distill_objects(
    trajectories: &Trajectories,
    weights: Option<&[f32]>,
    mut partition: Partition,
    config: &DistillConfig,
    seed: u64,
    progress: &mut dyn FnMut(usize, usize, DistillProgress),
) -> Result<SceneDistillation, DistillError> {
    for (field, found) in
        [("weights", weights.map(<[f32]>::len)), ("partition", Some(partition.object.len()))]
    {
        if let Some(found) = found.filter(|&len| len != trajectories.len()) {
            return Err(DistillError::Length { field, expected: trajectories.len(), found });
        }
    }
    loop {
        let mut objects = Vec::with_capacity(partition.objects);
        for object in 0..partition.objects {
            let members = partition.members(object);
            let own_weights: Option<Vec<f32>> = weights.map(|w| members.iter().map(|&i| w[i]).collect());
            let own_seed = seed.wrapping_add(object as u64);
            let mut tell = |p| progress(object, partition.objects, p);
            let distilled =
                distill(&trajectories.select(&members), own_weights.as_deref(), config, own_seed, &mut tell)?;
            objects.push((members, distilled));
        }
        let learned = |(_, object): &(_, Distilled)| {
            object.report.window_error <= UNLEARNED * object.report.displacement
        };
        let mut kept: Vec<bool> = objects.iter().map(learned).collect();
        if let Some(part) =
            part_of_others(trajectories, weights, &partition, &objects).filter(|_| !kept.contains(&false))
        {
            kept[part] = false;
        }
        if !kept.contains(&false) || !kept.contains(&true) {
            return Ok(SceneDistillation { partition, objects });
        }
        tracing::debug!(?kept, "objects that no system follows are dissolved");
        partition = dissolve(trajectories, weights, &partition, &kept);
    }
}

/// The object that is forecast worst, if that is badly and others explain it roughly.
fn part_of_others(
    trajectories: &Trajectories,
    weights: Option<&[f32]>,
    partition: &Partition,
    objects: &[(Vec<usize>, Distilled)],
) -> Option<usize> {
    let missed = |o: usize| {
        let report = &objects[o].1.report;
        report.forecast_error.unwrap_or(0.0) / report.displacement.max(f64::MIN_POSITIVE)
    };
    let worst = (0..objects.len())
        .max_by(|&a, &b| missed(a).total_cmp(&missed(b)))
        .filter(|&o| missed(o) > UNFORESEEN)?;
    let left = left_by_others(trajectories, weights, partition, worst);
    tracing::debug!(object = worst, missed = missed(worst), left, "forecast worst");
    (left < ANOTHERS).then_some(worst)
}
