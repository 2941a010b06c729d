//! Refines a partition by the objects' own motions.
//!
//! The graph of neighbours joins an object to whatever wobbles beside it, and parts one body into pieces that
//! do not touch. Here every object's rigid motion is fitted robustly, objects that move alike are merged, and
//! each moving particle goes to the motion that explains its path best, or to rest if that does. What no
//! motion explains is grouped anew among itself. A scene that is one object with nothing static beside it is
//! left as it is.

use crate::config::{PartitionConfig, PartitionMethod};
use crate::dense::{V3, add, mat_t_vec, norm2, scale, sub};
use crate::partition::{Partition, components};
use crate::pose::{Pose, PoseKind};
use crate::shared_motion::SharedMotion;
use crate::{DistillError, Trajectories};
use rayon::prelude::*;

/// Members that an object's motion is fitted to.
const SAMPLED: usize = 400;

/// Objects are merged if a motion of both leaves of each at most this many times its own residual …
const ALIKE: f64 = 2.0;
/// … plus this part of its displacement.
const ALIKE_FLOOR: f64 = 0.02;

/// A group is no object if its own motion leaves more than this part of its displacement …
const UNEXPLAINED: f64 = 0.12;
/// … and this many of it would not make up all that moves: stray particles, not a soft body.
const FEW: usize = 20;

/// The refined partition of the same particles; one by k-means (G15) is left as it is.
///
/// # Errors
/// If the trajectories are malformed.
pub fn regroup(
    trajectories: &Trajectories,
    weights: Option<&[f32]>,
    partition: Partition,
    config: &PartitionConfig,
) -> Result<Partition, DistillError> {
    trajectories.validate()?;
    let moving: Vec<usize> = (0..trajectories.len()).filter(|&i| partition.object[i] >= 0).collect();
    let one_body = partition.objects == 1 && moving.len() == trajectories.len();
    if partition.objects == 0 || one_body || config.method == PartitionMethod::KMeans {
        return Ok(partition);
    }
    let mut groups: Vec<Vec<usize>> = (0..partition.objects).map(|o| partition.members(o)).collect();
    for round in 0..config.regroup_rounds {
        let last = round + 1 == config.regroup_rounds;
        groups = regrouped(trajectories, weights, &moving, &groups, config, last);
    }
    let mut object = vec![-1; trajectories.len()];
    groups.sort_by_key(|members| (std::cmp::Reverse(members.len()), members.first().copied()));
    for (label, members) in groups.iter().enumerate() {
        members.iter().for_each(|&i| object[i] = label as i32);
    }
    Ok(Partition { object, objects: groups.len() })
}

/// The partition without the objects that `kept` denies: their particles go to the motion of another object,
/// or to rest, whichever explains their paths better.
pub(crate) fn dissolve(
    trajectories: &Trajectories,
    weights: Option<&[f32]>,
    partition: &Partition,
    kept: &[bool],
) -> Partition {
    let motions: Vec<Vec<Pose>> = (0..partition.objects)
        .filter(|&o| kept[o])
        .map(|o| motion_of(trajectories, weights, &partition.members(o)))
        .collect();
    let mut next = partition.with_only(kept);
    let is_loose = |o: i32| usize::try_from(o).is_ok_and(|o| !kept[o]);
    for (i, own) in next.object.iter_mut().enumerate().filter(|(i, _)| is_loose(partition.object[*i])) {
        *own = nearest_motion(trajectories, i, &motions).map_or(-1, |(object, _)| object as i32);
    }
    next
}

/// What the best motion of other objects leaves of the paths of an object's particles, as a part of what rest
/// leaves; the median over them.
pub(crate) fn left_by_others(
    trajectories: &Trajectories,
    weights: Option<&[f32]>,
    partition: &Partition,
    object: usize,
) -> f64 {
    let others = (0..partition.objects).filter(|&o| o != object);
    let motions: Vec<Vec<Pose>> =
        others.map(|o| motion_of(trajectories, weights, &partition.members(o))).collect();
    let members = partition.members(object);
    let left = |&i: &usize| nearest_motion(trajectories, i, &motions).map_or(1.0, |(_, part)| part);
    let mut parts: Vec<f64> =
        members.iter().step_by(members.len().div_ceil(SAMPLED).max(1)).map(left).collect();
    parts.sort_by(f64::total_cmp);
    parts.get(parts.len() / 2).copied().unwrap_or(1.0)
}

/// One round: fit, merge, assign, and group what is left over.
fn regrouped(
    trajectories: &Trajectories,
    weights: Option<&[f32]>,
    moving: &[usize],
    groups: &[Vec<usize>],
    config: &PartitionConfig,
    last: bool,
) -> Vec<Vec<usize>> {
    let motions: Vec<Vec<Pose>> = distinct(trajectories, weights, groups.to_vec());
    let chosen: Vec<Choice> =
        moving.par_iter().map(|&i| choose(trajectories, i, &motions, config, last)).collect();
    let mut next = vec![Vec::new(); motions.len()];
    let mut left = Vec::new();
    for (&i, choice) in moving.iter().zip(chosen) {
        match choice {
            Choice::Object(o) => next[o].push(i),
            Choice::Unexplained => left.push(i),
            Choice::Static => {}
        }
    }
    next.extend(grouped(trajectories, &left, config));
    next.retain(|members| members.len() >= config.smallest_object.max(1));
    next
}

/// What becomes of a moving particle.
enum Choice {
    Static,
    Object(usize),
    Unexplained,
}

fn choose(
    trajectories: &Trajectories,
    particle: usize,
    motions: &[Vec<Pose>],
    config: &PartitionConfig,
    last: bool,
) -> Choice {
    if motions.is_empty() && !last {
        return Choice::Unexplained;
    }
    match nearest_motion(trajectories, particle, motions) {
        None => Choice::Static,
        Some((object, part)) if last || part <= f64::from(config.displacement_tolerance) => {
            Choice::Object(object)
        }
        Some(_) => Choice::Unexplained,
    }
}

/// The motion that explains a particle's path best, and what it leaves of the path as a part of what rest
/// leaves; none if rest is better.
fn nearest_motion(
    trajectories: &Trajectories,
    particle: usize,
    motions: &[Vec<Pose>],
) -> Option<(usize, f64)> {
    let rest = residual(trajectories, particle, None);
    let residuals = motions.iter().map(|poses| residual(trajectories, particle, Some(poses)));
    let (object, best) = residuals.enumerate().min_by(|a, b| a.1.total_cmp(&b.1))?;
    (best < rest).then(|| (object, best / rest))
}

/// Root mean square distance of a particle's path from its best place in a motion; without a motion, from its
/// mean.
fn residual(trajectories: &Trajectories, particle: usize, poses: Option<&[Pose]>) -> f64 {
    let samples = trajectories.times.len();
    let part = 1.0 / samples as f64;
    let place = |s: usize| {
        let x = trajectories.at(s, particle);
        poses.map_or(x, |poses| mat_t_vec(&poses[s].linear, sub(x, poses[s].shift)))
    };
    let mean = scale((0..samples).fold([0.0; 3], |sum, s| add(sum, place(s))), part);
    // Rotations keep distances, so residuals can be taken in the body's axes.
    ((0..samples).map(|s| norm2(sub(place(s), mean))).sum::<f64>() * part).sqrt()
}

/// The rigid motion of most of an object.
fn motion_of(trajectories: &Trajectories, weights: Option<&[f32]>, members: &[usize]) -> Vec<Pose> {
    let stride = members.len().div_ceil(SAMPLED).max(1);
    let sampled: Vec<usize> = members.iter().copied().step_by(stride).collect();
    let own: Option<Vec<f32>> = weights.map(|w| sampled.iter().map(|&i| w[i]).collect());
    SharedMotion::fit(&trajectories.select(&sampled), own.as_deref(), PoseKind::Rigid).poses
}

/// A group of particles and the rigid motion fitted to it.
struct Moving {
    members: Vec<usize>,
    poses: Vec<Pose>,
}

/// Motions of the groups, without stray ones, and one for groups that move as one body.
///
/// Groups are one body if a motion fitted to both explains each about as well as its own. The motion of one
/// alone would not do: it is only as good as the group is wide, and says little about parts farther away.
fn distinct(
    trajectories: &Trajectories,
    weights: Option<&[f32]>,
    mut groups: Vec<Vec<usize>>,
) -> Vec<Vec<Pose>> {
    groups.sort_by_key(|members| (std::cmp::Reverse(members.len()), members.first().copied()));
    let all: usize = groups.iter().map(Vec::len).sum();
    let mut kept: Vec<Moving> = Vec::new();
    for members in groups {
        let poses = motion_of(trajectories, weights, &members);
        let own = median_residual(trajectories, &members, Some(&poses));
        if own > UNEXPLAINED * median_residual(trajectories, &members, None) && members.len() * FEW < all {
            continue;
        }
        let group = Moving { members, poses };
        let joined = kept
            .iter()
            .enumerate()
            .find_map(|(i, other)| joint(trajectories, weights, other, &group).map(|both| (i, both)));
        match joined {
            Some((i, both)) => kept[i] = both,
            None => kept.push(group),
        }
    }
    kept.into_iter().map(|group| group.poses).collect()
}

/// Two groups as one, if one motion explains both.
fn joint(trajectories: &Trajectories, weights: Option<&[f32]>, a: &Moving, b: &Moving) -> Option<Moving> {
    // Equally many of each decide, so that the larger group does not outvote the smaller one.
    let share = |members: &[usize]| {
        members.iter().copied().step_by(members.len().div_ceil(SAMPLED / 2).max(1)).collect::<Vec<_>>()
    };
    let mut sampled = share(&a.members);
    sampled.extend(share(&b.members));
    let poses = motion_of(trajectories, weights, &sampled);
    let is_explained = |group: &Moving| {
        let own = median_residual(trajectories, &group.members, Some(&group.poses));
        let rest = median_residual(trajectories, &group.members, None);
        median_residual(trajectories, &group.members, Some(&poses)) <= ALIKE * own + ALIKE_FLOOR * rest
    };
    if !is_explained(a) || !is_explained(b) {
        return None;
    }
    let members = [a.members.as_slice(), &b.members].concat();
    Some(Moving { members, poses })
}

fn median_residual(trajectories: &Trajectories, members: &[usize], poses: Option<&[Pose]>) -> f64 {
    let stride = members.len().div_ceil(SAMPLED).max(1);
    let mut residuals: Vec<f64> =
        members.iter().step_by(stride).map(|&i| residual(trajectories, i, poses)).collect();
    residuals.sort_by(f64::total_cmp);
    residuals.get(residuals.len() / 2).copied().unwrap_or(0.0)
}

/// Connected components of particles that no motion explains.
fn grouped(trajectories: &Trajectories, left: &[usize], config: &PartitionConfig) -> Vec<Vec<usize>> {
    let paths: Vec<Vec<V3>> = (0..trajectories.len())
        .map(|i| {
            if left.binary_search(&i).is_ok() {
                (0..trajectories.times.len()).map(|s| trajectories.at(s, i)).collect()
            } else {
                Vec::new()
            }
        })
        .collect();
    let component = components(trajectories, &paths, left, f64::from(config.length_slack), config);
    let mut groups: std::collections::BTreeMap<usize, Vec<usize>> = std::collections::BTreeMap::new();
    for (&i, c) in left.iter().zip(component) {
        groups.entry(c).or_default().push(i);
    }
    groups.into_values().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two blocks that slide apart, on a floor that wobbles a little beside them; the graph is told to have
    /// joined some of the floor.
    fn scene() -> (Trajectories, Vec<i32>, Vec<i32>) {
        let times: Vec<f32> = (0..40).map(|i| 0.02 * i as f32).collect();
        let mut truth = Vec::new();
        let mut starts = Vec::new();
        for i in 0..360 {
            let (x, y, z) = ((i % 10) as f32 * 0.1, (i / 10 % 6) as f32 * 0.1, (i / 60 % 2) as f32 * 0.1);
            let object = i / 120 - 1;
            truth.push(object);
            starts.push([x, y + 0.8 * object as f32, z]);
        }
        let positions = times
            .iter()
            .map(|&t| {
                let moved = starts.iter().zip(&truth).enumerate().map(|(i, (p, object))| match object {
                    0 => [p[0] + t, p[1], p[2]],
                    1 => [p[0], p[1] - 0.5 * t, p[2] + t * t],
                    _ => [p[0], p[1], p[2] + 0.03 * (9.0 * t + i as f32).sin()],
                });
                moved.collect()
            })
            .collect();
        // Everything was found to move, a third of the floor with the first block.
        let given = truth
            .iter()
            .enumerate()
            .map(|(i, &o)| if o < 0 { if i % 3 == 0 { 0 } else { 2 } } else { o })
            .collect();
        (Trajectories { times, positions }, truth, given)
    }

    #[test]
    fn particles_go_to_the_motion_that_explains_them_or_to_rest() {
        let (trajectories, truth, given) = scene();
        let partition = Partition { object: given, objects: 3 };
        let found = regroup(&trajectories, None, partition, &PartitionConfig::default()).expect("regroup");
        assert_eq!(found.objects, 2);
        let floor = found.object.iter().zip(&truth).filter(|(_, t)| **t < 0);
        assert!(floor.clone().all(|(f, _)| *f < 0), "{:?}", floor.map(|(f, _)| *f).collect::<Vec<_>>());
        for object in [0, 1] {
            let labels: Vec<i32> =
                found.object.iter().zip(&truth).filter(|(_, t)| **t == object).map(|(f, _)| *f).collect();
            assert!(labels[0] >= 0 && labels.iter().all(|l| *l == labels[0]), "{labels:?}");
        }
    }

    #[test]
    fn pieces_of_one_body_are_joined_again() {
        let (trajectories, truth, _) = scene();
        let split =
            truth.iter().enumerate().map(|(i, &o)| if o == 0 && i % 2 == 0 { 2 } else { o }).collect();
        let found = regroup(
            &trajectories,
            None,
            Partition { object: split, objects: 3 },
            &PartitionConfig::default(),
        )
        .expect("regroup");
        assert_eq!(found.objects, 2);
    }
}
