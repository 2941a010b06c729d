//! How a Gaussian's nodes are mixed, in kernels: their weights and average turn (`super::super::mixture`).

use cubecl::prelude::*;

use super::super::mixture::LEAST_WEIGHT;
use crate::source::config::MAX_NEIGHBORS;

/// Numbers of a node at a time: position (0), features (3), share (6), squared radius inverted (7), place
/// (8), unit quaternion (11), its length before (15), matrix (16).
pub(super) const CARRIER: usize = 25;
/// Numbers of a Gaussian: centre (0), quaternion (3), features (7).
pub(super) const FOLLOWER: usize = 10;
/// Where the quaternion of a carrier begins.
pub(super) const TURN: usize = 11;
/// Where falls, distances and the sum of the weights stand in a mixture, behind the weights.
pub(super) const FALLS: usize = MAX_NEIGHBORS;
pub(super) const DISTANCES: usize = 2 * MAX_NEIGHBORS;
pub(super) const TOTAL: usize = 3 * MAX_NEIGHBORS;
/// Numbers of a mixture.
const MIXTURE: usize = TOTAL + 1;
/// Where the nodes' signs stand in an average turn, behind the unit quaternion and its length.
pub(super) const SIGNS: usize = 5;
/// Numbers of an average turn.
const AVERAGE: usize = SIGNS + MAX_NEIGHBORS;

/// Where the carrier of a Gaussian's node begins.
#[cube]
pub(super) fn carrier(neighbors: &[u32], i: usize, k: usize, #[comptime] row: usize) -> usize {
    neighbors[i * row + k] as usize * CARRIER
}

/// Weights of a Gaussian's nodes, of sum 1, with falls and squared distances.
#[cube]
pub(super) fn mixture(
    carriers: &[f32],
    followers: &[f32],
    neighbors: &[u32],
    i: usize,
    #[comptime] row: usize,
) -> Array<f32> {
    let mut out = Array::<f32>::new(MIXTURE);
    let f = i * FOLLOWER;
    let mut total = 0.0f32;
    for k in 0..row {
        let c = carrier(neighbors, i, k, row);
        let mut in_space = 0.0f32;
        let mut in_features = 0.0f32;
        for axis in 0..3usize {
            let away = followers[f + axis] - carriers[c + axis];
            let unlike = followers[f + 7usize + axis] - carriers[c + 3usize + axis];
            in_space += away * away;
            in_features += unlike * unlike;
        }
        in_space = in_space * carriers[c + 7usize];
        let fall = (-0.5f32 * (in_space + in_features)).exp();
        let weight = carriers[c + 6usize] * fall + LEAST_WEIGHT;
        out[k] = weight;
        out[FALLS + k] = fall;
        out[DISTANCES + k] = in_space;
        total += weight;
    }
    for k in 0..row {
        out[k] = out[k] / total;
    }
    out[TOTAL] = total;
    out
}

/// The average turn of a Gaussian's nodes, whose signs are those of the first.
#[cube]
pub(super) fn average(
    carriers: &[f32],
    neighbors: &[u32],
    mixture: &Array<f32>,
    i: usize,
    #[comptime] row: usize,
) -> Array<f32> {
    let mut out = Array::<f32>::new(AVERAGE);
    let first = carrier(neighbors, i, 0usize, row) + TURN;
    for j in 0..4usize {
        out[j] = 0.0f32;
    }
    for k in 0..row {
        let at = carrier(neighbors, i, k, row) + TURN;
        let mut along = 0.0f32;
        for j in 0..4usize {
            along += carriers[at + j] * carriers[first + j];
        }
        let sign = select(along < 0.0f32, -1.0f32, 1.0f32);
        out[SIGNS + k] = sign;
        for j in 0..4usize {
            out[j] = out[j] + mixture[k] * sign * carriers[at + j];
        }
    }
    let mut squares = 0.0f32;
    for j in 0..4usize {
        squares += out[j] * out[j];
    }
    let length = squares.sqrt().max(1e-12f32);
    for j in 0..4usize {
        out[j] = out[j] / length;
    }
    out[4usize] = length;
    out
}
