//! The blend of nodes on devices of CubeCL, and the discord of nodes. Nothing is read back.
#![allow(
    clippy::assign_op_pattern,
    clippy::needless_range_loop,
    reason = "kernels are written in the part of the language that CubeCL translates"
)]

mod discord;
mod follow;
mod follow_vjp;
mod followed;
mod mixture;

use burn::backend::TensorMetadata;
use burn::backend::ops::FloatTensorOps;
use burn::backend::tensor::FloatTensor;
use burn::tensor::DType;
use lgs_tensor::Kernel;
use lgs_tensor::cube::{CubeBackend, CubeTensor, contiguous, empty, units, zeros};

use super::neighbors::Neighbors;
use super::node::NODE;
use crate::source::config::DELTAS;
use follow::{carry, follow_nodes};
use follow_vjp::{SUMS, carry_vjp, follow_nodes_vjp, sum_followers, weights_vjp};
use followed::{Followed, followed};
use mixture::{CARRIER, FOLLOWER};

pub(super) use discord::discord;

/// What a forward pass leaves on the device.
#[derive(Clone, Debug)]
pub struct BlendKept {
    /// Number of nodes.
    nodes: usize,
    carriers: CubeTensor,
    followers: CubeTensor,
    followed: Followed,
}

/// Nodes at a time; one that nothing follows where there are none.
fn carriers(nodes: CubeTensor, poses: CubeTensor) -> CubeTensor {
    let m = nodes.shape()[0];
    if m == 0 {
        return zeros(&nodes, [1, CARRIER], DType::F32);
    }
    let (nodes, poses) = (contiguous(nodes), contiguous(poses));
    let out = empty(&nodes, [m, CARRIER], DType::F32);
    let (count, dim) = units(&out.client, m);
    carry::launch(
        &out.client,
        count,
        dim,
        nodes.into_buffer_arg(),
        poses.into_buffer_arg(),
        out.clone().into_buffer_arg(),
    );
    out
}

fn poses(kept: &BlendKept) -> CubeTensor {
    let n = kept.followers.shape()[0];
    let out = empty(&kept.followers, [n, DELTAS], DType::F32);
    let (count, dim) = units(&out.client, n);
    follow_nodes::launch(
        &out.client,
        count,
        dim,
        kept.carriers.clone().into_buffer_arg(),
        kept.followers.clone().into_buffer_arg(),
        kept.followed.neighbors.clone().into_buffer_arg(),
        out.clone().into_buffer_arg(),
        kept.followed.row,
    );
    out
}

/// Cotangents `[n, FOLLOWER]` of Gaussians, and `[n row, SUMS]` of each of their nodes.
fn v_followers(kept: &BlendKept, v_poses: CubeTensor) -> [CubeTensor; 2] {
    let BlendKept { carriers, followers, followed, .. } = kept;
    let (n, slots, client) = (followers.shape()[0], followed.neighbors.shape()[0], &followers.client);
    let out = [empty(followers, [n, FOLLOWER], DType::F32), empty(followers, [slots, SUMS], DType::F32)];
    let v_weights = empty(followers, [slots], DType::F32);
    let (count, dim) = units(client, n);
    follow_nodes_vjp::launch(
        client,
        count.clone(),
        dim,
        carriers.clone().into_buffer_arg(),
        followers.clone().into_buffer_arg(),
        followed.neighbors.clone().into_buffer_arg(),
        contiguous(v_poses).into_buffer_arg(),
        out[0].clone().into_buffer_arg(),
        out[1].clone().into_buffer_arg(),
        v_weights.clone().into_buffer_arg(),
        followed.row,
    );
    if followed.row > 0 {
        weights_vjp::launch(
            client,
            count,
            dim,
            carriers.clone().into_buffer_arg(),
            followers.clone().into_buffer_arg(),
            followed.neighbors.clone().into_buffer_arg(),
            v_weights.into_buffer_arg(),
            out[0].clone().into_buffer_arg(),
            out[1].clone().into_buffer_arg(),
            followed.row,
        );
    }
    out
}

/// Cotangents of nodes and of their poses.
fn v_nodes(kept: &BlendKept, v_carriers: CubeTensor) -> [CubeTensor; 2] {
    let (m, client) = (kept.nodes, &kept.carriers.client);
    if kept.followed.row == 0 {
        return [NODE, DELTAS].map(|width| zeros(&kept.carriers, [m, width], DType::F32));
    }
    let sums = empty(&kept.carriers, [m, SUMS], DType::F32);
    let (count, dim) = units(client, m * SUMS);
    sum_followers::launch(
        client,
        count,
        dim,
        v_carriers.into_buffer_arg(),
        kept.followed.begins.clone().into_buffer_arg(),
        kept.followed.members.clone().into_buffer_arg(),
        sums.clone().into_buffer_arg(),
    );
    let out = [NODE, DELTAS].map(|width| empty(&kept.carriers, [m, width], DType::F32));
    let (count, dim) = units(client, m);
    carry_vjp::launch(
        client,
        count,
        dim,
        kept.carriers.clone().into_buffer_arg(),
        sums.into_buffer_arg(),
        out[0].clone().into_buffer_arg(),
        out[1].clone().into_buffer_arg(),
    );
    out
}

impl Kernel<Neighbors, 5> for CubeBackend {
    type Kept = BlendKept;

    fn forward_kept(
        neighbors: &Neighbors,
        [nodes, node_poses, means, rotations, features]: [FloatTensor<Self>; 5],
    ) -> (FloatTensor<Self>, BlendKept) {
        let _span = tracing::trace_span!("blend of nodes").entered();
        let m = nodes.shape()[0];
        let followed = followed(neighbors, m, &means);
        let followers = contiguous(Self::float_cat(vec![means, rotations, features], 1));
        let kept = BlendKept { nodes: m, carriers: carriers(nodes, node_poses), followers, followed };
        (poses(&kept), kept)
    }

    fn vjp(_: &Neighbors, kept: BlendKept, v_poses: FloatTensor<Self>) -> [FloatTensor<Self>; 5] {
        let _span = tracing::trace_span!("blend of nodes, backward").entered();
        let [v_followers, v_carriers] = v_followers(&kept, v_poses);
        let [v_nodes, v_node_poses] = v_nodes(&kept, v_carriers);
        let n = v_followers.shape()[0];
        let part = |from: usize, to: usize| {
            Self::float_slice(v_followers.clone(), &[(0..n).into(), (from..to).into()])
        };
        [v_nodes, v_node_poses, part(0, 3), part(3, 7), part(7, 10)]
    }
}
