//! Kernels of the way back through a step and its acceleration, a unit per particle.

use cubecl::prelude::*;
use lgs_tensor::cube::vectors::{cross, dot, numbers, write, zeros};

use super::ends::sigmoid;
use super::field::{Kinds, NETWORK, Range, STATE, STRUCTURED, Scales, curved, on_tape, softplus, state_at};
use super::tables::*;
use crate::system::DAMPING_SHIFT;

/// Cotangents of a particle's position before a step and of its velocity after the kick: its row of `[n, 6]`;
/// or those of the state after a step without alignment `[n, STATE]`, where q₁ = q₀ + h v₁.
#[cube]
pub(super) fn kicked(from: &[f32], particle: usize, h: f32, is_step: bool) -> Array<f32> {
    let mut out = numbers(from, particle * select(is_step, STATE, 6usize), 6usize);
    if is_step {
        #[unroll]
        for k in 0..3usize {
            out[3 + k] = out[3 + k] + h * out[k];
        }
    }
    out
}

/// Cotangents of what a network gives, that of a force or with [`NONE`] that of the potential, given those of
/// velocities after the kick ([`kicked`]), of which a step of length h takes its part.
#[cube]
pub(super) fn seed(
    table: &[u32],
    tape: &mut [f32],
    states: &[f32],
    carried: &Array<f32>,
    row: u32,
    range: &Range,
    scales: &Scales,
    h: f32,
    of: u32,
) {
    let scale = select(of == NONE, scales.potential, scales.force);
    let place = select(of == NONE, table[V_GRADIENT], table[V_FORCE]);
    let mut v_out = Array::<f32>::new(3usize);
    #[unroll]
    for k in 0..3usize {
        v_out[k] = scale * (h * carried[3 + k]);
    }
    if of == STRUCTURED {
        let v = numbers(states, state_at(range, range.state, row) + 3usize, 3usize);
        let raw = tape[(table[FORCE] + row * FORCE_OUTPUTS as u32) as usize];
        let to = (place + row * FORCE_OUTPUTS as u32) as usize;
        tape[to] = -sigmoid(raw - DAMPING_SHIFT) * dot(&v_out, &v);
        // ⟨f̄, w × v⟩ = ⟨w, v × f̄⟩
        write(tape, to + 1usize, &cross(&v, &v_out), 3usize);
    } else {
        write(tape, (place + 3u32 * row) as usize, &v_out, 3usize);
    }
}

/// Where cotangents come from that a step's way back begins with, and whether there is a step.
#[derive(Clone, Copy, Debug, Hash, PartialEq, Eq)]
pub(super) enum Source {
    /// No step: an acceleration alone, of rows `carried`.
    Acceleration,
    /// Rows `carried` behind an alignment.
    Carried,
    /// The state after the step.
    State,
}

/// Cotangents of positions and velocities of a range through its acceleration: added to those that the step
/// has of them ([`kicked`]) and that the state has by itself, or alone.
#[cube(launch)]
pub(super) fn finish(
    weights: &[f32],
    table: &[u32],
    tape: &[f32],
    carried: &[f32],
    own: &[f32],
    adjoint: &mut [f32],
    range: Range,
    scales: Scales,
    h: f32,
    #[comptime] kinds: Kinds,
    #[comptime] source: Source,
) {
    let row = ABSOLUTE_POS as u32;
    if row < range.rows {
        let particle = (range.first + row) as usize;
        let v = if comptime!(source == Source::State) {
            kicked(&*adjoint, particle, h, true)
        } else {
            kicked(carried, particle, h, false)
        };
        let mut v_x = potential_vjp(weights, table, tape, row, kinds);
        let v_v = force_vjp(table, tape, &v, &mut v_x, row, h, &scales, kinds);
        let to = particle * STATE;
        #[unroll]
        for k in 0..3usize {
            adjoint[to + k] = v_x[k] * scales.per_length;
            adjoint[to + 3 + k] = v_v[k];
        }
        if comptime!(source != Source::Acceleration) {
            add_step(adjoint, &v, own, to, state_at(&range, range.state, row));
        }
    }
}

/// Adds cotangents of a step and those that the state has by itself.
#[cube]
fn add_step(adjoint: &mut [f32], v: &Array<f32>, own: &[f32], to: usize, from: usize) {
    #[unroll]
    for k in 0..6usize {
        adjoint[to + k] = adjoint[to + k] + v[k] + own[from + k];
    }
    #[unroll]
    for k in 6..STATE {
        adjoint[to + k] = adjoint[to + k] + own[from + k];
    }
}

/// The cotangent of a normalised position through the gradient of the potential.
#[cube]
fn potential_vjp(
    weights: &[f32],
    table: &[u32],
    tape: &[f32],
    row: u32,
    #[comptime] kinds: Kinds,
) -> Array<f32> {
    let mut v_x = on_tape(table, tape, V_POTENTIAL, row, 3u32);
    if comptime!(kinds.quadratic) {
        let pull = curved(weights, table, &on_tape(table, tape, V_GRADIENT, row, 3u32));
        #[unroll]
        for k in 0..3usize {
            v_x[k] = v_x[k] + pull[k];
        }
    }
    v_x
}

/// The cotangent of a velocity through the force; that of the normalised position is added.
#[cube]
fn force_vjp(
    table: &[u32],
    tape: &[f32],
    v: &Array<f32>,
    v_x: &mut Array<f32>,
    row: u32,
    h: f32,
    scales: &Scales,
    #[comptime] kinds: Kinds,
) -> Array<f32> {
    let mut v_v = zeros(3usize);
    if comptime!(kinds.force == NETWORK) {
        let at = (table[V_INPUTS] + row * STATE_INPUTS as u32) as usize;
        #[unroll]
        for k in 0..3usize {
            v_x[k] = v_x[k] + tape[at + k];
            v_v[k] = tape[at + 3 + k] * scales.per_speed;
        }
    }
    if comptime!(kinds.force == STRUCTURED) {
        let at = (table[V_INPUTS] + row * 3u32) as usize;
        let outputs = (table[FORCE] + row * FORCE_OUTPUTS as u32) as usize;
        let damping = softplus(tape[outputs] - DAMPING_SHIFT);
        let spin = numbers(tape, outputs + 1usize, 3usize);
        let mut of_force = Array::<f32>::new(3usize);
        #[unroll]
        for k in 0..3usize {
            v_x[k] = v_x[k] + tape[at + k];
            of_force[k] = scales.force * h * v[3 + k];
        }
        // ⟨f̄, w × v⟩ = ⟨v, f̄ × w⟩
        let turn = cross(&of_force, &spin);
        #[unroll]
        for k in 0..3usize {
            v_v[k] = turn[k] - damping * of_force[k];
        }
    }
    v_v
}

/// Cotangents of the last state, to begin with.
#[cube(launch)]
pub(super) fn begin_adjoint(own: &[f32], adjoint: &mut [f32], state: u32) {
    if ABSOLUTE_POS < adjoint.len() {
        adjoint[ABSOLUTE_POS] = own[state as usize * adjoint.len() + ABSOLUTE_POS];
    }
}

/// Cotangents of starting positions, and of velocities before they are scaled.
#[cube(launch)]
pub(super) fn end_adjoint(adjoint: &[f32], v_q: &mut [f32], v_v: &mut [f32], velocity_scale: f32) {
    let i = ABSOLUTE_POS;
    if i < v_q.len() / 3usize {
        #[unroll]
        for k in 0..3usize {
            v_q[3usize * i + k] = adjoint[i * STATE + k];
            v_v[3usize * i + k] = adjoint[i * STATE + 3 + k] * velocity_scale;
        }
    }
}
