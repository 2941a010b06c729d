//! Extreme points of a hull.

use crate::thresholds::DIRECTIONS;
use glam::DVec3;

/// The points that lie farthest in some direction, in their order: corners of the hull, at most as many as
/// there are directions spread evenly over the sphere (about 5° apart).
#[must_use]
pub fn extreme_points(points: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let mut found: Vec<usize> = (0..DIRECTIONS).filter_map(|k| farthest(points, direction(k))).collect();
    found.sort_unstable();
    found.dedup();
    found.into_iter().map(|index| points[index]).collect()
}

/// Direction `k` of a spiral over the sphere.
fn direction(k: usize) -> DVec3 {
    let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    let z = 1.0 - (2 * k + 1) as f64 / DIRECTIONS as f64;
    let (sine, cosine) = (golden * k as f64).sin_cos();
    let radius = (1.0 - z * z).sqrt();
    DVec3::new(radius * cosine, radius * sine, z)
}

fn farthest(points: &[[f64; 3]], direction: DVec3) -> Option<usize> {
    let along = |index: &usize| direction.dot(DVec3::from(points[*index]));
    (0..points.len()).max_by(|a, b| along(a).total_cmp(&along(b)))
}
