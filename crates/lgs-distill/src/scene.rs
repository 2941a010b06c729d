//! Stage 1 for a whole scene: every object by itself or with another one that it acts on, and objects that
//! are parts of others given up.

use crate::config::{DistillConfig, DynamicsKind};
use crate::couple::{couple, possible_pairs};
use crate::distilled::{Distilled, DistilledLaw};
use crate::error::DistillError;
use crate::laws::generalised::Surroundings;
use crate::object::Prepared;
use crate::progress::{DistillObserver, LawSearch};
use crate::segmentation::partition::Partition;
use crate::segmentation::regroup::{Fate, dissolve, fraction_left_by_others};
use crate::thresholds::{
    LEFT_BY_OTHERS_FRACTION, LIGHTEST, OUTLIER_SHARE, POOR_FORECAST_FRACTION, UNDESCRIBED_FRACTION,
};
use crate::trajectories::{Trajectories, same_length};
use rayon::prelude::*;

/// Stage 1 of a scene.
#[derive(Clone, Debug)]
pub struct SceneDistillation {
    /// Labels of all particles.
    pub partition: Partition,
    /// Every object's particles (indices into the scene's), body by body, and its system.
    pub objects: Vec<(Vec<usize>, Distilled)>,
}

/// Distils each object of a partition of the same particles. Two objects that act on each other, by a force
/// or by a joint, become one.
///
/// A group of particles that its system does not describe, or forecasts badly, is no object if the motions of
/// others explain most of it: its particles go to the others or to rest. Of one that is not described they
/// get what they explain in any case. All is distilled again, until little changes or `observer` has no time
/// for it. The partition returned is the one that came of it. Objects of the paper's networks all stay.
///
/// # Errors
/// If trajectories or configuration are malformed, or a fit left the finite numbers.
pub fn distill_objects(
    trajectories: &Trajectories,
    mut partition: Partition,
    config: &DistillConfig,
    seed: u64,
    observer: &mut dyn DistillObserver,
) -> Result<SceneDistillation, DistillError> {
    trajectories.validate()?;
    same_length("partition", trajectories.len(), partition.object.len())?;
    let mut objects: Vec<Object> = Vec::new();
    let mut round = 1;
    loop {
        let before = (&partition, objects.as_slice());
        objects = distil_once(trajectories, before, (config, seed), &mut Round { round, observer })?;
        if config.dynamics == DynamicsKind::Networks {
            return Ok(scene_of(trajectories, objects));
        }
        round += 1;
        let fates = fates(trajectories, &objects);
        let of_group = |group: usize| {
            let own = objects.iter().zip(&fates).find(|(object, _)| object.groups.contains(&group));
            own.map_or(Fate::Stays, |(_, fate)| *fate)
        };
        let groups: Vec<Fate> = (0..partition.objects).map(of_group).collect();
        let next = dissolve(trajectories, &partition, &groups);
        let changed = next.object.iter().zip(&partition.object).filter(|(next, own)| next != own).count();
        // Particles change their object in the first round alone, lest they go back and forth, and a few of
        // them change no law.
        let is_same = round > 2 || changed * OUTLIER_SHARE <= partition.moving();
        let is_settled = is_same && !fates.contains(&Fate::Goes);
        if is_settled || !observer.has_time_for(round) {
            return Ok(scene_of(trajectories, objects));
        }
        tracing::debug!(?fates, "objects that are parts of others are dissolved");
        partition = next;
    }
}

/// One of the times that all objects are distilled.
struct Round<'a> {
    /// From 1 on.
    round: usize,
    observer: &'a mut dyn DistillObserver,
}

impl Round<'_> {
    fn has_time_to_seek(&mut self, search: LawSearch) -> bool {
        search == LawSearch::WithinNoise || self.observer.has_time_to_seek(search, self.round)
    }

    /// Goes through the searches for laws of single objects among points at rest.
    fn seek_laws(
        &mut self,
        prepared: &mut [Option<Prepared>],
        at_rest: &[[f64; 3]],
        (config, seed): (&DistillConfig, u64),
    ) {
        let surroundings = Surroundings { at_rest, hits: &[] };
        for search in LawSearch::OF_OBJECT {
            let is_open = prepared.iter().flatten().any(|own| own.is_open_to(search, config));
            if is_open && self.has_time_to_seek(search) {
                let of_group = |(group, own): (usize, &mut Option<Prepared>)| {
                    let seed = seed.wrapping_add(group as u64);
                    own.iter_mut().for_each(|own| own.seek(search, surroundings, config, seed));
                };
                prepared.par_iter_mut().enumerate().for_each(of_group);
            }
        }
    }
}

/// An object of one group of the partition, or of several that act on each other.
struct Object {
    groups: Vec<usize>,
    members: Vec<usize>,
    distilled: Distilled,
}

/// Distils the groups of a partition: first each as a body by itself, then those that act on each other, then
/// what is left by itself. Objects of particles that were found `before` stay where their particles are the
/// same: only these, the configuration and the seed decide what they are.
fn distil_once(
    trajectories: &Trajectories,
    (partition, before): (&Partition, &[Object]),
    (config, seed): (&DistillConfig, u64),
    round: &mut Round<'_>,
) -> Result<Vec<Object>, DistillError> {
    let own_seed = |group: usize| seed.wrapping_add(group as u64);
    let mut prepared = Vec::with_capacity(partition.objects);
    for group in 0..partition.objects {
        let mut tell = |p| round.observer.progress(group, partition.objects, p);
        let own = trajectories.select(&partition.members(group));
        prepared.push(Some(Prepared::new(&own, (config, own_seed(group)), &mut tell)?));
    }
    round.seek_laws(&mut prepared, &at_rest(trajectories, partition), (config, seed));
    let mut pairs = possible_pairs(&prepared);
    if !pairs.is_empty() && !round.has_time_to_seek(LawSearch::OfPairs) {
        pairs.clear();
    }
    let mut objects = Vec::with_capacity(partition.objects);
    for (groups, law) in couples(&prepared, &pairs, config, seed) {
        groups.iter().for_each(|&group| prepared[group] = None);
        let members = groups.iter().flat_map(|&group| partition.members(group)).collect();
        objects.push(Object { groups, members, distilled: Distilled::Generalised(Box::new(law)) });
    }
    for (group, prepared) in prepared.into_iter().enumerate() {
        let Some(prepared) = prepared else { continue };
        let mut tell = |p| round.observer.progress(group, partition.objects, p);
        let members = partition.members(group);
        let known = before.iter().find(|object| object.members == members);
        let known = known.and_then(|object| object.distilled.particles());
        let distilled = prepared.distilled((config, own_seed(group)), known, &mut tell)?;
        objects.push(Object { groups: vec![group], members, distilled });
    }
    Ok(objects)
}

/// Groups that act on each other, in the order in which their law takes them, and that law: the likeliest
/// first, each group once.
fn couples(
    prepared: &[Option<Prepared>],
    pairs: &[[usize; 2]],
    config: &DistillConfig,
    seed: u64,
) -> Vec<(Vec<usize>, DistilledLaw)> {
    let of_pair = |&[a, b]: &[usize; 2]| {
        let (Some(first), Some(second)) = (&prepared[a], &prepared[b]) else { return None };
        let found = couple([first, second], config, seed.wrapping_add(a as u64))?;
        Some((found.gain, found.order.map(|i| [a, b][i]), found.law))
    };
    let mut all: Vec<(f64, [usize; 2], DistilledLaw)> = pairs.par_iter().filter_map(of_pair).collect();
    all.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut taken: Vec<usize> = Vec::new();
    let mut chosen = Vec::new();
    for (_, groups, law) in all {
        if groups.iter().all(|group| !taken.contains(group)) {
            taken.extend(groups);
            chosen.push((groups.to_vec(), law));
        }
    }
    chosen
}

/// The objects by falling size, and the labels of all particles.
fn scene_of(trajectories: &Trajectories, mut objects: Vec<Object>) -> SceneDistillation {
    objects.sort_by_key(|object| (std::cmp::Reverse(object.members.len()), object.members.first().copied()));
    let groups = objects.iter().map(|object| object.members.clone()).collect();
    SceneDistillation {
        partition: Partition::of_groups(groups, trajectories.len()),
        objects: objects.into_iter().map(|object| (object.members, object.distilled)).collect(),
    }
}

/// Mean places of the static particles, without faint ones.
fn at_rest(trajectories: &Trajectories, partition: &Partition) -> Vec<[f64; 3]> {
    let weights = trajectories.particle_weights();
    let least = LIGHTEST * weights.iter().sum::<f64>() / weights.len().max(1) as f64;
    let rests = |i: &usize| partition.object[*i] < 0 && weights[*i] >= least;
    (0..trajectories.len()).filter(rests).map(|i| trajectories.mean_place(i).to_array()).collect()
}

/// What becomes of each object. One that its system does not describe goes if others explain most of it, and
/// loses what others explain if that is less. If all are described, the one that is forecast worst goes if
/// others explain it roughly. What nothing else explains stays, whatever describes it.
fn fates(trajectories: &Trajectories, objects: &[Object]) -> Vec<Fate> {
    let is_described = |object: &Object| {
        let report = object.distilled.report();
        report.window_error <= UNDESCRIBED_FRACTION * report.displacement
    };
    let described: Vec<bool> = objects.iter().map(is_described).collect();
    let worst = forecast_worst(objects).filter(|_| !described.contains(&false));
    let others: Vec<bool> = (0..objects.len()).map(|o| described[o] && Some(o) != worst).collect();
    let fate = |o: usize| {
        if others[o] {
            Fate::Stays
        } else if is_part_of_others(trajectories, (objects, &others), o) {
            Fate::Goes
        } else if described[o] {
            Fate::Stays
        } else {
            Fate::LosesParts
        }
    };
    (0..objects.len()).map(fate).collect()
}

/// The object that is forecast worst, if that is badly.
fn forecast_worst(objects: &[Object]) -> Option<usize> {
    let missed = |o: usize| {
        let report = objects[o].distilled.report();
        report.forecast_error.unwrap_or(0.0) / report.displacement.max(f64::MIN_POSITIVE)
    };
    let worst = (0..objects.len()).max_by(|&a, &b| missed(a).total_cmp(&missed(b)));
    worst.filter(|&o| missed(o) > POOR_FORECAST_FRACTION)
}

/// Whether the motions of the bodies of some objects explain another one roughly.
fn is_part_of_others(
    trajectories: &Trajectories,
    (objects, others): (&[Object], &[bool]),
    own: usize,
) -> bool {
    let bodies = |(object, _): (&'_ Object, &bool)| {
        object.distilled.ranges().into_iter().map(|rows| object.members[rows].to_vec()).collect::<Vec<_>>()
    };
    let chosen = objects.iter().zip(others).filter(|(_, is_chosen)| **is_chosen);
    let others: Vec<Vec<usize>> = chosen.flat_map(bodies).collect();
    let left = fraction_left_by_others(trajectories, &objects[own].members, &others);
    tracing::debug!(object = own, left, "fraction of a doubtful object's motion that others leave");
    left < LEFT_BY_OTHERS_FRACTION
}
