//! The surface by which a body touches: extreme points of its hull, or a sphere.

use crate::thresholds::{DIRECTIONS, FEWEST_OF_SPHERE, FINEST_CORNER, MOSTLY, ROUND};
use glam::DVec3;
use lgs_core::geometry::solve_positive;
use lgs_core::{holding, median};
use nalgebra::DMatrix;

/// The surface by which a body touches a plane, from its centre.
#[derive(Clone, Debug, PartialEq)]
pub struct Surface {
    /// Points that may touch, world units.
    pub points: Vec<[f64; 3]>,
    /// Radius of the spheres around the points, world units: 0 for corners.
    pub radius: f64,
}

impl Surface {
    /// The surface of a body with particles at some places from its centre: a sphere around their middle
    /// where all lie equally far from it, or reach equally far in all directions, else the corners of their
    /// hull. Particles that float apart from the body are no part of it.
    #[must_use]
    pub fn of(points: &[[f64; 3]]) -> Self {
        let points = &without_apart(points)[..];
        let middle = middle_of(points);
        let away = |k: usize| Some(DVec3::from(points[farthest(points, direction(k))?]) - middle);
        let along = |k: usize| away(k).map(|away| direction(k).dot(away));
        let reaches: Vec<f64> = (0..DIRECTIONS).filter_map(along).collect();
        let distances: Vec<f64> = points.iter().map(|point| middle.distance(DVec3::from(*point))).collect();
        for lengths in [&distances, &reaches] {
            let (mean, spread) = mean_and_spread(lengths);
            if points.len() >= FEWEST_OF_SPHERE && spread <= ROUND * mean {
                return Self { points: vec![middle.to_array()], radius: mean };
            }
        }
        Self { points: corners(points, FINEST_CORNER * mean_and_spread(&reaches).0), radius: 0.0 }
    }

    /// Largest distance of the surface from the centre.
    #[must_use]
    pub fn extent(&self) -> f64 {
        let length = |point: &[f64; 3]| DVec3::from(*point).length();
        self.points.iter().map(length).fold(0.0, f64::max) + self.radius
    }
}

/// The points without the few that float apart from most of them: beyond a gap as wide as the distance from
/// the middle within which these lie.
fn without_apart(points: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let middle = std::array::from_fn(|i| median(points.iter().map(|point| point[i])).unwrap_or_default());
    let distance = |point: &[f64; 3]| DVec3::from_array(middle).distance(DVec3::from(*point));
    let mut distances: Vec<f64> = points.iter().map(distance).collect();
    distances.sort_by(f64::total_cmp);
    let most = holding(MOSTLY, distances.clone());
    let gap = distances.windows(2).find(|pair| pair[0] >= most && pair[1] > pair[0] + most);
    let last = gap.map_or(f64::INFINITY, |pair| pair[0]);
    points.iter().copied().filter(|point| distance(point) <= last).collect()
}

/// The centre of the sphere nearest to points, in the mean square of squared distances; their mean where they
/// have none.
fn middle_of(points: &[[f64; 3]]) -> DVec3 {
    let mean = points.iter().map(|point| DVec3::from(*point)).sum::<DVec3>() / points.len().max(1) as f64;
    // |p|² = 2 c·p + (r² − |c|²) about the mean.
    let (mut gram, mut right) = (DMatrix::<f64>::zeros(4, 4), DMatrix::<f64>::zeros(4, 1));
    for point in points {
        let p = DVec3::from(*point) - mean;
        let row = DMatrix::from_row_slice(1, 4, &[2.0 * p.x, 2.0 * p.y, 2.0 * p.z, 1.0]);
        gram += row.transpose() * &row;
        right += row.transpose() * p.length_squared();
    }
    let found = solve_positive(gram, &right).map(|found| DVec3::from_slice(&found.as_slice()[..3]));
    mean + found.filter(|center| center.is_finite()).unwrap_or_default()
}

/// Mean and standard deviation.
fn mean_and_spread(lengths: &[f64]) -> (f64, f64) {
    let count = lengths.len().max(1) as f64;
    let mean = lengths.iter().sum::<f64>() / count;
    let square = lengths.iter().map(|length| (length - mean).powi(2)).sum::<f64>();
    (mean, (square / count).sqrt())
}

/// Extreme points such that the hull of all others reaches farther by less than a length.
fn corners(points: &[[f64; 3]], length: f64) -> Vec<[f64; 3]> {
    let mut kept: Vec<[f64; 3]> = Vec::new();
    for k in 0..DIRECTIONS {
        let along = |point: &[f64; 3]| direction(k).dot(DVec3::from(*point));
        let Some(index) = farthest(points, direction(k)) else { continue };
        let reach = kept.iter().map(along).fold(f64::NEG_INFINITY, f64::max);
        if along(&points[index]) > reach + length {
            kept.push(points[index]);
        }
    }
    kept
}

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
