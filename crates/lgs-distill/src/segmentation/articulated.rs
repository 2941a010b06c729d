//! Groups of two rigid bodies that hang together: where no rigid motion explains a group, two may.
//!
//! Neighbours across a joint move alike, so the graph does not part them. Rigid motions of small
//! neighbourhoods do: the two of them that explain the group best are the first motions, and each particle
//! goes to the one that explains its path better, until that settles.

use super::deforming::is_one_deforming;
use super::rigid_groups::{mean_residual, median_residual, motion_of, path_residual, sampled};
use crate::motion::pose::Pose;
use crate::thresholds::{
    NEIGHBORHOOD_SHARE, NEIGHBORHOODS, PARTED_RESIDUAL, RESIDUAL_TOLERANCE, SAMPLE_SIZE, SETTLING_ROUNDS,
};
use crate::trajectories::Trajectories;
use rayon::prelude::*;

/// The groups with those parted that are two bodies.
pub(super) fn part_groups(
    trajectories: &Trajectories,
    groups: Vec<Vec<usize>>,
    smallest: usize,
) -> Vec<Vec<usize>> {
    let part = |members: Vec<usize>| {
        two_bodies(trajectories, &members, smallest).map_or_else(|| vec![members], |two| two.to_vec())
    };
    groups.into_iter().flat_map(part).collect()
}

/// The two bodies that a group consists of, if it is no single one.
fn two_bodies(trajectories: &Trajectories, members: &[usize], smallest: usize) -> Option<[Vec<usize>; 2]> {
    let whole = motion_of(trajectories, members);
    let [own, rest] = [Some(whole.as_slice()), None].map(|poses| mean_residual(trajectories, members, poses));
    if members.len() < 2 * smallest.max(NEIGHBORHOODS) || own <= RESIDUAL_TOLERANCE * rest {
        return None;
    }
    let mut motions = first_motions(trajectories, members)?;
    let mut parts = nearer(trajectories, members, &motions);
    for _ in 0..SETTLING_ROUNDS {
        if parts.iter().any(|part| part.len() < smallest.max(1)) {
            return None;
        }
        motions = [0, 1].map(|i| motion_of(trajectories, &parts[i]));
        parts = nearer(trajectories, members, &motions);
    }
    let left = [0, 1].map(|i| median_residual(trajectories, &parts[i], Some(&motions[i])));
    tracing::debug!(own, ?left, sizes = ?parts.each_ref().map(Vec::len), "two bodies that hang together?");
    let are_large = parts.iter().all(|part| part.len() >= smallest.max(1));
    let are_parted = left.iter().all(|left| *left <= PARTED_RESIDUAL * own);
    (are_large && are_parted && !is_one_deforming(trajectories, [&parts[0], &parts[1]])).then_some(parts)
}

/// The rigid motions of two neighbourhoods by which the least is left of a sample of the members' paths.
fn first_motions(trajectories: &Trajectories, members: &[usize]) -> Option<[Vec<Pose>; 2]> {
    let chosen: Vec<usize> = sampled(members, SAMPLE_SIZE).collect();
    let starts: Vec<[f32; 3]> = chosen.iter().map(|&i| trajectories.positions[0][i]).collect();
    let size = (chosen.len() / NEIGHBORHOOD_SHARE).max(4);
    let (near, row) = lgs_core::k_nearest(&starts, size);
    let seeds: Vec<usize> = sampled(&(0..chosen.len()).collect::<Vec<_>>(), NEIGHBORHOODS).collect();
    let motion = |&seed: &usize| {
        let around = near[seed * row..(seed + 1) * row].iter().map(|&at| chosen[at as usize]);
        motion_of(trajectories, &around.chain([chosen[seed]]).collect::<Vec<_>>())
    };
    let motions: Vec<Vec<Pose>> = seeds.par_iter().map(motion).collect();
    let residuals: Vec<Vec<f64>> = motions
        .par_iter()
        .map(|motion| chosen.iter().map(|&i| path_residual(trajectories, i, Some(motion))).collect())
        .collect();
    let left =
        |a: usize, b: usize| residuals[a].iter().zip(&residuals[b]).map(|(a, b)| a.min(*b)).sum::<f64>();
    let pairs = (0..motions.len()).flat_map(|a| (a + 1..motions.len()).map(move |b| (a, b)));
    let (a, b) = pairs.min_by(|&(a, b), &(c, d)| left(a, b).total_cmp(&left(c, d)))?;
    Some([motions[a].clone(), motions[b].clone()])
}

/// The members that each of two motions explains better.
fn nearer(trajectories: &Trajectories, members: &[usize], motions: &[Vec<Pose>; 2]) -> [Vec<usize>; 2] {
    let is_second = |&i: &usize| {
        let [first, second] = [0, 1].map(|m| path_residual(trajectories, i, Some(&motions[m])));
        second < first
    };
    let sides: Vec<bool> = members.par_iter().map(is_second).collect();
    [false, true].map(|side| {
        members.iter().zip(&sides).filter(|(_, own)| **own == side).map(|(&member, _)| member).collect()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DQuat, DVec3};

    /// A rod whose halves turn about the y axis by two functions of time: the first about its end, the second
    /// about the end of the first.
    fn rod(angles: impl Fn(f64) -> [f64; 2]) -> Trajectories {
        let at = |i: usize| DVec3::new(0.05 * (i / 9) as f64, 0.1 * (i / 3 % 3) as f64, 0.1 * (i % 3) as f64);
        let times: Vec<f32> = (0..40).map(|s| s as f32 / 40.0).collect();
        let sample = |t: &f32| {
            let [a, b] = angles(f64::from(*t)).map(DQuat::from_rotation_y);
            let joint = DVec3::X;
            let place = |i: usize| {
                let p = at(i);
                if p.x < 1.0 { a * p } else { a * joint + b * (p - joint) }
            };
            (0..360).map(|i| place(i).as_vec3().to_array()).collect()
        };
        let positions = times.iter().map(sample).collect();
        Trajectories::unweighted(times, positions)
    }

    #[test]
    fn a_rod_that_bends_at_a_joint_is_two_bodies() {
        let trajectories = rod(|t| [(3.0 * t).sin(), 1.2 * (5.0 * t).sin()]);
        let parted = part_groups(&trajectories, vec![(0..360).collect()], 8);
        assert_eq!(parted.len(), 2);
        // Particles on the axis of the joint move with both.
        for part in &parted {
            let upper = part.iter().filter(|&&i| i < 180).count();
            assert!(upper.min(part.len() - upper) <= 9, "{upper} of {}", part.len());
        }
    }

    #[test]
    fn a_stiff_rod_is_one_body() {
        let trajectories = rod(|t| [(3.0 * t).sin(); 2]);
        assert_eq!(part_groups(&trajectories, vec![(0..360).collect()], 8).len(), 1);
    }
}
