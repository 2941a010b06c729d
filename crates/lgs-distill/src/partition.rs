//! Which particles move, and which of them move together (0.01 rule; trajectory graph, G14).
//!
//! Static: never farther than 0.01 from where it started. The moving ones are linked to their nearest
//! neighbours at the first sample; a link holds while its length hardly changes and both displacements are
//! alike, and objects are the connected components, the largest first (ties by their first particle). Paths
//! are smoothed by a low-degree polynomial before, so that the jitter of a source model neither makes walls
//! move nor cuts links. The alternative of G15, k-means with a given number of clusters, replaces graph and
//! components.

use crate::chebyshev::{Curve, Order};
use crate::config::{PartitionConfig, PartitionMethod};
use crate::dense::{V3, median, norm2, sub};
use crate::k_means::k_means;
use crate::{DistillError, Trajectories};
use rayon::prelude::*;

/// Displacements in a feature of k-means.
const DISPLACEMENTS: usize = 8;
/// Length of a feature.
const FEATURES: usize = 3 * DISPLACEMENTS + 3;
/// Weight of the first position in a feature.
const PLACE: f64 = 0.1;

/// Labels of all particles.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Partition {
    /// Object of each particle, −1 for a static one.
    pub object: Vec<i32>,
    /// Number of objects, labelled by falling size.
    pub objects: usize,
}

impl Partition {
    /// The particles of an object, ascending.
    #[must_use]
    pub fn members(&self, object: usize) -> Vec<usize> {
        (0..self.object.len()).filter(|&i| self.object[i] == object as i32).collect()
    }

    /// The partition with only the objects that `kept` says, labelled anew in the same order; the particles
    /// of the others are static.
    #[must_use]
    pub fn with_only(&self, kept: &[bool]) -> Self {
        let mut next = 0..;
        let labels: Vec<i32> =
            kept.iter().map(|&kept| if kept { next.next().unwrap_or(-1) } else { -1 }).collect();
        let label = |&o: &i32| usize::try_from(o).ok().and_then(|o| labels.get(o).copied()).unwrap_or(-1);
        Self {
            object: self.object.iter().map(label).collect(),
            objects: labels.iter().filter(|&&l| l >= 0).count(),
        }
    }

    /// Number of moving particles.
    #[must_use]
    pub fn moving(&self) -> usize {
        self.object.iter().filter(|&&o| o >= 0).count()
    }
}

/// Splits particles into static ones and objects.
///
/// # Errors
/// If the trajectories are malformed.
pub fn partition(trajectories: &Trajectories, config: &PartitionConfig) -> Result<Partition, DistillError> {
    trajectories.validate()?;
    let paths = smooth_paths(trajectories, config.smoothing_degree);
    let limit = f64::from(config.static_displacement).powi(2);
    let moving: Vec<usize> =
        (0..paths.len()).filter(|&i| paths[i].iter().any(|&p| norm2(sub(p, paths[i][0])) >= limit)).collect();
    let components = match config.method {
        PartitionMethod::Graph => {
            let slack =
                f64::from(config.length_slack) + 3.0 * left_noise(trajectories, config.smoothing_degree);
            components(trajectories, &paths, &moving, slack, config)
        }
        PartitionMethod::KMeans => {
            k_means(&moving.iter().map(|&i| feature(&paths[i])).collect::<Vec<_>>(), config.clusters)
        }
    };
    let objects = label(trajectories, &moving, &components, config.smallest_object);
    Ok(without_negligible(&objects, &paths, config.negligible_motion))
}

/// Numbers that tell a path from others in k-means (G15): displacements at eight times spread evenly over the
/// window, and a tenth of the first position.
fn feature(path: &[V3]) -> [f64; FEATURES] {
    let mut feature = [0.0; FEATURES];
    for (k, out) in feature[..3 * DISPLACEMENTS].as_chunks_mut::<3>().0.iter_mut().enumerate() {
        let sample = (k + 1) * (path.len() - 1) / DISPLACEMENTS;
        *out = sub(path[sample], path[0]);
    }
    feature[3 * DISPLACEMENTS..].copy_from_slice(&path[0].map(|x| PLACE * x));
    feature
}

/// Each particle's path, smoothed.
fn smooth_paths(trajectories: &Trajectories, degree: usize) -> Vec<Vec<V3>> {
    let times = trajectories.grid();
    let own = |i: usize| (0..times.len()).map(|s| trajectories.at(s, i)).collect::<Vec<V3>>();
    if degree == 0 {
        return (0..trajectories.len()).map(own).collect();
    }
    let smoother = smoothing_matrix(&times, degree);
    let smoothed = |i: usize| {
        let path = own(i);
        smoother
            .chunks_exact(times.len())
            .map(|row| {
                row.iter()
                    .zip(&path)
                    .fold([0.0; 3], |sum, (&w, p)| [sum[0] + w * p[0], sum[1] + w * p[1], sum[2] + w * p[2]])
            })
            .collect()
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

/// Standard deviation of what independent noise leaves in a smoothed sample.
fn left_noise(trajectories: &Trajectories, degree: usize) -> f64 {
    let kept = if degree == 0 { 1.0 } else { ((degree + 1) as f64 / trajectories.times.len() as f64).sqrt() };
    trajectories.independent_noise() * kept
}

/// Component of each moving particle, as the smallest index (in `moving`) of its members.
pub(crate) fn components(
    trajectories: &Trajectories,
    paths: &[Vec<V3>],
    moving: &[usize],
    slack: f64,
    config: &PartitionConfig,
) -> Vec<usize> {
    let starts: Vec<[f32; 3]> = moving.iter().map(|&i| trajectories.positions[0][i]).collect();
    let (neighbors, row) = lgs_core::k_nearest(&starts, config.neighbors);
    let mut parent: Vec<usize> = (0..moving.len()).collect();
    for (own, others) in neighbors.chunks_exact(row.max(1)).enumerate() {
        for &other in &others[1..] {
            let other = other as usize;
            if find(&mut parent, own) != find(&mut parent, other)
                && holds(&paths[moving[own]], &paths[moving[other]], slack, config)
            {
                let (a, b) = (find(&mut parent, own), find(&mut parent, other));
                parent[a.max(b)] = a.min(b);
            }
        }
    }
    (0..moving.len()).map(|i| find(&mut parent, i)).collect()
}

/// Whether two particles move together.
fn holds(a: &[V3], b: &[V3], slack: f64, config: &PartitionConfig) -> bool {
    let length = |s: usize| norm2(sub(a[s], b[s])).sqrt();
    let first = length(0);
    let change = (0..a.len()).map(|s| (length(s) - first).abs()).fold(0.0, f64::max);
    if change > f64::from(config.length_tolerance) * first + slack {
        return false;
    }
    let (mut apart, mut own, mut other) = (0.0, 0.0, 0.0);
    for (p, q) in a.iter().zip(b) {
        let (d, e) = (sub(*p, a[0]), sub(*q, b[0]));
        apart += norm2(sub(d, e));
        own += norm2(d);
        other += norm2(e);
    }
    apart.sqrt() <= f64::from(config.displacement_tolerance) * own.max(other).sqrt()
}

/// The representative of a set, with path halving.
fn find(parent: &mut [usize], mut i: usize) -> usize {
    while parent[i] != i {
        parent[i] = parent[parent[i]];
        i = parent[i];
    }
    i
}

/// Turns objects static whose root mean square displacement is below a part of the largest one's.
fn without_negligible(partition: &Partition, paths: &[Vec<V3>], part: f32) -> Partition {
    let mut sums = vec![(0.0, 0_usize); partition.objects];
    for (path, &object) in paths.iter().zip(&partition.object) {
        if let Ok(object) = usize::try_from(object) {
            sums[object].0 += path.iter().map(|&p| norm2(sub(p, path[0]))).sum::<f64>();
            sums[object].1 += 1;
        }
    }
    let mean_squares: Vec<f64> = sums.iter().map(|&(sum, count)| sum / count.max(1) as f64).collect();
    let limit = f64::from(part).powi(2) * mean_squares.iter().copied().fold(0.0, f64::max);
    partition.with_only(&mean_squares.iter().map(|&m| m >= limit).collect::<Vec<_>>())
}

/// Labels by falling size; small components take the label of the nearest particle of a large one.
fn label(trajectories: &Trajectories, moving: &[usize], component: &[usize], smallest: usize) -> Partition {
    let mut object = vec![-1; trajectories.len()];
    let mut size = vec![0_usize; moving.len()];
    component.iter().for_each(|&c| size[c] += 1);
    let largest = size.iter().copied().max().unwrap_or(0);
    let mut large: Vec<usize> =
        (0..moving.len()).filter(|&c| size[c] > 0 && size[c] >= smallest.min(largest)).collect();
    large.sort_by_key(|&c| (std::cmp::Reverse(size[c]), c));
    for (i, &c) in component.iter().enumerate() {
        if let Some(rank) = large.iter().position(|&l| l == c) {
            object[moving[i]] = rank as i32;
        }
    }
    let labelled: Vec<usize> = moving.iter().copied().filter(|&i| object[i] >= 0).collect();
    let stray: Vec<usize> = moving.iter().copied().filter(|&i| object[i] < 0).collect();
    let start = |list: &[usize]| list.iter().map(|&i| trajectories.positions[0][i]).collect::<Vec<_>>();
    let nearest = lgs_core::nearest_indices(&start(&labelled), &start(&stray));
    for (&i, near) in stray.iter().zip(nearest) {
        object[i] = object[labelled[near as usize]];
    }
    Partition { object, objects: large.len() }
}

/// A typical displacement over the window of the moving particles, world units (0 if none move).
#[must_use]
pub fn typical_displacement(trajectories: &Trajectories, partition: &Partition) -> f32 {
    let Some(last) = trajectories.positions.last() else { return 0.0 };
    let far = (0..trajectories.len()).filter(|&i| partition.object[i] >= 0);
    median(
        far.map(|i| {
            f64::from(lgs_core::linear::norm(lgs_core::linear::sub(last[i], trajectories.positions[0][i])))
        })
        .collect(),
    ) as f32
}
