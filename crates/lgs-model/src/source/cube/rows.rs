//! Kernels of the deformation network, a unit per Gaussian: the encoding of positions, and poses from the
//! network's raw outputs (`super::super::pose`) with their vector–Jacobian product.

use cubecl::prelude::*;
use lgs_tensor::cube::quaternions::{conjugate, exponential, product};
use lgs_tensor::cube::vectors::{numbers, write};

use super::quaternions::{exponential_vjp, rotate, rotate_vjp, unit, write_unit_vjp};

/// Numbers of a raw row and of a pose row (`DELTAS`).
const ROW: usize = 10;
/// Numbers of the cotangent of a Gaussian: centre and quaternion.
pub(super) const GAUSSIAN: usize = 7;
/// Motion heads as kernels are told of them: a displacement is neither of these.
pub(super) const TURN: u32 = 1;
pub(super) const RIGID: u32 = 2;

/// The map of positions before encoding.
#[derive(CubeType, CubeLaunch, Clone, Copy)]
pub(super) struct Map {
    pub(super) x: f32,
    pub(super) y: f32,
    pub(super) z: f32,
    pub(super) scale: f32,
}

#[cube]
fn center(map: &Map, k: usize) -> f32 {
    select(k == 0usize, map.x, select(k == 1usize, map.y, map.z))
}

/// Encodings `[n, 3 (1 + 2 frequencies)]` of positions, a unit per number: the mapped position, then sines
/// and cosines of its multiples by powers of two.
#[cube(launch)]
pub(super) fn encode(means: &[f32], out: &mut [f32], map: Map, #[comptime] frequencies: usize) {
    let width = comptime!((3 * (1 + 2 * frequencies)) as u32);
    if ABSOLUTE_POS < out.len() {
        let (i, column) = (ABSOLUTE_POS as u32 / width, ABSOLUTE_POS as u32 % width);
        let k = column % 3u32;
        let local = (means[(3u32 * i + k) as usize] - center(&map, k as usize)) / map.scale;
        let mut value = local;
        if column >= 3u32 {
            // A sine, then a cosine, of each power.
            let block = column / 3u32 - 1u32;
            let mut angle = local;
            for _ in 0..block / 2u32 {
                angle = 2.0f32 * angle;
            }
            value = select(block & 1u32 == 0u32, angle.sin(), angle.cos());
        }
        out[ABSOLUTE_POS] = value;
    }
}

/// The turn of a head that has one: of a quaternion, or of a rotation vector.
#[cube]
fn turn_of(raw: &[f32], at: usize, #[comptime] head: u32) -> Array<f32> {
    if comptime!(head == TURN) {
        let mut turn = unit(raw, at);
        if turn[4usize] <= 1e-12f32 {
            turn[0usize] = 1.0f32;
            turn[1usize] = 0.0f32;
            turn[2usize] = 0.0f32;
            turn[3usize] = 0.0f32;
            // Without a direction the length counts as one.
            turn[4usize] = 1.0f32;
        }
        turn
    } else {
        exponential(raw, at)
    }
}

/// The offset of a Gaussian from the centre of the map.
#[cube]
fn offset(means: &[f32], i: usize, map: &Map) -> Array<f32> {
    let mut u = Array::<f32>::new(3usize);
    for k in 0..3usize {
        u[k] = means[3usize * i + k] - center(map, k);
    }
    u
}

/// Pose rows from raw rows, centres and quaternions.
#[cube(launch)]
pub(super) fn poses(
    raw: &[f32],
    means: &[f32],
    rotations: &[f32],
    out: &mut [f32],
    map: Map,
    #[comptime] head: u32,
) {
    if ABSOLUTE_POS * ROW < raw.len() {
        let i = ABSOLUTE_POS;
        let row = i * ROW;
        let q = unit(rotations, 4usize * i);
        for k in 0..3usize {
            out[row + k] = means[3usize * i + k] + raw[row + k];
            out[row + 7usize + k] = raw[row + 7usize + k];
        }
        if comptime!(head == TURN || head == RIGID) {
            let turn = turn_of(raw, row + 3usize, head);
            let turned = product(&turn, &q);
            write(out, row + 3usize, &turned, 4usize);
            if comptime!(head == RIGID) {
                let from_center = rotate(&turn, &offset(means, i, &map));
                for k in 0..3usize {
                    out[row + k] = center(&map, k) + from_center[k] + map.scale * raw[row + k];
                }
            }
        } else {
            for k in 0..4usize {
                out[row + 3usize + k] = q[k] + raw[row + 3usize + k];
            }
        }
    }
}

/// Cotangents of raw rows, and `[n, GAUSSIAN]` of centres and quaternions, given those of pose rows.
#[cube(launch)]
pub(super) fn poses_vjp(
    raw: &[f32],
    means: &[f32],
    rotations: &[f32],
    v_poses: &[f32],
    v_raw: &mut [f32],
    v_gaussians: &mut [f32],
    map: Map,
    #[comptime] head: u32,
) {
    let i = ABSOLUTE_POS;
    let row = i * ROW;
    if row < raw.len() {
        let q = unit(rotations, 4usize * i);
        for k in 0..3usize {
            v_raw[row + k] = v_poses[row + k];
            v_raw[row + 7usize + k] = v_poses[row + 7usize + k];
            v_gaussians[i * GAUSSIAN + k] = v_poses[row + k];
        }
        let mut v_unit = numbers(v_poses, row + 3usize, 4usize);
        write(v_raw, row + 3usize, &v_unit, 4usize);
        if comptime!(head == TURN || head == RIGID) {
            let turn = turn_of(raw, row + 3usize, head);
            let v_turn = product(&v_unit, &conjugate(&q));
            v_unit = product(&conjugate(&turn), &v_unit);
            if comptime!(head == TURN) {
                write_unit_vjp(&turn, &v_turn, v_raw, row + 3usize);
            } else {
                let u = offset(means, i, &map);
                rigid_vjp(raw, &turn, &u, &v_turn, v_raw, v_gaussians, (i, map.scale));
            }
        }
        write_unit_vjp(&q, &v_unit, v_gaussians, i * GAUSSIAN + 3usize);
    }
}

/// Cotangents of the rotation vector, the shift and the centre of a rigid head.
#[cube]
fn rigid_vjp(
    raw: &[f32],
    turn: &Array<f32>,
    u: &Array<f32>,
    v_turn: &Array<f32>,
    v_raw: &mut [f32],
    v_gaussians: &mut [f32],
    place: (usize, f32),
) {
    let (i, scale) = place;
    let row = i * ROW;
    let v = numbers(&*v_raw, row, 3usize);
    let mut v_q = rotate_vjp(turn, u, &v);
    for k in 0..4usize {
        v_q[k] = v_q[k] + v_turn[k];
    }
    let v_w = exponential_vjp(raw, row + 3usize, &v_q);
    let back = rotate(&conjugate(turn), &v);
    for k in 0..3usize {
        v_raw[row + k] = scale * v[k];
        v_raw[row + 3usize + k] = v_w[k];
        v_gaussians[i * GAUSSIAN + k] = back[k];
    }
    v_raw[row + 6usize] = 0.0f32;
}
