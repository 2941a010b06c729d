//! Groups of particles that share a rigid motion.

use super::partition::largest_first;
use crate::motion::pose::{Pose, PoseKind};
use crate::motion::procrustes::fit_shared_motion;
use crate::thresholds::{
    MERGED_RESIDUAL, OUTLIER_SHARE, RESIDUAL_TOLERANCE, SAMPLE_SIZE, UNEXPLAINED_FRACTION,
};
use crate::trajectories::Trajectories;
use glam::DVec3;
use lgs_core::median;

/// The motion, of several, that explains a particle's path best, and its residual as a part of the residual
/// at rest; none if rest is better.
pub(crate) fn nearest_motion(
    trajectories: &Trajectories,
    particle: usize,
    motions: &[Vec<Pose>],
) -> Option<(usize, f64)> {
    let rest = path_residual(trajectories, particle, None);
    let residuals = motions.iter().map(|poses| path_residual(trajectories, particle, Some(poses)));
    let (object, best) = residuals.enumerate().min_by(|a, b| a.1.total_cmp(&b.1))?;
    (best < rest).then(|| (object, best / rest))
}

/// Median over the members of the residual that the nearest motion leaves, as a part of the residual at rest;
/// 1 where rest is nearer than any motion.
pub(crate) fn median_fraction_left(
    trajectories: &Trajectories,
    members: &[usize],
    motions: &[Vec<Pose>],
) -> f64 {
    median_over(members, |i| nearest_motion(trajectories, i, motions).map_or(1.0, |(_, part)| part))
        .unwrap_or(1.0)
}

/// The rigid motion of most of a group's members, one pose per sample.
pub(crate) fn motion_of(trajectories: &Trajectories, members: &[usize]) -> Vec<Pose> {
    let sampled: Vec<usize> = sampled(members, SAMPLE_SIZE).collect();
    fit_shared_motion(&trajectories.select(&sampled), PoseKind::Rigid).poses
}

/// Motions of the groups, without outliers, and one for groups that move as one body.
///
/// Groups are one body if a motion fitted to both explains each about as well as its own. The motion of one
/// alone would not do: it is only as good as the group is wide, and says little about parts farther away.
pub(crate) fn distinct_motions(trajectories: &Trajectories, mut groups: Vec<Vec<usize>>) -> Vec<Vec<Pose>> {
    largest_first(&mut groups);
    let all: usize = groups.iter().map(Vec::len).sum();
    let mut kept: Vec<RigidGroup> = Vec::new();
    for members in groups {
        let group = RigidGroup { poses: motion_of(trajectories, &members), members };
        let (own, rest) = group.residuals(trajectories);
        if own > UNEXPLAINED_FRACTION * rest && group.members.len() * OUTLIER_SHARE < all {
            continue;
        }
        let merged = kept
            .iter()
            .enumerate()
            .find_map(|(i, other)| other.merged(&group, trajectories).map(|both| (i, both)));
        match merged {
            Some((i, both)) => kept[i] = both,
            None => kept.push(group),
        }
    }
    kept.into_iter().map(|group| group.poses).collect()
}

/// A group of particles and the rigid motion fitted to it.
struct RigidGroup {
    members: Vec<usize>,
    poses: Vec<Pose>,
}

impl RigidGroup {
    /// Median residuals of the members, with the group's motion and at rest.
    fn residuals(&self, trajectories: &Trajectories) -> (f64, f64) {
        (
            median_residual(trajectories, &self.members, Some(&self.poses)),
            median_residual(trajectories, &self.members, None),
        )
    }

    /// Two groups as one, if one motion explains both.
    fn merged(&self, other: &Self, trajectories: &Trajectories) -> Option<Self> {
        // Equally many of each decide, so that the larger group does not outvote the smaller one.
        let both = sampled(&self.members, SAMPLE_SIZE / 2).chain(sampled(&other.members, SAMPLE_SIZE / 2));
        let poses = motion_of(trajectories, &both.collect::<Vec<_>>());
        let is_explained = |group: &Self| {
            let (own, rest) = group.residuals(trajectories);
            explains(median_residual(trajectories, &group.members, Some(&poses)), [own, rest])
        };
        if !is_explained(self) || !is_explained(other) {
            return None;
        }
        let members = [self.members.as_slice(), &other.members].concat();
        Some(Self { members, poses })
    }
}

/// Mean residual over a sample of a group's members: unlike the median it counts a part that a robust motion
/// leaves out.
pub(super) fn mean_residual(trajectories: &Trajectories, members: &[usize], poses: Option<&[Pose]>) -> f64 {
    let residuals = sampled(members, SAMPLE_SIZE).map(|i| path_residual(trajectories, i, poses));
    let (sum, count) = residuals.fold((0.0, 0.0), |(sum, count), residual| (sum + residual, count + 1.0));
    sum / f64::max(count, 1.0)
}

/// Whether a motion that leaves `joint` of a group's paths explains it about as well as the group's own
/// motion, given with what rest leaves.
pub(super) fn explains(joint: f64, [own, rest]: [f64; 2]) -> bool {
    joint <= MERGED_RESIDUAL * own + RESIDUAL_TOLERANCE * rest
}

/// Up to about `count` members, evenly spread over the list.
pub(super) fn sampled(members: &[usize], count: usize) -> impl Iterator<Item = usize> {
    members.iter().copied().step_by(members.len().div_ceil(count).max(1))
}

/// Median residual over a group's members.
pub(super) fn median_residual(trajectories: &Trajectories, members: &[usize], poses: Option<&[Pose]>) -> f64 {
    median_over(members, |i| path_residual(trajectories, i, poses)).unwrap_or(0.0)
}

/// Median of a figure over a sample of a group's members; none for an empty group.
fn median_over(members: &[usize], figure: impl Fn(usize) -> f64) -> Option<f64> {
    median(sampled(members, SAMPLE_SIZE).map(figure))
}

/// Root mean square distance of a particle's path from its best place in a motion; without a motion, from its
/// mean.
pub(super) fn path_residual(trajectories: &Trajectories, particle: usize, poses: Option<&[Pose]>) -> f64 {
    let samples = trajectories.times.len();
    let part = 1.0 / samples as f64;
    // Rotations keep distances, so residuals can be taken in the body's axes.
    let place = |s: usize| {
        let x = trajectories.at(s, particle);
        poses.map_or(x, |poses| poses[s].linear.transpose() * (x - poses[s].shift))
    };
    let mean: DVec3 = part * (0..samples).map(place).sum::<DVec3>();
    ((0..samples).map(|s| place(s).distance_squared(mean)).sum::<f64>() * part).sqrt()
}
