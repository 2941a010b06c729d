//! Kernels around the networks of a system, a unit per particle: what enters them, the acceleration that
//! comes out, and the step it makes (Eq. 4, 5 and 9; method §4.1, §4.2).

use cubecl::prelude::*;
use lgs_tensor::cube::vectors::{cross, numbers, write};

use super::tables::*;
use crate::system::DAMPING_SHIFT;

/// Numbers of a particle's state: position, velocity, rotation.
pub(super) const STATE: usize = 10;
/// Numbers of a particle's motion over a step that will be aligned: position, candidate and velocity after
/// the kick.
pub(super) const MOTION: usize = 9;
/// Below this the logarithm of 1 + x comes from its series, whose error is that of rounding.
const SMALL: f32 = 0.0625;

/// Forces, as kernels are told of them; there is none of any other number.
pub(super) const NETWORK: u32 = 1;
pub(super) const STRUCTURED: u32 = 2;

/// The function classes of a system.
#[derive(Clone, Copy, Debug, Hash, PartialEq, Eq)]
pub(super) struct Kinds {
    pub(super) force: u32,
    pub(super) quadratic: bool,
}

/// What becomes of an acceleration.
#[derive(Clone, Copy, Debug, Hash, PartialEq, Eq)]
pub(super) enum Use {
    /// It is the result `[n, 3]`.
    Result,
    /// A step without alignment: the next state.
    Step,
    /// A step whose end will be aligned: motions `[n, MOTION]`.
    Candidate,
}

/// Scales of a system with its edit.
#[derive(CubeType, CubeLaunch, Clone, Copy)]
pub(super) struct Scales {
    pub(super) x: f32,
    pub(super) y: f32,
    pub(super) z: f32,
    pub(super) per_length: f32,
    pub(super) per_speed: f32,
    /// −β σ_a: from the gradient of the normalised potential to an acceleration.
    pub(super) potential: f32,
    /// γ σ_a, or γ σ_a / σ_v for the structured force.
    pub(super) force: f32,
}

/// Particles of a call: the first of a range among `count`, and the length of the range.
#[derive(CubeType, CubeLaunch, Clone, Copy)]
pub(super) struct Range {
    pub(super) first: u32,
    pub(super) rows: u32,
    pub(super) count: u32,
    /// The state that is read.
    pub(super) state: u32,
}

/// Where a particle's state begins.
#[cube]
pub(super) fn state_at(range: &Range, state: u32, row: u32) -> usize {
    (state * range.count + range.first + row) as usize * STATE
}

/// The first state, of velocities that are scaled and of no rotation.
#[cube(launch)]
pub(super) fn begin(q: &[f32], v: &[f32], states: &mut [f32], velocity_scale: f32) {
    let i = ABSOLUTE_POS;
    if i < q.len() / 3usize {
        #[unroll]
        for k in 0..3usize {
            states[i * STATE + k] = q[3usize * i + k];
            states[i * STATE + 3 + k] = v[3usize * i + k] * velocity_scale;
            states[i * STATE + 7 + k] = 0.0f32;
        }
        states[i * STATE + 6usize] = 1.0f32;
    }
}

/// A particle's normalised position and velocity, for one network or the other, neither of which reads what
/// is the other's.
#[cube]
pub(super) fn normalise(
    states: &[f32],
    table: &[u32],
    tape: &mut [f32],
    row: u32,
    range: &Range,
    scales: &Scales,
    is_potential: bool,
) {
    let from = state_at(range, range.state, row);
    let place = select(is_potential, table[STATES], table[FORCE_STATES]);
    let to = (place + row * STATE_INPUTS as u32) as usize;
    tape[to] = (states[from] - scales.x) * scales.per_length;
    tape[to + 1usize] = (states[from + 1usize] - scales.y) * scales.per_length;
    tape[to + 2usize] = (states[from + 2usize] - scales.z) * scales.per_length;
    #[unroll]
    for k in 3..6usize {
        tape[to + k] = states[from + k] * scales.per_speed;
    }
}

/// Three numbers of a particle in an array of the tape.
#[cube]
pub(super) fn on_tape(
    table: &[u32],
    tape: &[f32],
    #[comptime] place: usize,
    row: u32,
    stride: u32,
) -> Array<f32> {
    numbers(tape, (table[place] + row * stride) as usize, 3usize)
}

/// `S x` for the quadratic coefficients S (xx, yy, zz, xy, xz, yz) behind the linear ones.
#[cube]
pub(super) fn curved(weights: &[f32], table: &[u32], x: &Array<f32>) -> Array<f32> {
    let s = table[QUADRATIC] as usize + 3usize;
    let mut out = Array::<f32>::new(3usize);
    out[0usize] = weights[s] * x[0usize] + weights[s + 3usize] * x[1usize] + weights[s + 4usize] * x[2usize];
    out[1usize] =
        weights[s + 3usize] * x[0usize] + weights[s + 1usize] * x[1usize] + weights[s + 5usize] * x[2usize];
    out[2usize] =
        weights[s + 4usize] * x[0usize] + weights[s + 5usize] * x[1usize] + weights[s + 2usize] * x[2usize];
    out
}

/// `ln(1 + e^x)`.
#[cube]
pub(super) fn softplus(x: f32) -> f32 {
    let e = (-x.abs()).exp();
    let series = e * (1.0f32 - e * (0.5f32 - e * (1.0f32 / 3.0f32 - e * (0.25f32 - e * 0.2f32))));
    x.max(0.0f32) + select(e < SMALL, series, (1.0f32 + e).ln())
}

/// The acceleration of a particle that moves with a velocity, from what the networks left on the tape.
#[cube]
fn acceleration(
    weights: &[f32],
    table: &[u32],
    tape: &[f32],
    v: &Array<f32>,
    row: u32,
    scales: &Scales,
    #[comptime] kinds: Kinds,
) -> Array<f32> {
    let mut a = on_tape(table, tape, GRADIENT, row, 3u32);
    if comptime!(kinds.quadratic) {
        let pull = curved(weights, table, &on_tape(table, tape, STATES, row, STATE_INPUTS as u32));
        #[unroll]
        for k in 0..3usize {
            a[k] = a[k] + weights[table[QUADRATIC] as usize + k] + pull[k];
        }
    }
    #[unroll]
    for k in 0..3usize {
        a[k] = scales.potential * a[k];
    }
    if comptime!(kinds.force == NETWORK) {
        let force = on_tape(table, tape, FORCE, row, 3u32);
        #[unroll]
        for k in 0..3usize {
            a[k] = a[k] + scales.force * force[k];
        }
    }
    if comptime!(kinds.force == STRUCTURED) {
        let at = (table[FORCE] + row * FORCE_OUTPUTS as u32) as usize;
        let damping = softplus(tape[at] - DAMPING_SHIFT);
        let turn = cross(&numbers(tape, at + 1usize, 3usize), v);
        #[unroll]
        for k in 0..3usize {
            a[k] = a[k] + scales.force * (turn[k] - damping * v[k]);
        }
    }
    a
}

/// Accelerations of a range, and what they are for: the next state lies behind the one that is read.
#[cube(launch)]
pub(super) fn accelerate(
    weights: &[f32],
    table: &[u32],
    tape: &[f32],
    states: &mut [f32],
    out: &mut [f32],
    range: Range,
    scales: Scales,
    h: f32,
    #[comptime] kinds: Kinds,
    #[comptime] purpose: Use,
) {
    let row = ABSOLUTE_POS as u32;
    if row < range.rows {
        let v = numbers(&*states, state_at(&range, range.state, row) + 3usize, 3usize);
        let a = acceleration(weights, table, tape, &v, row, &scales, kinds);
        if comptime!(purpose == Use::Result) {
            write(out, 3usize * (range.first + row) as usize, &a, 3usize);
        } else {
            step(states, out, &a, row, &range, h, purpose);
        }
    }
}

/// Writes the step of a particle with an acceleration (Eq. 5).
#[cube]
fn step(
    states: &mut [f32],
    out: &mut [f32],
    a: &Array<f32>,
    row: u32,
    range: &Range,
    h: f32,
    #[comptime] purpose: Use,
) {
    let from = state_at(range, range.state, row);
    let to = state_at(range, range.state + 1u32, row);
    let motion = (range.first + row) as usize * MOTION;
    #[unroll]
    for k in 0..3usize {
        let q = states[from + k];
        let kicked = states[from + 3 + k] + h * a[k];
        if comptime!(purpose == Use::Step) {
            states[to + k] = q + h * kicked;
            states[to + 3 + k] = kicked;
        } else {
            out[motion + k] = q;
            out[motion + 3 + k] = q + h * kicked;
            out[motion + 6 + k] = kicked;
        }
    }
    if comptime!(purpose == Use::Step) {
        #[unroll]
        for k in 6..STATE {
            states[to + k] = states[from + k];
        }
    }
}
