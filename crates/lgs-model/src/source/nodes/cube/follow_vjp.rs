//! The vector–Jacobian product of the blend.
//!
//! A unit per Gaussian leaves the cotangents of each of its nodes in a place of its own; a unit per node and
//! number then sums those of the node's followers in their order, so that no atomics are needed.

use cubecl::prelude::*;
use lgs_tensor::cube::quaternions::{conjugate, product};
use lgs_tensor::cube::vectors::numbers;

use super::follow::carried;
use super::mixture::{CARRIER, DISTANCES, FALLS, FOLLOWER, SIGNS, TOTAL, TURN, average, carrier, mixture};
use crate::source::config::DELTAS;
use crate::source::cube::quaternions::{unit, unit_vjp, write_unit_vjp};
use crate::source::nodes::node::NODE;

/// Numbers of a node's cotangents: matrix (0), place (9), unit quaternion (12), logarithm of the radius (16),
/// logit (17), features (18).
pub(super) const SUMS: usize = 21;

/// Cotangents of centres and quaternions, of each node's frame, and of each weight `[n, row]`.
#[cube(launch)]
pub(super) fn follow_nodes_vjp(
    carriers: &[f32],
    followers: &[f32],
    neighbors: &[u32],
    v_poses: &[f32],
    v_followers: &mut [f32],
    v_carriers: &mut [f32],
    v_weights: &mut [f32],
    #[comptime] row: usize,
) {
    let i = ABSOLUTE_POS;
    let f = i * FOLLOWER;
    if f < followers.len() {
        let q = unit(followers, f + 3usize);
        let mut v_q = begin(v_poses, i * DELTAS, v_followers, f, row);
        if comptime!(row > 0) {
            let mixture = mixture(carriers, followers, neighbors, i, row);
            let turn = average(carriers, neighbors, &mixture, i, row);
            let v_sum = unit_vjp(&turn, &product(&v_q, &conjugate(&q)));
            v_q = product(&conjugate(&turn), &v_q);
            for k in 0..row {
                let c = carrier(neighbors, i, k, row);
                let s = (i * row + k) * SUMS;
                let mut v_weight = 0.0f32;
                for j in 0..4usize {
                    v_weight += turn[SIGNS + k] * v_sum[j] * carriers[c + TURN + j];
                    v_carriers[s + 12usize + j] = mixture[k] * turn[SIGNS + k] * v_sum[j];
                }
                for axis in 0..3usize {
                    let v = v_poses[i * DELTAS + axis];
                    v_weight += v * carried(carriers, followers, c, f, axis);
                    axis_vjp(carriers, followers, (c, f, s, axis), mixture[k] * v, v_followers, v_carriers);
                }
                v_weights[i * row + k] = v_weight;
            }
        }
        write_unit_vjp(&q, &v_q, v_followers, f + 3usize);
    }
}

/// The cotangent of the quaternion of a pose; those of a Gaussian's centre and features begin at zero, or
/// with that of the pose where it follows no node.
#[cube]
fn begin(v_poses: &[f32], p: usize, v_followers: &mut [f32], f: usize, #[comptime] row: usize) -> Array<f32> {
    for axis in 0..3usize {
        v_followers[f + 7usize + axis] = 0.0f32;
        if comptime!(row > 0) {
            v_followers[f + axis] = 0.0f32;
        } else {
            v_followers[f + axis] = v_poses[p + axis];
        }
    }
    numbers(v_poses, p + 3usize, 4usize)
}

/// Cotangents of a node's frame and of a Gaussian's centre, given that of a coordinate of the place.
#[cube]
fn axis_vjp(
    carriers: &[f32],
    followers: &[f32],
    place: (usize, usize, usize, usize),
    v: f32,
    v_followers: &mut [f32],
    v_carriers: &mut [f32],
) {
    let (c, f, s, axis) = place;
    v_carriers[s + 9usize + axis] = v;
    for j in 0..3usize {
        v_carriers[s + 3usize * axis + j] = v * (followers[f + j] - carriers[c + j]);
        v_followers[f + j] = v_followers[f + j] + v * carriers[c + 16usize + 3usize * axis + j];
    }
}

/// Cotangents of features, and of each node's radius, logit and features, given those of the weights.
#[cube(launch)]
pub(super) fn weights_vjp(
    carriers: &[f32],
    followers: &[f32],
    neighbors: &[u32],
    v_weights: &[f32],
    v_followers: &mut [f32],
    v_carriers: &mut [f32],
    #[comptime] row: usize,
) {
    let i = ABSOLUTE_POS;
    let f = i * FOLLOWER;
    if f < followers.len() {
        let mixture = mixture(carriers, followers, neighbors, i, row);
        let mut along = 0.0f32;
        for k in 0..row {
            along += mixture[k] * v_weights[i * row + k];
        }
        for k in 0..row {
            let c = carrier(neighbors, i, k, row);
            let s = (i * row + k) * SUMS;
            let share = carriers[c + 6usize];
            let v = (v_weights[i * row + k] - along) / mixture[TOTAL] * mixture[FALLS + k] * share;
            v_carriers[s + 16usize] = v * mixture[DISTANCES + k];
            v_carriers[s + 17usize] = v * (1.0f32 - share);
            for axis in 0..3usize {
                let v_feature = v * (followers[f + 7usize + axis] - carriers[c + 3usize + axis]);
                v_carriers[s + 18usize + axis] = v_feature;
                v_followers[f + 7usize + axis] = v_followers[f + 7usize + axis] - v_feature;
            }
        }
    }
}

/// Sums over the followers of each node, a unit per node and number.
#[cube(launch)]
pub(super) fn sum_followers(v_carriers: &[f32], begins: &[u32], members: &[u32], sums: &mut [f32]) {
    if ABSOLUTE_POS < sums.len() {
        let node = ABSOLUTE_POS / SUMS;
        let number = ABSOLUTE_POS % SUMS;
        let mut sum = 0.0f32;
        for at in begins[node] as usize..begins[node + 1usize] as usize {
            sum += v_carriers[members[at] as usize * SUMS + number];
        }
        sums[ABSOLUTE_POS] = sum;
    }
}

/// Cotangents of nodes and of their poses.
#[cube(launch)]
pub(super) fn carry_vjp(carriers: &[f32], sums: &[f32], v_nodes: &mut [f32], v_poses: &mut [f32]) {
    let i = ABSOLUTE_POS;
    if i < carriers.len() / CARRIER {
        let s = i * SUMS;
        let turn = numbers(carriers, i * CARRIER + TURN, 5usize);
        let mut v_turn = matrix_vjp(&turn, sums, s);
        for j in 0..4usize {
            v_turn[j] = v_turn[j] + sums[s + 12usize + j];
        }
        for axis in 0..3usize {
            v_nodes[i * NODE + axis] = 0.0f32;
            v_nodes[i * NODE + 5usize + axis] = sums[s + 18usize + axis];
            v_poses[i * DELTAS + axis] = sums[s + 9usize + axis];
            v_poses[i * DELTAS + 7usize + axis] = 0.0f32;
        }
        v_nodes[i * NODE + 3usize] = sums[s + 16usize];
        v_nodes[i * NODE + 4usize] = sums[s + 17usize];
        write_unit_vjp(&turn, &v_turn, v_poses, i * DELTAS + 3usize);
    }
}

/// The cotangent of a unit quaternion, given that of its matrix at a place.
#[cube]
fn matrix_vjp(q: &Array<f32>, v: &[f32], at: usize) -> Array<f32> {
    let mut out = Array::<f32>::new(4usize);
    let trace = v[at] + v[at + 4usize] + v[at + 8usize];
    out[0usize] = 0.0f32;
    for a in 0..3usize {
        let b = (a + 1usize) % 3usize;
        let c = (a + 2usize) % 3usize;
        let odd = v[at + 3usize * c + b] - v[at + 3usize * b + c];
        out[0usize] = out[0usize] + 2.0f32 * q[a + 1usize] * odd;
        let with_b = q[b + 1usize] * (v[at + 3usize * a + b] + v[at + 3usize * b + a]);
        let with_c = q[c + 1usize] * (v[at + 3usize * a + c] + v[at + 3usize * c + a]);
        let own = 2.0f32 * q[a + 1usize] * (trace - v[at + 4usize * a]);
        out[a + 1usize] = 2.0f32 * (q[0usize] * odd + with_b + with_c - own);
    }
    out
}
