//! The blend of nodes in plain tensor operations: the twin that tests compare [`super::blend`] with,
//! differentiated by Burn.

use burn::tensor::{Int, Tensor};

use super::mixture::LEAST_WEIGHT;
use super::neighbors::Neighbors;
use super::node::FEATURES;
use crate::source::reference::{columns, cross, quat_mul};

/// Inputs of [`blend`].
pub struct ReferenceInput<'a> {
    /// Rows of nodes `[m, NODE]`.
    pub nodes: Tensor<2>,
    /// Their poses `[m, DELTAS]`.
    pub poses: Tensor<2>,
    /// Canonical centres `[n, 3]`.
    pub means: Tensor<2>,
    /// Canonical quaternions `[n, 4]`.
    pub rotations: Tensor<2>,
    /// Features of Gaussians `[n, FEATURES]`.
    pub features: Tensor<2>,
    /// Nodes of every Gaussian, at least one.
    pub neighbors: &'a Neighbors,
}

fn unit(q: &Tensor<2>) -> Tensor<2> {
    q.clone() / q.clone().square().sum_dim(1).sqrt()
}

/// Pose rows `[n, DELTAS]`, as [`super::blend::blend`].
#[must_use]
pub fn blend(input: ReferenceInput<'_>) -> Tensor<2> {
    let ReferenceInput { nodes, poses, means, rotations, features, neighbors } = input;
    let row = neighbors.row;
    let (mut total, mut place, mut turn) = (None, None, None);
    let mut first: Option<Tensor<2>> = None;
    for k in 0..row {
        let of_each: Vec<i32> = neighbors.indices.iter().skip(k).step_by(row).map(|&i| i as i32).collect();
        let chosen = Tensor::<1, Int>::from_ints(of_each.as_slice(), &means.device());
        let (node, pose) = (nodes.clone().select(0, chosen.clone()), poses.clone().select(0, chosen));
        let from_node = means.clone() - columns(&node, 0, 3).detach();
        let in_space = from_node.clone().detach().square().sum_dim(1) * (columns(&node, 3, 1) * -2.0).exp();
        let in_features = (features.clone() - columns(&node, 5, FEATURES)).square().sum_dim(1);
        let share = burn::tensor::activation::sigmoid(columns(&node, 4, 1));
        let weight = share * ((in_space + in_features) * -0.5).exp() + LEAST_WEIGHT;
        let quaternion = unit(&columns(&pose, 3, 4));
        let first = first.get_or_insert_with(|| quaternion.clone().detach());
        let sign = (first.clone() * quaternion.clone().detach()).sum_dim(1).sign();
        let (w, n) = (columns(&quaternion, 0, 1), columns(&quaternion, 1, 3));
        let twice = cross(&n, &from_node) * 2.0;
        let carried = from_node + twice.clone() * w + cross(&n, &twice) + columns(&pose, 0, 3);
        let add = |sum: Option<Tensor<2>>, term: Tensor<2>| Some(sum.map_or(term.clone(), |sum| sum + term));
        place = add(place, carried * weight.clone());
        turn = add(turn, quaternion * (weight.clone() * sign));
        total = add(total, weight);
    }
    let (Some(total), Some(place), Some(turn)) = (total, place, turn) else {
        return Tensor::cat(vec![means.clone(), unit(&rotations), means.zeros_like()], 1);
    };
    let rotations = quat_mul(&unit(&turn), &unit(&rotations));
    Tensor::cat(vec![place / total, rotations, means.zeros_like()], 1)
}
