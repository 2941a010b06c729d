//! The graph of neighbours that move together, and its connected components.

use crate::config::PartitionConfig;
use crate::trajectories::Trajectories;
use glam::DVec3;

/// Connected component of each of the `moving` particles, as the smallest index (in `moving`) of its members.
/// `paths` are those of all particles, `[n][T]`; `slack` is how far noise may change an edge's length, world
/// units.
pub(crate) fn components(
    trajectories: &Trajectories,
    paths: &[Vec<DVec3>],
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
                && move_together(&paths[moving[own]], &paths[moving[other]], slack, config)
            {
                let (a, b) = (find(&mut parent, own), find(&mut parent, other));
                parent[a.max(b)] = a.min(b);
            }
        }
    }
    (0..moving.len()).map(|i| find(&mut parent, i)).collect()
}

/// Whether two particles keep their distance and have alike displacements.
fn move_together(a: &[DVec3], b: &[DVec3], slack: f64, config: &PartitionConfig) -> bool {
    let length = |s: usize| a[s].distance(b[s]);
    let first = length(0);
    let change = (0..a.len()).map(|s| (length(s) - first).abs()).fold(0.0, f64::max);
    if change > f64::from(config.length_tolerance) * first + slack {
        return false;
    }
    let (mut difference, mut of_a, mut of_b) = (0.0, 0.0, 0.0);
    for (p, q) in a.iter().zip(b) {
        let (d, e) = (*p - a[0], *q - b[0]);
        difference += d.distance_squared(e);
        of_a += d.length_squared();
        of_b += e.length_squared();
    }
    difference.sqrt() <= f64::from(config.displacement_tolerance) * of_a.max(of_b).sqrt()
}

/// The representative of a set, with path halving.
fn find(parent: &mut [usize], mut i: usize) -> usize {
    while parent[i] != i {
        parent[i] = parent[parent[i]];
        i = parent[i];
    }
    i
}
