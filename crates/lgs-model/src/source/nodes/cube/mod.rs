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
use lgs_tensor::cube::{CubeBackend, CubeTensor, arguments, contiguous, empty, units, zeros};

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
    let [of, by, to] = arguments([&nodes, &poses, &out]);
    carry::launch(&out.client, count, dim, of, by, to);
    out
}

fn poses(kept: &BlendKept) -> CubeTensor {
    let n = kept.followers.shape()[0];
    let out = empty(&kept.followers, [n, DELTAS], DType::F32);
    let (count, dim) = units(&out.client, n);
    let BlendKept { carriers, followers, followed, .. } = kept;
    let [by, of, neighbors, to] = arguments([carriers, followers, &followed.neighbors, &out]);
    follow_nodes::launch(&out.client, count, dim, by, of, neighbors, to, followed.row);
    out
}

/// Cotangents `[n, FOLLOWER]` of Gaussians, and `[n row, SUMS]` of each of their nodes.
fn v_followers(kept: &BlendKept, v_poses: CubeTensor) -> [CubeTensor; 2] {
    let BlendKept { carriers, followers, followed, .. } = kept;
    let (n, slots, client) = (followers.shape()[0], followed.neighbors.shape()[0], &followers.client);
    let out = [empty(followers, [n, FOLLOWER], DType::F32), empty(followers, [slots, SUMS], DType::F32)];
    let v_weights = empty(followers, [slots], DType::F32);
    let (count, dim) = units(client, n);
    let inputs = [carriers, followers, &followed.neighbors];
    let [by, of, neighbors] = arguments(inputs);
    let [v, to, to_slots, to_weights] = arguments([&contiguous(v_poses), &out[0], &out[1], &v_weights]);
    let row = followed.row;
    follow_nodes_vjp::launch(client, count.clone(), dim, by, of, neighbors, v, to, to_slots, to_weights, row);
    if row > 0 {
        let ([by, of, neighbors], [v, to, to_slots]) =
            (arguments(inputs), arguments([&v_weights, &out[0], &out[1]]));
        weights_vjp::launch(client, count, dim, by, of, neighbors, v, to, to_slots, row);
    }
    out
}

/// Cotangents of nodes and of their poses.
fn v_nodes(kept: &BlendKept, v_carriers: &CubeTensor) -> [CubeTensor; 2] {
    let (m, client) = (kept.nodes, &kept.carriers.client);
    if kept.followed.row == 0 {
        return [NODE, DELTAS].map(|width| zeros(&kept.carriers, [m, width], DType::F32));
    }
    let sums = empty(&kept.carriers, [m, SUMS], DType::F32);
    let (count, dim) = units(client, m * SUMS);
    let Followed { begins, members, .. } = &kept.followed;
    let [from, begins, members, to] = arguments([v_carriers, begins, members, &sums]);
    sum_followers::launch(client, count, dim, from, begins, members, to);
    let out = [NODE, DELTAS].map(|width| empty(&kept.carriers, [m, width], DType::F32));
    let (count, dim) = units(client, m);
    let [of, from, to_nodes, to_poses] = arguments([&kept.carriers, &sums, &out[0], &out[1]]);
    carry_vjp::launch(client, count, dim, of, from, to_nodes, to_poses);
    out
}

impl Kernel<Neighbors, 5> for CubeBackend {
    type Kept = BlendKept;

    fn forward_kept(
        neighbors: &Neighbors,
        [nodes, node_poses, means, rotations, features]: [FloatTensor<Self>; 5],
    ) -> (FloatTensor<Self>, BlendKept) {
        let m = nodes.shape()[0];
        let followed = followed(neighbors, m, &means);
        let followers = contiguous(Self::float_cat(vec![means, rotations, features], 1));
        let kept = BlendKept { nodes: m, carriers: carriers(nodes, node_poses), followers, followed };
        (poses(&kept), kept)
    }

    fn vjp(_: &Neighbors, kept: BlendKept, v_poses: FloatTensor<Self>) -> [FloatTensor<Self>; 5] {
        let [v_followers, v_carriers] = v_followers(&kept, v_poses);
        let [v_nodes, v_node_poses] = v_nodes(&kept, &v_carriers);
        let n = v_followers.shape()[0];
        let part = |from: usize, to: usize| {
            Self::float_slice(v_followers.clone(), &[(0..n).into(), (from..to).into()])
        };
        [v_nodes, v_node_poses, part(0, 3), part(3, 7), part(7, 10)]
    }
}
