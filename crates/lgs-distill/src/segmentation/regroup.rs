//! Refines a partition by the objects' own motions.
//!
//! The graph of neighbours joins an object to whatever wobbles beside it, and to a body that hangs on it, and
//! parts one body into pieces that do not touch. Here groups of two bodies are parted, every object's rigid
//! motion is fitted robustly, objects that move alike are merged, and each moving particle goes to the motion
//! that explains its path best, or to rest if that does. Particles that no motion explains are grouped anew
//! among themselves. At last the pieces of bodies that deform are put together, and take in what rests beside
//! them only because no rigid motion explains it; such a body of which no piece is left is one all the same.
//! A scene that is one body with nothing static beside it is left as it is.

use super::articulated::part_groups;
use super::deforming::{is_deforming, merge_pieces, take_in};
use super::graph::components;
use super::partition::Partition;
use super::rigid_groups::{distinct_motions, median_fraction_left, motion_of, nearest_motion};
use crate::config::{PartitionConfig, PartitionMethod};
use crate::error::DistillError;
use crate::motion::pose::Pose;
use crate::thresholds::LEFT_BY_OTHERS_FRACTION;
use crate::trajectories::Trajectories;
use glam::DVec3;
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};

/// The refined partition of the same particles; one by k-means is left as it is.
///
/// # Errors
/// If the trajectories are malformed.
pub(crate) fn regroup(
    trajectories: &Trajectories,
    partition: Partition,
    config: &PartitionConfig,
) -> Result<Partition, DistillError> {
    trajectories.validate()?;
    let moving: Vec<usize> = (0..trajectories.len()).filter(|&i| partition.object[i] >= 0).collect();
    if partition.objects == 0 || config.method == PartitionMethod::KMeans {
        return Ok(partition);
    }
    let regrouping = Regrouping { trajectories, moving: &moving, config };
    let groups: Vec<Vec<usize>> = (0..partition.objects).map(|o| partition.members(o)).collect();
    let first = part_groups(trajectories, groups, config.smallest_object);
    if moving.len() == trajectories.len() {
        let bodies = merge_pieces(trajectories, first.clone(), config.neighbors);
        if bodies.len() == 1 {
            return Ok(Partition::of_groups(bodies, trajectories.len()));
        }
    }
    let mut groups = first.clone();
    for round in 0..config.regroup_rounds {
        // The last round leaves no particle unexplained: each takes its nearest motion, or rests.
        let tolerance = if round + 1 == config.regroup_rounds {
            f64::INFINITY
        } else {
            f64::from(config.displacement_tolerance)
        };
        groups = regrouping.round(groups, tolerance);
    }
    let groups = merge_pieces(trajectories, groups, config.neighbors);
    let taken: BTreeSet<usize> = groups.iter().flatten().copied().collect();
    let loose = moving.into_iter().filter(|i| !taken.contains(i)).collect();
    let mut groups = take_in(trajectories, groups, loose, f64::from(config.displacement_tolerance));
    groups.extend(lost_deforming_bodies(trajectories, &first, &groups, config.neighbors));
    Ok(Partition::of_groups(groups, trajectories.len()))
}

/// Deforming bodies put together from pieces, none of whose particles is in a group: no rigid motion explains
/// any particle of a body that deforms as a whole.
fn lost_deforming_bodies(
    trajectories: &Trajectories,
    pieces: &[Vec<usize>],
    groups: &[Vec<usize>],
    neighbors: usize,
) -> Vec<Vec<usize>> {
    let taken: BTreeSet<usize> = groups.iter().flatten().copied().collect();
    let is_lost = |members: &Vec<usize>| members.iter().all(|i| !taken.contains(i));
    if !pieces.iter().any(is_lost) {
        return Vec::new();
    }
    let mut bodies = merge_pieces(trajectories, pieces.to_vec(), neighbors);
    bodies.retain(|body| is_lost(body) && is_deforming(trajectories, body));
    bodies
}

/// What becomes of an object.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Fate {
    Stays,
    /// Particles whose paths the motion of an object that stays explains roughly go to that object.
    LosesParts,
    /// Its particles go to the motion of an object that stays, or to rest, whichever explains their paths
    /// better.
    Goes,
}

/// The partition that the fates of its objects lead to.
pub(crate) fn dissolve(trajectories: &Trajectories, partition: &Partition, fates: &[Fate]) -> Partition {
    let staying: Vec<usize> = (0..partition.objects).filter(|&o| fates[o] == Fate::Stays).collect();
    let motions: Vec<Vec<Pose>> =
        staying.iter().map(|&o| motion_of(trajectories, &partition.members(o))).collect();
    let mut next = partition.clone();
    for (i, own) in next.object.iter_mut().enumerate() {
        let Some(fate) = usize::try_from(*own).ok().map(|o| fates[o]) else { continue };
        let nearest = || nearest_motion(trajectories, i, &motions);
        let taken_by = match fate {
            Fate::Stays => None,
            Fate::LosesParts => nearest().filter(|(_, left)| *left < LEFT_BY_OTHERS_FRACTION),
            Fate::Goes => nearest(),
        };
        if let Some((motion, _)) = taken_by {
            *own = staying[motion] as i32;
        }
    }
    let remain: Vec<bool> = fates.iter().map(|fate| *fate != Fate::Goes).collect();
    next.with_only(&remain)
}

/// The residual that the best motion of others leaves of the paths of some particles, as a part of the
/// residual at rest; the median over the particles.
pub(crate) fn fraction_left_by_others(
    trajectories: &Trajectories,
    members: &[usize],
    others: &[Vec<usize>],
) -> f64 {
    let motions: Vec<Vec<Pose>> = others.iter().map(|members| motion_of(trajectories, members)).collect();
    median_fraction_left(trajectories, members, &motions)
}

/// The particles that are regrouped.
struct Regrouping<'a> {
    trajectories: &'a Trajectories,
    moving: &'a [usize],
    config: &'a PartitionConfig,
}

/// The place of a moving particle after a round.
enum Choice {
    Static,
    Object(usize),
    Unexplained,
}

impl Regrouping<'_> {
    /// One round: fit, merge, assign, and group the particles of which all motions leave more than a part of
    /// the path at rest.
    fn round(&self, groups: Vec<Vec<usize>>, tolerance: f64) -> Vec<Vec<usize>> {
        let motions = distinct_motions(self.trajectories, groups);
        let choose = |&i: &usize| self.choose(i, &motions, tolerance);
        let chosen: Vec<Choice> = self.moving.par_iter().map(choose).collect();
        let mut next = vec![Vec::new(); motions.len()];
        let mut unexplained = Vec::new();
        for (&i, choice) in self.moving.iter().zip(chosen) {
            match choice {
                Choice::Object(o) => next[o].push(i),
                Choice::Unexplained => unexplained.push(i),
                Choice::Static => {}
            }
        }
        next.extend(self.grouped(&unexplained));
        next.retain(|members| members.len() >= self.config.smallest_object.max(1));
        next
    }

    fn choose(&self, particle: usize, motions: &[Vec<Pose>], tolerance: f64) -> Choice {
        if motions.is_empty() && tolerance.is_finite() {
            return Choice::Unexplained;
        }
        match nearest_motion(self.trajectories, particle, motions) {
            None => Choice::Static,
            Some((object, part)) if part <= tolerance => Choice::Object(object),
            Some(_) => Choice::Unexplained,
        }
    }

    /// Connected components of particles that no motion explains.
    fn grouped(&self, unexplained: &[usize]) -> Vec<Vec<usize>> {
        let mut paths: Vec<Vec<DVec3>> = vec![Vec::new(); self.trajectories.len()];
        unexplained.iter().for_each(|&i| paths[i] = self.trajectories.path(i));
        let slack = f64::from(self.config.length_slack);
        let component = components(self.trajectories, &paths, unexplained, slack, self.config);
        let mut groups: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        for (&i, c) in unexplained.iter().zip(component) {
            groups.entry(c).or_default().push(i);
        }
        groups.into_values().collect()
    }
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
        (Trajectories::unweighted(times, positions), truth, given)
    }

    #[test]
    fn particles_go_to_the_motion_that_explains_them_or_to_rest() {
        let (trajectories, truth, given) = scene();
        let partition = Partition { object: given, objects: 3 };
        let found = regroup(&trajectories, partition, &PartitionConfig::default()).expect("regroup");
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
    fn a_deforming_body_in_two_pieces_is_one_object_alone_and_beside_what_rests() {
        let at = |i: usize| [(i % 10) as f32 * 0.1, (i / 10 % 6) as f32 * 0.1, (i / 60 % 4) as f32 * 0.1];
        let stretched = |t: f32, p: [f32; 3]| {
            let [a, b] = [0.4 * (6.0 * t).sin(), 0.4 * (9.0 * t + 1.0).sin()];
            [p[0] * (1.0 + a), p[1] * (1.0 + b) + a * p[0], p[2] * (1.0 - a)]
        };
        let times: Vec<f32> = (0..40).map(|i| 0.02 * i as f32).collect();
        for rests in [0, 120] {
            let place =
                |t: f32, i: usize| if i < 240 { stretched(t, at(i)) } else { [5.0, 0.1 * i as f32, 0.0] };
            let positions = times.iter().map(|&t| (0..240 + rests).map(|i| place(t, i)).collect()).collect();
            let object = (0..240 + rests).map(|i| if i < 240 { i32::from(i % 10 > 5) } else { -1 }).collect();
            let trajectories = Trajectories::unweighted(times.clone(), positions);
            let given = Partition { object, objects: 2 };
            let found = regroup(&trajectories, given, &PartitionConfig::default()).expect("regroup");
            assert_eq!((found.objects, found.members(0).len()), (1, 240), "{rests} at rest");
        }
    }

    #[test]
    fn pieces_of_one_body_are_joined_again() {
        let (trajectories, truth, _) = scene();
        let split =
            truth.iter().enumerate().map(|(i, &o)| if o == 0 && i % 2 == 0 { 2 } else { o }).collect();
        let partition = Partition { object: split, objects: 3 };
        let found = regroup(&trajectories, partition, &PartitionConfig::default()).expect("regroup");
        assert_eq!(found.objects, 2);
    }
}
