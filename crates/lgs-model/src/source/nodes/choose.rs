//! Choice of nodes: the first ones at far points of a cloud, more where Gaussians of one node want to move
//! apart, fewer where no Gaussian follows.

use lgs_core::{GaussianCloud, SH_C0};

use crate::source::config::DELTAS;
use crate::thresholds::{
    COLOUR_REACH, FIRST_RADIUS, IDLE_LOAD, MOST_ADDED, NODE_OPACITY, RADIUS_OF_COVER, SHARED_LOGIT,
    SHARED_RADIUS, UNEVEN,
};

use super::mixture::{Carrier, Mixture};
use super::neighbors::Neighbors;
use super::node::{FEATURES, NODE, Node};

/// Gaussians as nodes see them.
#[derive(Clone, Copy)]
pub(super) struct Places<'a> {
    pub(super) means: &'a [[f32; 3]],
    pub(super) features: &'a [[f32; FEATURES]],
}

/// Features before training: colours, so that what looks different need not move together.
pub(super) fn first_features(cloud: &GaussianCloud) -> Vec<[f32; FEATURES]> {
    let rows = cloud.sh.chunks_exact(cloud.sh_stride());
    rows.map(|row| std::array::from_fn(|i| COLOUR_REACH * (0.5 + SH_C0 * row[i]).clamp(0.0, 1.0))).collect()
}

/// Nodes at up to `count` of the opaque Gaussians, each the farthest from those before it in space and
/// features, in a scene of a half extent. Their radius is such that every Gaussian is near one.
pub(super) fn first_nodes(
    cloud: &GaussianCloud,
    features: &[[f32; FEATURES]],
    half_extent: f32,
    count: usize,
) -> Vec<[f32; NODE]> {
    let logit = (NODE_OPACITY / (1.0 - NODE_OPACITY)).ln();
    let mut candidates: Vec<usize> = (0..cloud.len()).filter(|&i| cloud.raw_opacities[i] >= logit).collect();
    if candidates.len() < count {
        candidates = (0..cloud.len()).collect();
    }
    let unit = FIRST_RADIUS * half_extent;
    let at = |i: usize| Node {
        position: cloud.means[i],
        log_radius: unit.ln(),
        logit: 0.0,
        features: features[i],
    };
    let mut distances = vec![f32::INFINITY; candidates.len()];
    let (mut chosen, mut next) = (Vec::new(), 0);
    while chosen.len() < count.min(candidates.len()) {
        let node = at(candidates[next]);
        chosen.push(node);
        for (distance, &i) in distances.iter_mut().zip(&candidates) {
            let [in_space, in_features] = node.squared_distances(cloud.means[i], features[i]);
            *distance = distance.min(in_space + in_features);
        }
        next = (0..candidates.len()).fold(0, |best, i| if distances[i] > distances[best] { i } else { best });
    }
    let cover = distances.get(next).copied().unwrap_or(1.0).max(1e-6).sqrt();
    let log_radius = (RADIUS_OF_COVER * cover * unit).ln();
    chosen.iter().map(|node| Node { log_radius, ..*node }.row()).collect()
}

/// How much the Gaussians of each node have wanted to move apart.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Discord {
    /// Sum over iterations of the squares of gradients less that of their mean, `[m]`.
    pub(super) of_nodes: Vec<f32>,
}

impl Discord {
    /// Adds an iteration's gradients by the centres of Gaussians to the nodes that they follow first.
    pub(super) fn observe(&mut self, gradients: &[[f32; 3]], neighbors: &Neighbors) {
        let mut sums = vec![([0.0_f32; 3], 0.0_f32, 0.0_f32); self.of_nodes.len()];
        for (gradient, row) in gradients.iter().zip(neighbors.indices.chunks_exact(neighbors.row.max(1))) {
            let (sum, squares, count) = &mut sums[row[0] as usize];
            for i in 0..3 {
                sum[i] += gradient[i];
                *squares += gradient[i] * gradient[i];
            }
            *count += 1.0;
        }
        for (discord, (sum, squares, count)) in self.of_nodes.iter_mut().zip(sums) {
            let common: f32 = sum.iter().map(|v| v * v).sum::<f32>() / count.max(1.0);
            *discord += (squares - common).max(0.0);
        }
    }

    /// Up to `room` moving nodes with far more discord than is usual among moving ones, the largest first.
    fn largest(&self, moves: &[bool], room: usize) -> Vec<usize> {
        let mut nodes: Vec<usize> = (0..self.of_nodes.len()).filter(|&k| moves[k]).collect();
        let mean = nodes.iter().map(|&k| self.of_nodes[k]).sum::<f32>() / nodes.len().max(1) as f32;
        nodes.retain(|&k| self.of_nodes[k] > UNEVEN * mean);
        nodes.sort_by(|&a, &b| self.of_nodes[b].total_cmp(&self.of_nodes[a]).then(a.cmp(&b)));
        nodes.truncate(room.min(MOST_ADDED));
        nodes
    }
}

/// Sums of the weights of each node over Gaussians.
fn loads(nodes: &[[f32; NODE]], places: Places<'_>, neighbors: &Neighbors) -> Vec<f32> {
    let mut loads = vec![0.0; nodes.len()];
    let carriers: Vec<Carrier> = nodes.iter().map(|node| Carrier::new(node, &[0.0; DELTAS])).collect();
    let rows = neighbors.indices.chunks_exact(neighbors.row.max(1));
    for (row, (&mean, &features)) in rows.zip(places.means.iter().zip(places.features)) {
        let mixture = Mixture::new(&carriers, row, mean, features);
        row.iter().zip(mixture.weights).for_each(|(&node, weight)| loads[node as usize] += weight);
    }
    loads
}

/// Nodes that stay, by number, and new ones.
pub(super) struct Choice {
    pub(super) kept: Vec<usize>,
    pub(super) added: Vec<[f32; NODE]>,
}

/// Drops the nodes that nothing follows, and adds one to each of those whose Gaussians want to move apart, at
/// the Gaussian farthest from it, up to `most` in all.
pub(super) fn rechoose(
    nodes: &[[f32; NODE]],
    places: Places<'_>,
    neighbors: &Neighbors,
    (discord, moves): (&Discord, &[bool]),
    most: usize,
) -> Choice {
    let loads = loads(nodes, places, neighbors);
    let mut kept: Vec<usize> = (0..nodes.len()).filter(|&k| loads[k] >= IDLE_LOAD).collect();
    if kept.is_empty() {
        kept = (0..nodes.len()).collect();
    }
    let added = discord.largest(moves, most.saturating_sub(kept.len())).into_iter();
    let added = added.filter_map(|k| shared(&Node::of(&nodes[k]), k, places, neighbors)).collect();
    Choice { kept, added }
}

/// A node that takes over a part of another one's Gaussians, at the farthest of these.
fn shared(node: &Node, number: usize, places: Places<'_>, neighbors: &Neighbors) -> Option<[f32; NODE]> {
    let rows = neighbors.indices.chunks_exact(neighbors.row.max(1)).enumerate();
    let own = rows.filter(|(_, row)| row[0] as usize == number).map(|(i, _)| i);
    let distance = |i: usize| node.squared_distances(places.means[i], places.features[i]).iter().sum::<f32>();
    let farthest = own.max_by(|&a, &b| distance(a).total_cmp(&distance(b)).then(b.cmp(&a)))?;
    let (log_radius, logit) = (node.log_radius + SHARED_RADIUS.ln(), node.logit + SHARED_LOGIT);
    let (position, features) = (places.means[farthest], places.features[farthest]);
    Some(Node { position, log_radius, logit, features }.row())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two squares of four Gaussians each, one black and one white, side by side.
    fn squares() -> GaussianCloud {
        let means = (0..8).map(|i| [(i % 2) as f32 * 0.1, (i / 2 % 2) as f32 * 0.1, (i / 4) as f32 * 0.2]);
        let mut cloud = GaussianCloud::isotropic(means.collect(), 0.05, [0.0; 3], 0.9);
        let stride = cloud.sh_stride();
        cloud.sh[4 * stride..].chunks_exact_mut(stride).for_each(|row| row[..3].fill(0.5 / SH_C0));
        cloud
    }

    #[test]
    fn first_nodes_are_far_from_each_other_in_space_and_colour() {
        let cloud = squares();
        let features = first_features(&cloud);
        let nodes = first_nodes(&cloud, &features, 1.0, 2);
        assert_eq!((Node::of(&nodes[0]).position, Node::of(&nodes[1]).position[2]), ([0.0; 3], 0.2));
        let neighbors = Neighbors::search(&nodes, &cloud.means, &features, 1);
        assert_eq!(neighbors.indices.as_slice(), [0, 0, 0, 0, 1, 1, 1, 1]);
        assert_eq!(first_nodes(&cloud, &features, 1.0, 100).len(), 8);
    }

    #[test]
    fn a_node_is_added_where_gaussians_part_and_one_that_nothing_follows_goes() {
        let cloud = squares();
        let features = first_features(&cloud);
        let mut nodes = first_nodes(&cloud, &features, 1.0, 2);
        nodes.push(Node { position: [9.0; 3], ..Node::of(&nodes[0]) }.row());
        let neighbors = Neighbors::search(&nodes, &cloud.means, &features, 2);
        let mut discord = Discord { of_nodes: vec![0.0; 3] };
        let gradients: Vec<[f32; 3]> =
            (0..8).map(|i| if i < 4 { [1.0, 0.0, 0.0] } else { [i as f32 - 5.5, 0.0, 0.0] }).collect();
        discord.observe(&gradients, &neighbors);
        assert_eq!((discord.of_nodes[0], discord.of_nodes[1]), (0.0, 5.0), "a common gradient is no discord");
        let places = Places { means: &cloud.means, features: &features };
        let found = rechoose(&nodes, places, &neighbors, (&discord, &[true; 3]), 8);
        assert_eq!((found.kept.as_slice(), found.added.len()), ([0, 1].as_slice(), 1));
        assert_eq!(Node::of(&found.added[0]).position[2], 0.2);
        let still = rechoose(&nodes, places, &neighbors, (&discord, &[false; 3]), 8);
        assert!(still.added.is_empty(), "what rests needs no more nodes");
        assert!(rechoose(&nodes, places, &neighbors, (&discord, &[true; 3]), 2).added.is_empty());
    }
}
