//! Kernels of the blend, a unit per node or per Gaussian (`super::super::blend`).

use cubecl::prelude::*;
use lgs_tensor::cube::quaternions::{matrix, product};
use lgs_tensor::cube::vectors::write;

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
        write(carriers, c + TURN, &turn, 5usize);
        write(carriers, c + 16usize, &matrix(&turn), 9usize);
    }
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
        write(out, at + 3usize, &q, 4usize);
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
            write(out, at + 3usize, &turned, 4usize);
        }
    }
}
