//! Static particles and objects: which particles move, and which of them move together.

mod articulated;
mod deforming;
mod first_groups;
mod graph;
mod k_means;
pub(crate) mod partition;
pub(crate) mod regroup;
mod rigid_groups;

pub use first_groups::partition;

use crate::config::PartitionConfig;
use crate::error::DistillError;
use crate::trajectories::{Trajectories, same_length};
use partition::Partition;

/// The static particles and the objects of a scene, regrouped by the objects' motions.
///
/// # Errors
/// If the trajectories are malformed.
pub fn find_objects(
    trajectories: &Trajectories,
    config: &PartitionConfig,
) -> Result<Partition, DistillError> {
    regroup::regroup(trajectories, first_groups::partition(trajectories, config)?, config)
}

/// The same beside things that are known: `things` has the number of the thing that each particle belongs to,
/// from 1, and 0 for the others, among which objects are looked for; if it is empty, nothing is known.
///
/// # Errors
/// If the trajectories are malformed, or `things` is not empty and has another length.
pub fn find_objects_beside(
    things: &[u32],
    trajectories: &Trajectories,
    config: &PartitionConfig,
) -> Result<Partition, DistillError> {
    if things.iter().all(|&thing| thing == 0) {
        return find_objects(trajectories, config);
    }
    same_length("things", trajectories.len(), things.len())?;
    let of_thing = |number: u32| (0..things.len()).filter(|&i| things[i] == number).collect::<Vec<usize>>();
    let others = of_thing(0);
    let found = find_objects(&trajectories.select(&others), config)?;
    let members = |object: usize| found.members(object).into_iter().map(|i| others[i]).collect();
    let known = (1..=things.iter().copied().max().unwrap_or(0)).map(of_thing).filter(|own| !own.is_empty());
    Ok(Partition::of_groups((0..found.objects).map(members).chain(known).collect(), things.len()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A block at rest and one that moves, with two particles beside it that move otherwise.
    fn scene() -> Trajectories {
        let times: Vec<f32> = (0..30).map(|i| 0.02 * i as f32).collect();
        let place = |i: usize, t: f32| {
            let [x, y, z] = [i % 5, i / 5 % 4, i / 20 % 4].map(|c| 0.1 * c as f32);
            match i / 80 {
                0 => [x, y, z],
                1 => [x + 2.0 + t, y, z],
                _ => [2.0 + t, y + 0.5 + 2.0 * t, z],
            }
        };
        let positions = times.iter().map(|&t| (0..162).map(|i| place(i, t)).collect()).collect();
        Trajectories::unweighted(times, positions)
    }

    #[test]
    fn known_things_are_objects_however_small_and_leave_the_others_as_they_are() {
        let (trajectories, config) = (scene(), PartitionConfig::default());
        let mut things = vec![0; 162];
        things[160..].fill(1);
        let found = find_objects_beside(&things, &trajectories, &config).expect("objects");
        assert_eq!((found.objects, found.members(1)), (2, vec![160, 161]));
        assert_eq!(found.members(0), (80..160).collect::<Vec<_>>());
        let unknown = find_objects_beside(&[], &trajectories, &config).expect("objects");
        assert_eq!(unknown, find_objects(&trajectories, &config).expect("objects"));
        assert!(find_objects_beside(&[1], &trajectories, &config).is_err());
    }
}
