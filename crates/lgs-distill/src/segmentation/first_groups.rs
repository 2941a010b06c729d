//! Static particles and first groups of moving ones (method §5.1).
//!
//! A particle is static if it never gets farther than [`PartitionConfig::static_displacement`] from its first
//! position. The moving ones are linked to their nearest neighbours at the first sample; a link holds while
//! its length hardly changes and both displacements are alike, and objects are the connected components.
//! Paths are smoothed by a low-degree polynomial before, so that the jitter of a source model neither makes
//! walls move nor cuts links. The alternative, k-means with a given number of clusters, replaces graph and
//! components.

use super::graph::components;
use super::k_means::k_means;
use super::partition::Partition;
use crate::config::{PartitionConfig, PartitionMethod};
use crate::error::DistillError;
use crate::motion::curve::{Curve, Order};
use crate::thresholds::{DISPLACEMENTS, FASTEST_SHARE, NOISE_DEVIATIONS, POSITION_WEIGHT};
use crate::trajectories::Trajectories;
use glam::DVec3;
use rayon::prelude::*;

/// Length of a feature: the displacements and the first position.
const FEATURES: usize = 3 * DISPLACEMENTS + 3;

/// Splits particles into static ones and objects.
///
/// # Errors
/// If the trajectories are malformed.
pub fn partition(trajectories: &Trajectories, config: &PartitionConfig) -> Result<Partition, DistillError> {
    trajectories.validate()?;
    let paths = smooth_paths(trajectories, config.smoothing_degree);
    let limit = f64::from(config.static_displacement).powi(2);
    let is_moving = |&i: &usize| paths[i].iter().any(|&p| p.distance_squared(paths[i][0]) >= limit);
    let moving: Vec<usize> = (0..paths.len()).filter(is_moving).collect();
    let groups = match config.method {
        PartitionMethod::Graph => {
            let noise = smoothed_noise(trajectories, config.smoothing_degree);
            let slack = f64::from(config.length_slack) + NOISE_DEVIATIONS * noise;
            components(trajectories, &paths, &moving, slack, config)
        }
        PartitionMethod::KMeans => {
            k_means(&moving.iter().map(|&i| feature(&paths[i])).collect::<Vec<_>>(), config.clusters)
        }
    };
    let objects = label(trajectories, &moving, &groups, config.smallest_object);
    let weights = trajectories.particle_weights();
    Ok(without_negligible(&objects, &paths, &weights, config.negligible_motion))
}

/// Numbers that tell a path from others in k-means: displacements spread evenly over the window, and a part
/// of the first position.
fn feature(path: &[DVec3]) -> [f64; FEATURES] {
    let mut feature = [0.0; FEATURES];
    for (k, out) in feature[..3 * DISPLACEMENTS].as_chunks_mut::<3>().0.iter_mut().enumerate() {
        let sample = (k + 1) * (path.len() - 1) / DISPLACEMENTS;
        *out = (path[sample] - path[0]).to_array();
    }
    feature[3 * DISPLACEMENTS..].copy_from_slice(&(POSITION_WEIGHT * path[0]).to_array());
    feature
}

/// Each particle's path, smoothed by a polynomial; as it is for degree 0.
fn smooth_paths(trajectories: &Trajectories, degree: usize) -> Vec<Vec<DVec3>> {
    let samples = trajectories.times.len();
    if degree == 0 {
        return (0..trajectories.len()).map(|i| trajectories.path(i)).collect();
    }
    let smoother = smoothing_matrix(&trajectories.grid(), degree);
    let smoothed = |i: usize| {
        let path = trajectories.path(i);
        let value = |row: &[f64]| row.iter().zip(&path).map(|(&w, &p)| w * p).sum();
        smoother.chunks_exact(samples).map(value).collect()
    };
    (0..trajectories.len()).into_par_iter().map(smoothed).collect()
}

/// The `[T, T]` matrix that takes samples to the values of their polynomial fit.
fn smoothing_matrix(times: &[f64], degree: usize) -> Vec<f64> {
    let n = times.len();
    let mut identity = vec![0.0; n * n];
    (0..n).for_each(|i| identity[i * n + i] = 1.0);
    let curve = Curve::fit(times, &identity, n, degree);
    times.iter().flat_map(|&t| curve.at(t, Order::Value)).collect()
}

/// Standard deviation of what smoothing leaves of independent noise: a fit of `degree + 1` unknowns to `T`
/// samples passes that part of its variance.
fn smoothed_noise(trajectories: &Trajectories, degree: usize) -> f64 {
    let kept = if degree == 0 { 1.0 } else { ((degree + 1) as f64 / trajectories.times.len() as f64).sqrt() };
    trajectories.independent_noise() * kept
}

/// Labels by falling size; small components take the label of the nearest particle of a large one.
fn label(trajectories: &Trajectories, moving: &[usize], component: &[usize], smallest: usize) -> Partition {
    let mut groups = vec![Vec::new(); moving.len()];
    component.iter().zip(moving).for_each(|(&c, &i)| groups[c].push(i));
    let largest = groups.iter().map(Vec::len).max().unwrap_or(0);
    let least = smallest.min(largest).max(1);
    let small: Vec<usize> = groups.iter().filter(|group| group.len() < least).flatten().copied().collect();
    groups.retain(|group| group.len() >= least);
    let mut partition = Partition::of_groups(groups, trajectories.len());
    let labelled: Vec<usize> = moving.iter().copied().filter(|&i| partition.object[i] >= 0).collect();
    let start = |list: &[usize]| list.iter().map(|&i| trajectories.positions[0][i]).collect::<Vec<_>>();
    let nearest = lgs_core::nearest_indices(&start(&labelled), &start(&small));
    for (&i, near) in small.iter().zip(nearest) {
        partition.object[i] = partition.object[labelled[near as usize]];
    }
    partition
}

/// Turns objects static whose root mean square displacement is below a part of that which a tenth of the
/// weight of all of them has at least: a few particles that fly off are no measure of the others.
fn without_negligible(partition: &Partition, paths: &[Vec<DVec3>], weights: &[f64], part: f32) -> Partition {
    let mut sums = vec![[0.0; 2]; partition.objects];
    for ((path, &object), weight) in paths.iter().zip(&partition.object).zip(weights) {
        if let Ok(object) = usize::try_from(object) {
            sums[object][0] += weight * path.iter().map(|&p| p.distance_squared(path[0])).sum::<f64>();
            sums[object][1] += weight;
        }
    }
    let mean_squares: Vec<f64> =
        sums.iter().map(|[sum, weight]| sum / weight.max(f64::MIN_POSITIVE)).collect();
    let mut order: Vec<usize> = (0..sums.len()).collect();
    order.sort_by(|&a, &b| mean_squares[b].total_cmp(&mean_squares[a]));
    let all: f64 = sums.iter().map(|[_, weight]| weight).sum();
    let mut passed = 0.0;
    let reached = order.iter().find(|&&object| {
        passed += sums[object][1];
        passed >= FASTEST_SHARE * all
    });
    let limit = f64::from(part).powi(2) * reached.map_or(0.0, |&object| mean_squares[object]);
    partition.with_only(&mean_squares.iter().map(|&m| m >= limit).collect::<Vec<_>>())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_few_particles_that_fly_off_turn_nothing_static() {
        let path = |speed: f64| (0..10).map(|k| DVec3::X * speed * f64::from(k)).collect::<Vec<_>>();
        let speeds = [1.0, 0.8, 200.0, 0.01];
        let object: Vec<i32> = (0..400)
            .map(|i| {
                if i < 190 {
                    0
                } else if i < 380 {
                    1
                } else if i < 390 {
                    2
                } else {
                    3
                }
            })
            .collect();
        let paths: Vec<_> = object.iter().map(|&o| path(speeds[o as usize])).collect();
        let partition = Partition { object, objects: 4 };
        let found = without_negligible(&partition, &paths, &[1.0; 400], 0.08);
        assert_eq!(found.objects, 3, "all but what hardly moves");
        assert_eq!([0, 200, 385, 395].map(|i| found.object[i]), [0, 1, 2, -1]);
    }
}
