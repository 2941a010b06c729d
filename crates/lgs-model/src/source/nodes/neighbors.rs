//! Which nodes a Gaussian follows: those that weigh most at its place and with its features.

use std::sync::Arc;

use rayon::prelude::*;

use super::node::{FEATURES, NODE, Node};

/// Gaussians per task of the search.
const BLOCK: usize = 256;

/// Nodes of every Gaussian, the heaviest first.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Neighbors {
    /// Numbers of nodes, `[n, row]`.
    pub indices: Arc<Vec<u32>>,
    /// Nodes per Gaussian.
    pub row: usize,
}

impl Neighbors {
    /// The `count` heaviest nodes, or all if there are fewer, of Gaussians with centres and features; equal
    /// ones by number.
    ///
    /// # Panics
    /// If there are not as many features as centres.
    #[must_use]
    pub fn search(
        nodes: &[[f32; NODE]],
        means: &[[f32; 3]],
        features: &[[f32; FEATURES]],
        count: usize,
    ) -> Self {
        assert_eq!(means.len(), features.len(), "centres and features");
        let row = count.min(nodes.len());
        let mut indices = vec![0; means.len() * row];
        if row > 0 {
            let nodes: Vec<(Node, f32)> =
                nodes.iter().map(Node::of).map(|node| (node, -2.0 * node.share().ln())).collect();
            let blocks = indices.par_chunks_mut(BLOCK * row).zip(means.par_chunks(BLOCK));
            blocks.zip(features.par_chunks(BLOCK)).for_each(|((rows, means), features)| {
                let mut costs = vec![0.0; row];
                for ((row, &mean), &features) in rows.chunks_exact_mut(row).zip(means).zip(features) {
                    heaviest(&nodes, mean, features, (row, &mut costs));
                }
            });
        }
        Self { indices: Arc::new(indices), row }
    }
}

/// Fills a row with the nodes of least cost: minus twice the logarithm of the weight.
fn heaviest(
    nodes: &[(Node, f32)],
    mean: [f32; 3],
    features: [f32; FEATURES],
    (row, costs): (&mut [u32], &mut [f32]),
) {
    costs.fill(f32::INFINITY);
    row.fill(0);
    let last = row.len() - 1;
    for (number, (node, own)) in nodes.iter().enumerate() {
        let [in_space, in_features] = node.squared_distances(mean, features);
        let cost = own + in_space + in_features;
        if cost >= costs[last] {
            continue;
        }
        let place = costs.partition_point(|&other| other <= cost);
        costs[place..].rotate_right(1);
        row[place..].rotate_right(1);
        (costs[place], row[place]) = (cost, number as u32);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn near_nodes_of_like_features_come_first_and_equal_ones_by_number() {
        let node = |x: f32, feature: f32| {
            Node { position: [x, 0.0, 0.0], log_radius: 0.0, logit: 0.0, features: [feature, 0.0, 0.0] }.row()
        };
        let nodes = [node(0.5, 3.0), node(1.0, 0.0), node(-1.0, 0.0), node(9.0, 0.0)];
        let found = Neighbors::search(&nodes, &[[0.0; 3]], &[[0.0; 3]], 3);
        assert_eq!((found.indices.as_slice(), found.row), ([1, 2, 0].as_slice(), 3));
        assert_eq!(Neighbors::search(&nodes[..2], &[[0.0; 3]; 2], &[[0.0; 3]; 2], 3).row, 2);
        assert_eq!(Neighbors::search(&[], &[[0.0; 3]], &[[0.0; 3]], 3), Neighbors::default());
    }
}
