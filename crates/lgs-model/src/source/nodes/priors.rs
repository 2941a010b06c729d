//! Priors of the nodes' motion: what is near moves as one rigid body, and gently.

use burn::tensor::{Int, Tensor, TensorData};

use super::neighbors::Neighbors;
use super::node::{FEATURES, NODE, Node};
use super::tensor::{Followers, blend};
use crate::source::config::{DELTAS, NodesConfig};
use crate::thresholds::LEAST_SPACING;

/// Pairs of near nodes: the frame of the first one is to carry the second.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Edges {
    /// First nodes, one per pair.
    pub(super) first: Neighbors,
    /// Second nodes.
    pub(super) second: Vec<u32>,
}

impl Edges {
    /// Pairs of every node with its nearest, by weight.
    pub(super) fn new(nodes: &[[f32; NODE]], neighbors: usize) -> Self {
        let each: Vec<Node> = nodes.iter().map(Node::of).collect();
        let (means, features): (Vec<_>, Vec<_>) = each.iter().map(|n| (n.position, n.features)).unzip();
        let found = Neighbors::search(nodes, &means, &features, neighbors + 1);
        let rows = found.indices.chunks_exact(found.row.max(1)).enumerate();
        let pairs = rows.flat_map(|(k, row)| row.iter().map(move |&other| [k as u32, other]));
        Self::of(pairs.filter(|[a, b]| a != b))
    }

    /// Given pairs.
    pub(super) fn of(pairs: impl Iterator<Item = [u32; 2]>) -> Self {
        let (first, second): (Vec<u32>, Vec<u32>) = pairs.map(|[a, b]| (a, b)).unzip();
        Self { first: Neighbors { indices: first.into(), row: 1 }, second }
    }

    /// The pairs.
    pub(super) fn pairs(&self) -> impl Iterator<Item = [u32; 2]> {
        self.first.indices.iter().zip(&self.second).map(|(&a, &b)| [a, b])
    }

    /// `mean of ρ(e)`, e the distance between where the frame of the first node carries the second
    /// and where that is, over their canonical distance, and `ρ(e) = e² / (1 + (e/c)²)`; given nodes `[m,
    /// NODE]` and their poses `[m, DELTAS]`.
    pub(super) fn stretch(&self, nodes: &Tensor<2>, poses: &Tensor<2>, config: &NodesConfig) -> Tensor<1> {
        let device = poses.device();
        let index = |of: &[u32]| {
            let of: Vec<i32> = of.iter().map(|&i| i as i32).collect();
            Tensor::<1, Int>::from_ints(of.as_slice(), &device)
        };
        let (first, second) = (index(&self.first.indices), index(&self.second));
        let nodes = nodes.clone().detach();
        let position = |of: Tensor<1, Int>| nodes.clone().narrow(1, 0, 3).select(0, of);
        let (from, means) = (position(first), position(second.clone()));
        let rest = (from - means.clone()).square().sum_dim(1).clamp_min(LEAST_SPACING * LEAST_SPACING);
        let pairs = self.second.len();
        let rotations = unturned(pairs, &means);
        let features = Tensor::zeros([pairs, FEATURES], &device);
        let carried = blend(nodes, poses.clone(), Followers { means, rotations, features }, &self.first);
        let miss = carried.narrow(1, 0, 3) - poses.clone().narrow(1, 0, 3).select(0, second);
        let squared = miss.square().sum_dim(1) / rest;
        let robust = squared.clone() / (squared / (config.robust_scale * config.robust_scale) + 1.0);
        robust.mean()
    }
}

/// Quaternions `[n, 4]` of no rotation, beside a tensor.
pub(super) fn unturned(n: usize, beside: &Tensor<2>) -> Tensor<2> {
    Tensor::from_data(TensorData::new([1.0_f32, 0.0, 0.0, 0.0].repeat(n), [n, 4]), &beside.device())
}

/// `mean of |a|²` of nodes, given their poses `[m, DELTAS]` at three times a step apart, and the length and
/// time of one unit.
pub(super) fn acceleration([before, at, after]: [Tensor<2>; 3], step: f32, unit: f32) -> Tensor<1> {
    debug_assert_eq!(at.dims()[1], DELTAS, "pose rows");
    let change = (before - at.clone() * 2.0 + after).narrow(1, 0, 3) / (step * step * unit);
    change.square().sum_dim(1).mean()
}
