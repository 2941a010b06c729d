//! Kernels around the networks of a system, a unit per particle: what enters them, the acceleration that
//! comes out, the step it makes, and the way back (Eq. 4, 5 and 9; method §4.1, §4.2).

use cubecl::prelude::*;

use super::products::sigmoid;
use super::tables::*;
use super::vectors::{cross, dot, numbers, write, zeros};
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
fn state_at(range: &Range, state: u32, row: u32) -> usize {
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

/// Normalised positions and velocities of a range.
#[cube(launch)]
pub(super) fn normalise(states: &[f32], table: &[u32], tape: &mut [f32], range: Range, scales: Scales) {
    let row = ABSOLUTE_POS as u32;
    if row < range.rows {
        let from = state_at(&range, range.state, row);
        let to = (table[STATES] + row * STATE_INPUTS as u32) as usize;
        tape[to] = (states[from] - scales.x) * scales.per_length;
        tape[to + 1usize] = (states[from + 1usize] - scales.y) * scales.per_length;
        tape[to + 2usize] = (states[from + 2usize] - scales.z) * scales.per_length;
        #[unroll]
        for k in 3..6usize {
            tape[to + k] = states[from + k] * scales.per_speed;
        }
    }
}

/// Three numbers of a particle in an array of the tape.
#[cube]
fn on_tape(table: &[u32], tape: &[f32], #[comptime] place: usize, row: u32, stride: u32) -> Array<f32> {
    numbers(tape, (table[place] + row * stride) as usize, 3usize)
}

/// `S x` for the quadratic coefficients S (xx, yy, zz, xy, xz, yz) behind the linear ones.
#[cube]
fn curved(weights: &[f32], table: &[u32], x: &Array<f32>) -> Array<f32> {
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
fn softplus(x: f32) -> f32 {
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
        let from = state_at(&range, range.state, row);
        let v = numbers(&*states, from + 3usize, 3usize);
        let a = acceleration(weights, table, tape, &v, row, &scales, kinds);
        let particle = (range.first + row) as usize;
        if comptime!(purpose == Use::Result) {
            write(out, 3usize * particle, &a, 3usize);
        } else {
            let to = select(
                comptime!(purpose == Use::Step),
                state_at(&range, range.state + 1u32, row),
                particle * MOTION,
            );
            #[unroll]
            for k in 0..3usize {
                let q = states[from + k];
                let kicked = v[k] + h * a[k];
                if comptime!(purpose == Use::Step) {
                    states[to + k] = q + h * kicked;
                    states[to + 3 + k] = kicked;
                } else {
                    out[to + k] = q;
                    out[to + 3 + k] = q + h * kicked;
                    out[to + 6 + k] = kicked;
                }
            }
            if comptime!(purpose == Use::Step) {
                #[unroll]
                for k in 6..STATE {
                    states[to + k] = states[from + k];
                }
            }
        }
    }
}

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
        let mut v_x = on_tape(table, tape, V_POTENTIAL, row, 3u32);
        if comptime!(kinds.quadratic) {
            let pull = curved(weights, table, &on_tape(table, tape, V_GRADIENT, row, 3u32));
            #[unroll]
            for k in 0..3usize {
                v_x[k] = v_x[k] + pull[k];
            }
        }
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
