//! Kernels of the blend, a unit per node or per Gaussian (`super::super::blend`).

use cubecl::prelude::*;
use lgs_tensor::cube::quaternions::product;

use super::mixture::{CARRIER, FOLLOWER, TURN, average, carrier, mixture};
use crate::source::config::DELTAS;
use crate::source::cube::quaternions::unit;
use crate::source::nodes::node::NODE;

/// Nodes at a time.
#[cube(launch)]
pub(super) fn carry(nodes: &[f32], poses: &[f32], carriers: &mut [f32]) {
    let i = ABSOLUTE_POS;
    if i < nodes.len() / NODE {
        let n = i * NODE;
        let p = i * DELTAS;
        let c = i * CARRIER;
        for axis in 0..3usize {
            carriers[c + axis] = nodes[n + axis];
            carriers[c + 3usize + axis] = nodes[n + 5usize + axis];
            carriers[c + 8usize + axis] = poses[p + axis];
        }
        carriers[c + 6usize] = 1.0f32 / (1.0f32 + (-nodes[n + 4usize]).exp());
        carriers[c + 7usize] = (-2.0f32 * nodes[n + 3usize]).exp();
        let turn = unit(poses, p + 3usize);
        for j in 0..5usize {
            carriers[c + TURN + j] = turn[j];
        }
        write_matrix(&turn, carriers, c + 16usize);
    }
}

/// Writes the matrix of a unit quaternion.
#[cube]
fn write_matrix(q: &Array<f32>, out: &mut [f32], at: usize) {
    let w = q[0usize];
    let x = q[1usize];
    let y = q[2usize];
    let z = q[3usize];
    out[at] = 1.0f32 - 2.0f32 * (y * y + z * z);
    out[at + 1usize] = 2.0f32 * (x * y - w * z);
    out[at + 2usize] = 2.0f32 * (x * z + w * y);
    out[at + 3usize] = 2.0f32 * (x * y + w * z);
    out[at + 4usize] = 1.0f32 - 2.0f32 * (x * x + z * z);
    out[at + 5usize] = 2.0f32 * (y * z - w * x);
    out[at + 6usize] = 2.0f32 * (x * z - w * y);
    out[at + 7usize] = 2.0f32 * (y * z + w * x);
    out[at + 8usize] = 1.0f32 - 2.0f32 * (x * x + y * y);
}

/// A coordinate of where a node carries a Gaussian.
#[cube]
pub(super) fn carried(carriers: &[f32], followers: &[f32], c: usize, f: usize, axis: usize) -> f32 {
    let m = c + 16usize + 3usize * axis;
    let mut place = carriers[c + 8usize + axis];
    for j in 0..3usize {
        place += carriers[m + j] * (followers[f + j] - carriers[c + j]);
    }
    place
}

/// Pose rows of Gaussians that follow `row` nodes each.
#[cube(launch)]
pub(super) fn follow_nodes(
    carriers: &[f32],
    followers: &[f32],
    neighbors: &[u32],
    out: &mut [f32],
    #[comptime] row: usize,
) {
    let i = ABSOLUTE_POS;
    let f = i * FOLLOWER;
    let at = i * DELTAS;
    if f < followers.len() {
        let q = unit(followers, f + 3usize);
        for axis in 0..3usize {
            out[at + axis] = followers[f + axis];
            out[at + 7usize + axis] = 0.0f32;
        }
        for j in 0..4usize {
            out[at + 3usize + j] = q[j];
        }
        if comptime!(row > 0) {
            let mixture = mixture(carriers, followers, neighbors, i, row);
            for axis in 0..3usize {
                let mut place = 0.0f32;
                for k in 0..row {
                    let c = carrier(neighbors, i, k, row);
                    place += mixture[k] * carried(carriers, followers, c, f, axis);
                }
                out[at + axis] = place;
            }
            let turned = product(&average(carriers, neighbors, &mixture, i, row), &q);
            for j in 0..4usize {
                out[at + 3usize + j] = turned[j];
            }
        }
    }
}
