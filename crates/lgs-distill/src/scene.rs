//! Stage 1 for a whole scene: every object by itself, and the objects that no system follows given up.

use crate::config::{DistillConfig, DynamicsKind};
use crate::distilled::Distilled;
use crate::error::DistillError;
use crate::object::distill_among;
use crate::progress::DistillProgress;
use crate::segmentation::partition::Partition;
use crate::segmentation::regroup::{dissolve, fraction_left_by_others};
use crate::thresholds::{LEFT_BY_OTHERS_FRACTION, LIGHTEST, POOR_FORECAST_FRACTION, UNDESCRIBED_FRACTION};
use crate::trajectories::{Trajectories, same_length};

/// Stage 1 of a scene.
#[derive(Clone, Debug)]
pub struct SceneDistillation {
    /// Labels of all particles.
    pub partition: Partition,
    /// Every object's particles (indices into the scene's) and system.
    pub objects: Vec<(Vec<usize>, Distilled)>,
}

/// Distils each object of a partition of the same particles; `progress` also gets the object and the number
/// of objects.
///
/// A group of particles that no system follows is no object, nor is one that its system forecasts badly while
/// the motions of others explain it roughly: its particles go to the others or to rest, and all is distilled
/// again, until something follows every object or none. The partition returned is the one that came of it.
/// Objects of the paper's networks all stay.
///
/// # Errors
/// If trajectories or configuration are malformed, or a fit left the finite numbers.
pub fn distill_objects(
    trajectories: &Trajectories,
    mut partition: Partition,
    config: &DistillConfig,
    seed: u64,
    progress: &mut dyn FnMut(usize, usize, DistillProgress),
) -> Result<SceneDistillation, DistillError> {
    trajectories.validate()?;
    same_length("partition", trajectories.len(), partition.object.len())?;
    loop {
        let surroundings = at_rest(trajectories, &partition);
        let mut objects = Vec::with_capacity(partition.objects);
        for object in 0..partition.objects {
            let members = partition.members(object);
            let own_seed = seed.wrapping_add(object as u64);
            let mut tell = |p| progress(object, partition.objects, p);
            let own = trajectories.select(&members);
            let distilled = distill_among(&own, &surroundings, config, own_seed, &mut tell)?;
            objects.push((members, distilled));
        }
        if config.dynamics == DynamicsKind::Networks {
            return Ok(SceneDistillation { partition, objects });
        }
        let kept = kept_objects(trajectories, &partition, &objects);
        if !kept.contains(&false) || !kept.contains(&true) {
            return Ok(SceneDistillation { partition, objects });
        }
        tracing::debug!(?kept, "objects that no system follows are dissolved");
        partition = dissolve(trajectories, &partition, &kept);
    }
}

/// Mean places of the static particles, without faint ones.
fn at_rest(trajectories: &Trajectories, partition: &Partition) -> Vec<[f64; 3]> {
    let weights = trajectories.particle_weights();
    let least = LIGHTEST * weights.iter().sum::<f64>() / weights.len().max(1) as f64;
    let rests = |i: &usize| partition.object[*i] < 0 && weights[*i] >= least;
    let part = (trajectories.times.len() as f64).recip();
    let mean = |i: usize| (part * trajectories.path(i).into_iter().sum::<glam::DVec3>()).to_array();
    (0..trajectories.len()).filter(rests).map(mean).collect()
}

/// Which objects stay: those that their systems describe, or if all do, all but one that is a part of others.
fn kept_objects(
    trajectories: &Trajectories,
    partition: &Partition,
    objects: &[(Vec<usize>, Distilled)],
) -> Vec<bool> {
    let is_described = |(_, object): &(_, Distilled)| {
        object.report().window_error <= UNDESCRIBED_FRACTION * object.report().displacement
    };
    let mut kept: Vec<bool> = objects.iter().map(is_described).collect();
    if !kept.contains(&false)
        && let Some(part) = part_of_others(trajectories, partition, objects)
    {
        kept[part] = false;
    }
    kept
}

/// The object that is forecast worst, if that is badly and others explain it roughly.
fn part_of_others(
    trajectories: &Trajectories,
    partition: &Partition,
    objects: &[(Vec<usize>, Distilled)],
) -> Option<usize> {
    let missed = |o: usize| {
        let report = objects[o].1.report();
        report.forecast_error.unwrap_or(0.0) / report.displacement.max(f64::MIN_POSITIVE)
    };
    let worst = (0..objects.len())
        .max_by(|&a, &b| missed(a).total_cmp(&missed(b)))
        .filter(|&o| missed(o) > POOR_FORECAST_FRACTION)?;
    let left = fraction_left_by_others(trajectories, partition, worst);
    tracing::debug!(object = worst, missed = missed(worst), left, "forecast worst");
    (left < LEFT_BY_OTHERS_FRACTION).then_some(worst)
}
