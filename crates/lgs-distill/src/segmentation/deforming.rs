//! Bodies that deform: groups that touch, and whose paths one affine motion explains.
//!
//! Rigid motions part a body that bends or stretches into pieces. An affine motion has as many unknowns as
//! two rigid ones, so where it explains each of two pieces about as well as the piece's own rigid motion
//! does, the pieces are one body. Particles that no rigid piece has room for then join the body whose affine
//! motion explains them.

use super::rigid_groups::{explains, median_residual, motion_of, path_residual, sampled};
use crate::motion::pose::{Pose, PoseKind};
use crate::motion::procrustes::fit_shared_motion;
use crate::thresholds::{JOINING_ROUNDS, PARTED_RESIDUAL, RESIDUAL_TOLERANCE, SAMPLE_SIZE};
use crate::trajectories::Trajectories;
use glam::{DMat3, DVec3};
use lgs_core::geometry::inverse;
use lgs_core::median;
use rayon::prelude::*;

/// A group of particles with the residuals that its own motion and rest leave of their paths.
struct Piece {
    members: Vec<usize>,
    /// Median residuals of the members, with the group's motion and at rest.
    left: [f64; 2],
}

/// The groups with those that are pieces of one deforming body put together.
pub(super) fn merge_pieces(
    trajectories: &Trajectories,
    groups: Vec<Vec<usize>>,
    neighbors: usize,
) -> Vec<Vec<usize>> {
    let mut pieces: Vec<Piece> = groups.into_iter().map(|group| piece(trajectories, group)).collect();
    while let Some((a, b, both)) = first_pair(trajectories, &pieces, neighbors) {
        pieces[a] = both;
        pieces.remove(b);
    }
    pieces.into_iter().map(|piece| piece.members).collect()
}

/// The groups with the particles of none that a deforming group's affine motion explains: it leaves at most
/// the part `tolerance` of what rest leaves. The motions are fitted anew until no particle joins.
pub(super) fn take_in(
    trajectories: &Trajectories,
    mut groups: Vec<Vec<usize>>,
    mut loose: Vec<usize>,
    tolerance: f64,
) -> Vec<Vec<usize>> {
    for _ in 0..JOINING_ROUNDS {
        let motions: Vec<_> = groups.iter().map(|members| deformation(trajectories, members)).collect();
        let motions: Vec<_> =
            motions.iter().map(|poses| poses.as_deref().and_then(AffineMotion::new)).collect();
        let nearest = |&i: &usize| {
            let left =
                motions.iter().map(|m| m.as_ref().map_or(f64::INFINITY, |m| m.residual(trajectories, i)));
            let (group, best) = left.enumerate().min_by(|a, b| a.1.total_cmp(&b.1))?;
            (best <= tolerance * path_residual(trajectories, i, None)).then_some(group)
        };
        let chosen: Vec<Option<usize>> = loose.par_iter().map(nearest).collect();
        tracing::debug!(loose = loose.len(), joining = chosen.iter().flatten().count(), "deforming bodies");
        if chosen.iter().all(Option::is_none) {
            break;
        }
        chosen.iter().zip(&loose).for_each(|(group, &i)| group.iter().for_each(|&g| groups[g].push(i)));
        loose = chosen.iter().zip(loose).filter(|(group, _)| group.is_none()).map(|(_, i)| i).collect();
    }
    groups.iter_mut().for_each(|members| members.sort_unstable());
    groups
}

/// Whether a group is no rigid body but a deforming one.
pub(super) fn is_deforming(trajectories: &Trajectories, members: &[usize]) -> bool {
    deformation(trajectories, members).is_some()
}

/// The affine motion of a group that is no rigid body but a deforming one.
fn deformation(trajectories: &Trajectories, members: &[usize]) -> Option<Vec<Pose>> {
    let [own, rest] = piece(trajectories, members.to_vec()).left;
    if own <= RESIDUAL_TOLERANCE * rest {
        return None;
    }
    let poses = affine_motion_of(trajectories, &sampled(members, SAMPLE_SIZE).collect::<Vec<_>>());
    let left = AffineMotion::new(&poses)?.median_residual(trajectories, members);
    (left <= PARTED_RESIDUAL * own).then_some(poses)
}

/// The affine motion of most of the chosen particles, one pose per sample.
fn affine_motion_of(trajectories: &Trajectories, chosen: &[usize]) -> Vec<Pose> {
    fit_shared_motion(&trajectories.select(chosen), PoseKind::Affine).poses
}

/// Whether two groups are pieces of one deforming body.
pub(super) fn is_one_deforming(trajectories: &Trajectories, groups: [&[usize]; 2]) -> bool {
    let [a, b] = groups.map(|members| piece(trajectories, members.to_vec()));
    together(trajectories, &a, &b).is_some()
}

/// A group by its own rigid motion.
fn piece(trajectories: &Trajectories, members: Vec<usize>) -> Piece {
    let poses = motion_of(trajectories, &members);
    let left = [Some(poses.as_slice()), None].map(|p| median_residual(trajectories, &members, p));
    Piece { members, left }
}

/// The first two pieces, by their order, that touch and are parts of one body, and that body.
fn first_pair(
    trajectories: &Trajectories,
    pieces: &[Piece],
    neighbors: usize,
) -> Option<(usize, usize, Piece)> {
    let touching = touching(trajectories, pieces, neighbors);
    touching.into_iter().find_map(|(a, b)| Some((a, b, together(trajectories, &pieces[a], &pieces[b])?)))
}

/// Pairs of pieces of which a particle is among the nearest neighbours of a particle of the other at the
/// first sample, in order.
fn touching(trajectories: &Trajectories, pieces: &[Piece], neighbors: usize) -> Vec<(usize, usize)> {
    let (mut starts, mut owners) = (Vec::new(), Vec::new());
    for (own, piece) in pieces.iter().enumerate() {
        starts.extend(piece.members.iter().map(|&i| trajectories.positions[0][i]));
        owners.extend(std::iter::repeat_n(own, piece.members.len()));
    }
    let (near, row) = lgs_core::k_nearest(&starts, neighbors);
    let mut pairs = std::collections::BTreeSet::new();
    for (row, &own) in near.chunks_exact(row.max(1)).zip(&owners) {
        for &other in row {
            let other = owners[other as usize];
            if other != own {
                pairs.insert((own.min(other), own.max(other)));
            }
        }
    }
    pairs.into_iter().collect()
}

/// Two pieces as one body, if an affine motion explains both.
fn together(trajectories: &Trajectories, a: &Piece, b: &Piece) -> Option<Piece> {
    // Equally many of each decide, so that the larger piece does not outvote the smaller one.
    let half = |piece: &Piece| sampled(&piece.members, SAMPLE_SIZE / 2).collect::<Vec<_>>();
    let chosen = [half(a), half(b)].concat();
    let poses = affine_motion_of(trajectories, &chosen);
    let motion = AffineMotion::new(&poses)?;
    let joint = [a, b].map(|piece| motion.median_residual(trajectories, &piece.members));
    tracing::debug!(?joint, a = ?a.left, b = ?b.left, "one deforming body?");
    if !explains(joint[0], a.left) || !explains(joint[1], b.left) {
        return None;
    }
    let members = [a.members.as_slice(), &b.members].concat();
    let left =
        [motion.median_residual(trajectories, &members), median_residual(trajectories, &members, None)];
    Some(Piece { members, left })
}

/// Affine poses with what the best place of a particle in them takes.
struct AffineMotion<'a> {
    poses: &'a [Pose],
    inverse_gram: DMat3,
}

impl<'a> AffineMotion<'a> {
    fn new(poses: &'a [Pose]) -> Option<Self> {
        let gram: DMat3 = poses.iter().map(|pose| pose.linear.transpose() * pose.linear).sum();
        Some(Self { poses, inverse_gram: inverse(&gram)? })
    }

    /// Root mean square distance of a particle's path from that of its best place in the motion.
    fn residual(&self, trajectories: &Trajectories, particle: usize) -> f64 {
        let seen = || self.poses.iter().enumerate().map(|(s, pose)| (pose, trajectories.at(s, particle)));
        let place: DVec3 =
            self.inverse_gram * seen().map(|(p, x)| p.linear.transpose() * (x - p.shift)).sum::<DVec3>();
        let squares = seen().map(|(pose, x)| pose.apply(place).distance_squared(x));
        (squares.sum::<f64>() / self.poses.len() as f64).sqrt()
    }

    /// Median of [`AffineMotion::residual`] over a sample of the members.
    fn median_residual(&self, trajectories: &Trajectories, members: &[usize]) -> f64 {
        median(sampled(members, SAMPLE_SIZE).map(|i| self.residual(trajectories, i))).unwrap_or(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A bar of two halves along x, whose points are moved by a function of time, half and place.
    fn bar(motion: impl Fn(f64, usize, DVec3) -> DVec3) -> (Trajectories, Vec<Vec<usize>>) {
        let at = |i: usize| DVec3::new((i / 9) as f64, (i / 3 % 3) as f64, (i % 3) as f64) * 0.1;
        let times: Vec<f32> = (0..30).map(|s| s as f32 / 30.0).collect();
        let half = |i: usize| usize::from(i >= 54);
        let sample =
            |t: &f32| (0..108).map(|i| motion(f64::from(*t), half(i), at(i)).as_vec3().to_array()).collect();
        let positions = times.iter().map(sample).collect();
        (Trajectories::unweighted(times, positions), vec![(0..54).collect(), (54..108).collect()])
    }

    #[test]
    fn a_bar_that_stretches_is_one_body() {
        let stretch = |t: f64, _, p: DVec3| p * DVec3::new(1.0 + 0.3 * (6.0 * t).sin(), 1.0, 1.0);
        let (trajectories, halves) = bar(stretch);
        assert_eq!(merge_pieces(&trajectories, halves, 8).len(), 1);
    }

    #[test]
    fn a_deforming_body_takes_in_its_particles_and_no_others() {
        let stretch = |t: f64, half: usize, p: DVec3| match half {
            0 => p * DVec3::new(1.0 + 0.3 * (6.0 * t).sin(), 1.0, 1.0),
            _ => p + DVec3::Z * t * t,
        };
        let (trajectories, halves) = bar(stretch);
        let (group, loose) = halves[0].split_at(36);
        let loose = [loose, &halves[1]].concat();
        assert_eq!(take_in(&trajectories, vec![group.to_vec()], loose, 0.25), [halves[0].clone()]);
    }

    #[test]
    fn bodies_that_touch_and_turn_against_each_other_stay_two() {
        let turn = |t: f64, half: usize, p: DVec3| {
            let center = DVec3::new(if half == 0 { 0.25 } else { 0.85 }, 0.1, 0.1);
            let angle = if half == 0 { 3.0 * t } else { -2.0 * t };
            center + glam::DQuat::from_rotation_x(angle) * (p - center) + DVec3::Y * (t * half as f64)
        };
        let (trajectories, halves) = bar(turn);
        assert_eq!(merge_pieces(&trajectories, halves, 8).len(), 2);
    }
}
