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
use crate::trajectories::Trajectories;
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
