//! Whether a body slides on a plane at rest. Dry friction needs a surface, and of a body that slows down
//! along a straight line nothing else tells whether it will stay where it stops or come back.

use super::contact::{Surroundings, grounds, surface};
use super::observed::ObservedPoses;
use crate::motion::shared_motion::SharedMotion;
use crate::thresholds::{NEAR, ON_PLANE};
use glam::DVec3;
use lgs_mechanics::contact::Contact;

/// Whether the lowest point of a body keeps its height over one of the planes near its path, and lies on it.
pub(super) fn slides(
    observed: &ObservedPoses,
    motion: &SharedMotion,
    surroundings: Surroundings<'_>,
) -> bool {
    if surroundings.at_rest.is_empty() {
        return false;
    }
    let path: Vec<DVec3> = observed.poses.iter().map(|pose| pose.shift).collect();
    let surface = surface(motion, &observed.poses[0], &observed.track.x[0]);
    let extent = surface.extent();
    let carries = |plane| {
        let contact = Contact::of(plane, &surface, 0.0);
        let gaps: Vec<f64> = observed.track.x.iter().map(|x| contact.gap(x)).collect();
        let mean = gaps.iter().sum::<f64>() / gaps.len() as f64;
        let variance = gaps.iter().map(|gap| (gap - mean).powi(2)).sum::<f64>() / gaps.len() as f64;
        mean.abs() <= ON_PLANE * extent && variance.sqrt() <= NEAR * extent
    };
    grounds(surroundings, &path, extent).into_iter().any(|ground| carries(ground.plane))
}
