//! Kernels of the way back through a step and its acceleration, a unit per particle.

use cubecl::prelude::*;
use lgs_tensor::cube::vectors::{cross, dot, numbers, write, zeros};

use super::ends::sigmoid;
use super::field::{Kinds, NETWORK, Range, STATE, STRUCTURED, Scales, curved, on_tape, softplus, state_at};
use super::tables::*;
use crate::system::DAMPING_SHIFT;

/// Cotangents of the networks' outputs, given those of velocities after the kick: the second half of each row
/// of `carried`, of which a step of length h takes its part.
#[cube(launch)]
pub(super) fn seed(
    table: &[u32],
    tape: &mut [f32],
    states: &[f32],
    carried: &[f32],
    range: Range,
    scales: Scales,
    h: f32,
    #[comptime] kinds: Kinds,
) {
    let row = ABSOLUTE_POS as u32;
    if row < range.rows {
        let particle = (range.first + row) as usize;
        let mut of_force = Array::<f32>::new(3usize);
        #[unroll]
        for k in 0..3usize {
            let v_a = h * carried[6usize * particle + 3 + k];
            tape[(table[V_GRADIENT] + 3u32 * row) as usize + k] = scales.potential * v_a;
            of_force[k] = scales.force * v_a;
        }
        if comptime!(kinds.force == NETWORK) {
            write(tape, (table[V_FORCE] + 3u32 * row) as usize, &of_force, 3usize);
        }
        if comptime!(kinds.force == STRUCTURED) {
            let v = numbers(states, state_at(&range, range.state, row) + 3usize, 3usize);
            let raw = tape[(table[FORCE] + row * FORCE_OUTPUTS as u32) as usize];
            let to = (table[V_FORCE] + row * FORCE_OUTPUTS as u32) as usize;
            tape[to] = -sigmoid(raw - DAMPING_SHIFT) * dot(&of_force, &v);
            // ⟨f̄, w × v⟩ = ⟨w, v × f̄⟩
            write(tape, to + 1usize, &cross(&v, &of_force), 3usize);
        }
    }
}

/// Cotangents of positions and velocities of a range through its acceleration: added to those that `carried`
/// has of them and that the state has by itself, or alone.
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
    #[comptime] is_step: bool,
) {
    let row = ABSOLUTE_POS as u32;
    if row < range.rows {
        let particle = (range.first + row) as usize;
        let mut v_x = potential_vjp(weights, table, tape, row, kinds);
        let v_v = force_vjp(table, tape, carried, &mut v_x, row, (particle, h), &scales, kinds);
        let to = particle * STATE;
        #[unroll]
        for k in 0..3usize {
            let mut of_q = v_x[k] * scales.per_length;
            let mut of_v = v_v[k];
            if comptime!(is_step) {
                let from = state_at(&range, range.state, row);
                of_q = of_q + carried[6usize * particle + k] + own[from + k];
                of_v = of_v + carried[6usize * particle + 3 + k] + own[from + 3 + k];
            }
            adjoint[to + k] = of_q;
            adjoint[to + 3 + k] = of_v;
        }
        if comptime!(is_step) {
            let from = state_at(&range, range.state, row);
            #[unroll]
            for k in 6..STATE {
                adjoint[to + k] = adjoint[to + k] + own[from + k];
            }
        }
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
    carried: &[f32],
    v_x: &mut Array<f32>,
    row: u32,
    step: (usize, f32),
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
        let (particle, h) = step;
        let at = (table[V_INPUTS] + row * 3u32) as usize;
        let outputs = (table[FORCE] + row * FORCE_OUTPUTS as u32) as usize;
        let damping = softplus(tape[outputs] - DAMPING_SHIFT);
        let spin = numbers(tape, outputs + 1usize, 3usize);
        let mut of_force = Array::<f32>::new(3usize);
        #[unroll]
        for k in 0..3usize {
            v_x[k] = v_x[k] + tape[at + k];
            of_force[k] = scales.force * h * carried[6usize * particle + 3 + k];
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

/// Cotangents `[n, 6]` of positions and of velocities after the kick, given those of the state after a step
/// without alignment: q₁ = q₀ + h v₁.
#[cube(launch)]
pub(super) fn drift_vjp(adjoint: &[f32], carried: &mut [f32], h: f32) {
    let i = ABSOLUTE_POS;
    if i < carried.len() / 6usize {
        #[unroll]
        for k in 0..3usize {
            let v_q = adjoint[i * STATE + k];
            carried[6usize * i + k] = v_q;
            carried[6usize * i + 3 + k] = adjoint[i * STATE + 3 + k] + h * v_q;
        }
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
