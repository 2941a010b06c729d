//! Stage 1 for a whole scene: partition, then every object by itself.

use crate::config::{DistillConfig, PartitionConfig};
use crate::distill::{DistillProgress, Distilled, distill};
use crate::partition::{Partition, partition};
use crate::regroup::{dissolve, regroup};
use crate::{DistillError, Trajectories};
use serde::{Deserialize, Serialize};

/// An object whose system leaves more than this part of its displacement has not been understood.
const UNLEARNED: f64 = 0.5;

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

/// Partitions a scene and distils each of its objects; `progress` also gets the object and the number of objects.
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
pub fn find_objects(trajectories: &Trajectories, weights: Option<&[f32]>, config: &PartitionConfig) -> Result<Partition, DistillError> {
    if let Some(found) = weights.map(<[f32]>::len).filter(|&len| len != trajectories.len()) {
        return Err(DistillError::Length { field: "weights", expected: trajectories.len(), found });
    }
    regroup(trajectories, weights, partition(trajectories, config)?, config)
}

/// Distils each object of a partition of the same particles.
///
/// What no system follows is no object: its particles go to the others or to rest, and all is distilled again, until something follows
/// every object or none. The partition returned is the one that came of it.
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
    for (field, found) in [("weights", weights.map(<[f32]>::len)), ("partition", Some(partition.object.len()))] {
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
            let distilled = distill(&trajectories.select(&members), own_weights.as_deref(), config, own_seed, &mut tell)?;
            objects.push((members, distilled));
        }
        let learned = |(_, object): &(_, Distilled)| object.report.window_error <= UNLEARNED * object.report.displacement;
        let kept: Vec<bool> = objects.iter().map(learned).collect();
        if !kept.contains(&false) || !kept.contains(&true) {
            return Ok(SceneDistillation { partition, objects });
        }
        tracing::debug!(?kept, "objects that no system follows are dissolved");
        partition = dissolve(trajectories, weights, &partition, &kept);
    }
}
