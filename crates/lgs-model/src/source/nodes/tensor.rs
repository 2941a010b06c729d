//! The blend of nodes as a Burn operation, differentiable by nodes, their poses and the Gaussians that follow
//! them.

use burn::backend::Flex;
use burn::backend::tensor::FloatTensor;
use burn::tensor::Tensor;
use lgs_tensor::Kernel;
use lgs_tensor::flex::{rows, tensor_of_rows};

use super::blend::{BlendInput, blend as blend_rows, blend_vjp};
use super::neighbors::Neighbors;

fn input<'a>(inputs: &'a [FloatTensor<Flex>; 5], neighbors: &'a Neighbors) -> BlendInput<'a> {
    let [nodes, poses, means, rotations, features] = inputs;
    BlendInput {
        nodes: rows(nodes),
        poses: rows(poses),
        means: rows(means),
        rotations: rows(rotations),
        features: rows(features),
        neighbors,
    }
}

impl Kernel<Neighbors, 5> for Flex {
    type Kept = [FloatTensor<Self>; 5];

    fn forward_kept(
        neighbors: &Neighbors,
        inputs: [FloatTensor<Self>; 5],
    ) -> (FloatTensor<Self>, Self::Kept) {
        let inputs = inputs.map(|t| t.to_contiguous());
        (tensor_of_rows(blend_rows(input(&inputs, neighbors))), inputs)
    }

    fn vjp(neighbors: &Neighbors, inputs: Self::Kept, v_poses: FloatTensor<Self>) -> [FloatTensor<Self>; 5] {
        let v = blend_vjp(input(&inputs, neighbors), rows(&v_poses.to_contiguous()));
        [
            tensor_of_rows(v.nodes),
            tensor_of_rows(v.poses),
            tensor_of_rows(v.means),
            tensor_of_rows(v.rotations),
            tensor_of_rows(v.features),
        ]
    }
}

lgs_tensor::calls! { Neighbors: "blend of nodes"; }

lgs_tensor::operations! {
    /// Backends that can blend nodes: kernels from nodes `[m, NODE]`, their poses `[m, DELTAS]`, centres `[n,
    /// 3]`, quaternions `[n, 4]` and features `[n, FEATURES]` to pose rows `[n, DELTAS]`.
    pub trait BlendKernels;

    /// The operation of the blend on backends with and without gradients.
    pub trait BlendOps;

    /// Pose rows `[n, DELTAS]` from nodes, their poses, centres, quaternions and features.
    fn blend_nodes(nodes: 2, poses: 2, means: 2, rotations: 2, features: 2; neighbors: Neighbors) -> 2;
}

/// Gaussians that follow nodes, as tensors.
pub struct Followers {
    /// Canonical centres `[n, 3]`.
    pub means: Tensor<2>,
    /// Canonical quaternions `[n, 4]`.
    pub rotations: Tensor<2>,
    /// Features `[n, FEATURES]`.
    pub features: Tensor<2>,
}

/// Pose rows `[n, DELTAS]` of Gaussians that follow nodes `[m, NODE]` in poses `[m, DELTAS]`; differentiable
/// by everything but the nodes' positions, by centres not through the weights.
#[must_use]
pub fn blend(nodes: Tensor<2>, poses: Tensor<2>, followers: Followers, neighbors: &Neighbors) -> Tensor<2> {
    let Followers { means, rotations, features } = followers;
    blend_nodes(nodes, poses, means, rotations, features, neighbors.clone())
}
