//! Kernels of the integration through the velocity field, a unit per Gaussian (`super::super::twist`).
//!
//! A Gaussian's twists lie in a row: that at the start of each step, then that at its middle.
#![allow(clippy::manual_memcpy, reason = "kernels have no slices to copy")]

use cubecl::prelude::*;
use lgs_tensor::cube::quaternions::{conjugate, normalised, product};
use lgs_tensor::cube::vectors::{cross, numbers, plus, write};

use super::super::twist::TWIST;
use crate::source::config::DELTAS;

/// Forms of the rotation as kernels are told of them; Gaussians do not turn in any other.
pub(super) const REFERENCE: u32 = 1;
pub(super) const FIXED: u32 = 2;

/// A point moved for a time by the velocity that a twist has at another one.
#[cube]
fn moved(twists: &[f32], at: usize, p: &Array<f32>, there: &Array<f32>, h: f32) -> Array<f32> {
    let turning = cross(&numbers(twists, at + 3usize, 3usize), there);
    let straight = plus(p, &numbers(twists, at, 3usize), h);
    plus(&straight, &turning, -h)
}

/// The point half a step on, by the twist at its start.
#[cube]
fn halfway(twists: &[f32], at: usize, p: &Array<f32>, h: f32) -> Array<f32> {
    moved(twists, at, p, p, 0.5f32 * h)
}

/// Where a Gaussian is after so many steps.
#[cube]
fn after(twists: &[f32], first: usize, steps: &[f32], start: &Array<f32>, count: usize) -> Array<f32> {
    let mut p = plus(start, start, 0.0f32);
    for s in 0..count {
        let at = first + 2usize * TWIST * s;
        let half = halfway(twists, at, &p, steps[s]);
        p = moved(twists, at + TWIST, &p, &half, steps[s]);
    }
    p
}

/// Pose rows after the integration, and the turns along it.
#[cube(launch)]
pub(super) fn carry_rows(
    twists: &[f32],
    steps: &[f32],
    rows: &[f32],
    out: &mut [f32],
    turns: &mut [f32],
    #[comptime] form: u32,
) {
    let i = ABSOLUTE_POS;
    let row = i * DELTAS;
    if row < rows.len() {
        let first = 2usize * TWIST * steps.len() * i;
        let p = after(twists, first, steps, &numbers(rows, row, 3usize), steps.len());
        let turn = turn_along(twists, first, steps, form);
        write(turns, 4usize * i, &turn, 4usize);
        let turned = product(&turn, &numbers(rows, row + 3usize, 4usize));
        write(out, row + 3usize, &turned, 4usize);
        for k in 0..3usize {
            out[row + k] = p[k];
            out[row + 7usize + k] = rows[row + 7usize + k];
        }
    }
}

/// The quaternion of the rotation along the steps, from the angular velocities at their middles.
#[cube]
fn turn_along(twists: &[f32], first: usize, steps: &[f32], #[comptime] form: u32) -> Array<f32> {
    let mut q = Array::<f32>::new(4usize);
    q[0usize] = 1.0f32;
    for k in 1..4usize {
        q[k] = 0.0f32;
    }
    if comptime!(form == FIXED) {
        for s in 0..steps.len() {
            let at = first + 2usize * TWIST * s + TWIST + 3usize;
            q = normalised(&product(&exponential(twists, at, -steps[s]), &q));
        }
    }
    if comptime!(form == REFERENCE) {
        let mut m = Array::<f32>::new(9usize);
        for k in 0..9usize {
            m[k] = select(k % 4usize == 0usize, 1.0f32, 0.0f32);
        }
        for s in 0..steps.len() {
            let at = first + 2usize * TWIST * s + TWIST + 3usize;
            m = turned_by(twists, at, -steps[s], &m);
        }
        let w = 0.5f32 * (1.0f32 + m[0usize] + m[4usize] + m[8usize]).sqrt();
        q[0usize] = w;
        q[1usize] = (m[7usize] - m[5usize]) / (4.0f32 * w);
        q[2usize] = (m[2usize] - m[6usize]) / (4.0f32 * w);
        q[3usize] = (m[3usize] - m[1usize]) / (4.0f32 * w);
    }
    q
}

/// The quaternion of a multiple of the rotation vector at a place.
#[cube]
fn exponential(values: &[f32], at: usize, h: f32) -> Array<f32> {
    let mut squares = 0.0f32;
    for k in 0..3usize {
        squares += values[at + k] * values[at + k];
    }
    let angle = squares.sqrt() * h.abs();
    let small = angle <= 1e-6f32;
    let factor = select(small, 0.5f32, (0.5f32 * angle).sin() / select(small, 1.0f32, angle));
    let mut q = Array::<f32>::new(4usize);
    q[0usize] = (0.5f32 * angle).cos();
    for k in 0..3usize {
        q[k + 1usize] = factor * h * values[at + k];
    }
    q
}

/// `(I + [h w]×) m` for the vector w at a place.
#[cube]
fn turned_by(values: &[f32], at: usize, h: f32, m: &Array<f32>) -> Array<f32> {
    let mut out = Array::<f32>::new(9usize);
    for k in 0..3usize {
        let (i, j) = ((k + 1usize) % 3usize, (k + 2usize) % 3usize);
        for column in 0..3usize {
            let turning = values[at + i] * m[3usize * j + column] - values[at + j] * m[3usize * i + column];
            out[3usize * k + column] = m[3usize * k + column] + h * turning;
        }
    }
    out
}

/// Cotangents of the twists, and of the rows before the integration, which reach quaternions through the turn
/// and positions as they are.
#[cube(launch)]
pub(super) fn carry_rows_vjp(
    twists: &[f32],
    steps: &[f32],
    rows: &[f32],
    turns: &[f32],
    v: &[f32],
    v_twists: &mut [f32],
    v_rows: &mut [f32],
) {
    let i = ABSOLUTE_POS;
    let row = i * DELTAS;
    if row < rows.len() {
        let first = 2usize * TWIST * steps.len() * i;
        let start = numbers(rows, row, 3usize);
        let mut v_p = numbers(v, row, 3usize);
        for back in 0..steps.len() {
            let s = steps.len() - 1usize - back;
            let (at, h) = (first + 2usize * TWIST * s, steps[s]);
            let p = after(twists, first, steps, &start, s);
            let half = halfway(twists, at, &p, h);
            let v_half = twist_vjp(twists, at + TWIST, &half, &v_p, h, v_twists);
            let v_start = twist_vjp(twists, at, &p, &v_half, 0.5f32 * h, v_twists);
            v_p = plus(&plus(&v_p, &v_half, 1.0f32), &v_start, 1.0f32);
        }
        for k in 0..DELTAS {
            v_rows[row + k] = v[row + k];
        }
        let turn = numbers(turns, 4usize * i, 4usize);
        let before = product(&conjugate(&turn), &numbers(v, row + 3usize, 4usize));
        write(v_rows, row + 3usize, &before, 4usize);
    }
}

/// Writes the cotangent of a twist, given that of the point it moved for a time; gives that of the point
/// where its velocity was taken.
#[cube]
fn twist_vjp(
    twists: &[f32],
    at: usize,
    there: &Array<f32>,
    v: &Array<f32>,
    h: f32,
    v_twists: &mut [f32],
) -> Array<f32> {
    let turned = cross(v, there);
    for k in 0..3usize {
        v_twists[at + k] = h * v[k];
        v_twists[at + 3usize + k] = h * turned[k];
    }
    let back = cross(&numbers(twists, at + 3usize, 3usize), v);
    plus(&plus(&back, &back, -1.0f32), &back, h)
}
