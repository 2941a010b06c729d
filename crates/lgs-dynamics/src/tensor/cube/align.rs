//! Kernels of the alignment around the fits of [`super::fits`], and their vector–Jacobian products
//! (method §4.6).
//!
//! On the way back every support leaves what it sends to its members in a row of its own; a unit per stretch
//! of a member's owners then sums those, and a unit per member the stretches, all in their order.

use cubecl::prelude::*;
use lgs_tensor::cube::quaternions::{conjugate, matrix, normalised, product};
use lgs_tensor::cube::vectors::{cross, numbers, write, zeros};

use super::field::{MOTION, STATE};
use super::fits::{FIT, fit_of, quaternion};
use super::rotation::{curvature, solve};
use super::vectors::{add_arrived, axial, part, pulled_back, rotated, rotated_back, taken};

/// Numbers of an aligned position with its rotation matrix.
pub(super) const ALIGNED: usize = 12;
/// Numbers that a support sends: `(V, b)` row by row (0), d (12), and what its owner alone gets (15).
pub(super) const PULL: usize = 18;
/// Numbers that a stretch of owners sends to a member: cotangents of position and candidate.
pub(super) const ARRIVED: usize = 6;

/// Treatment of velocities, as kernels are told of it; the rigid one is in [`super::carry`].
pub(super) const KEEP: u32 = 0;
pub(super) const FROM_POSITIONS: u32 = 1;
pub(super) const RIGID: u32 = 2;

/// Motions of the operation: positions and candidates, no velocities.
#[cube(launch)]
pub(super) fn pair_up(position: &[f32], candidate: &[f32], motion: &mut [f32]) {
    let i = ABSOLUTE_POS;
    if i < position.len() / 3usize {
        #[unroll]
        for k in 0..3usize {
            motion[i * MOTION + k] = position[3usize * i + k];
            motion[i * MOTION + 3 + k] = candidate[3usize * i + k];
            motion[i * MOTION + 6 + k] = 0.0f32;
        }
    }
}

/// A particle's aligned position.
#[cube]
fn aligned(motion: &[f32], fit: &Array<f32>, particle: usize) -> Array<f32> {
    let from_center = rotated(&matrix(&quaternion(fit)), &part(fit, 9usize));
    let mut out = Array::<f32>::new(3usize);
    #[unroll]
    for k in 0..3usize {
        out[k] = motion[particle * MOTION + 3 + k] + (fit[12 + k] + from_center[k]);
    }
    out
}

/// Aligned positions and rotation matrices `[n, ALIGNED]`.
#[cube(launch)]
pub(super) fn pack(motion: &[f32], fits: &[f32], packed: &mut [f32]) {
    let i = ABSOLUTE_POS;
    if i < packed.len() / ALIGNED {
        let fit = numbers(fits, i * FIT, FIT);
        write(packed, i * ALIGNED, &aligned(motion, &fit, i), 3usize);
        write(packed, i * ALIGNED + 3usize, &matrix(&quaternion(&fit)), 9usize);
    }
}

/// The states after a step, whose supports are fitted: aligned positions, velocities by their policy, and
/// rotations.
#[cube(launch)]
pub(super) fn advance(
    motion: &[f32],
    members: &[u32],
    states: &mut [f32],
    count: u32,
    state: u32,
    k: u32,
    per_h: f32,
    #[comptime] policy: u32,
) {
    let i = ABSOLUTE_POS;
    if i < count as usize {
        let from = (state as usize * count as usize + i) * STATE;
        let to = from + count as usize * STATE;
        let fit = fit_of(motion, members, i, k);
        let q = aligned(motion, &fit, i);
        #[unroll]
        for k in 0..3usize {
            states[to + k] = q[k];
            if comptime!(policy == FROM_POSITIONS) {
                states[to + 3 + k] = (q[k] - motion[i * MOTION + k]) * per_h;
            } else {
                states[to + 3 + k] = motion[i * MOTION + 6 + k];
            }
        }
        let turned = product(&quaternion(&fit), &numbers(&*states, from + 6usize, 4usize));
        write(states, to + 6usize, &normalised(&turned), 4usize);
    }
}

/// Cotangents of a particle's velocity after the kick and of its positions before and after a step, where
/// velocities do not come from the supports: sets its row `[n, 6]` of position and velocity before the
/// alignment, and adds to the cotangent of the position after it.
#[cube]
fn policy_vjp(adjoint: &mut [f32], carried: &mut [f32], i: usize, per_h: f32, #[comptime] policy: u32) {
    #[unroll]
    for k in 0..3usize {
        let v = adjoint[i * STATE + 3 + k];
        if comptime!(policy == FROM_POSITIONS) {
            adjoint[i * STATE + k] = adjoint[i * STATE + k] + v * per_h;
            carried[6usize * i + k] = -v * per_h;
            carried[6usize * i + 3 + k] = 0.0f32;
        } else {
            carried[6usize * i + k] = 0.0f32;
            carried[6usize * i + 3 + k] = v;
        }
    }
}

/// What supports send to their members and owners, given cotangents of the aligned positions and of rotation
/// matrices `[n, ALIGNED]`.
#[cube(launch)]
pub(super) fn pull(fits: &[f32], v_packed: &[f32], pulls: &mut [f32], k: u32) {
    let i = ABSOLUTE_POS;
    if i < fits.len() / FIT {
        let v = numbers(v_packed, i * ALIGNED, 3usize);
        let fit = numbers(fits, i * FIT, FIT);
        let r = matrix(&quaternion(&fit));
        let turn = axial(&pulled_back(&numbers(v_packed, i * ALIGNED + 3usize, 9usize), &r));
        send(&fit, pulls, i, &v, &turn, 1.0f32 / k as f32);
    }
}

/// The same of supports that are fitted, given cotangents of the states after a step; those of rotations are
/// replaced by those of the rotations before it. First comes the backward pass of the velocities' policy.
#[cube(launch)]
pub(super) fn pull_state(
    motion: &[f32],
    members: &[u32],
    states: &[f32],
    adjoint: &mut [f32],
    carried: &mut [f32],
    pulls: &mut [f32],
    count: u32,
    state: u32,
    k: u32,
    per_h: f32,
    #[comptime] policy: u32,
) {
    let i = ABSOLUTE_POS;
    if i < count as usize {
        if comptime!(policy != RIGID) {
            policy_vjp(adjoint, carried, i, per_h, policy);
        }
        let fit = fit_of(motion, members, i, k);
        let from = (state as usize * count as usize + i) * STATE + 6usize;
        let after = numbers(states, from + count as usize * STATE, 4usize);
        let v = across(&numbers(&*adjoint, i * STATE + 6usize, 4usize), &after);
        let v_before = product(&conjugate(&quaternion(&fit)), &v);
        write(adjoint, i * STATE + 6usize, &v_before, 4usize);
        let of_turn = product(&v_before, &conjugate(&numbers(states, from, 4usize)));
        let mut turn = Array::<f32>::new(3usize);
        #[unroll]
        for j in 0..3usize {
            turn[j] = 0.5f32 * of_turn[j + 1];
        }
        send(&fit, pulls, i, &numbers(&*adjoint, i * STATE, 3usize), &turn, 1.0f32 / k as f32);
    }
}

/// What a cotangent of a unit quaternion has across it.
#[cube]
fn across(v: &Array<f32>, q: &Array<f32>) -> Array<f32> {
    let mut along = 0.0f32;
    #[unroll]
    for j in 0..4usize {
        along += v[j] * q[j];
    }
    let mut out = Array::<f32>::new(4usize);
    #[unroll]
    for j in 0..4usize {
        out[j] = v[j] - along * q[j];
    }
    out
}

/// Writes what a support sends, given the cotangents of its aligned position and of a small turn in body axes
/// (`crate::align_vjp`).
#[cube]
fn send(fit: &Array<f32>, pulls: &mut [f32], i: usize, v: &Array<f32>, v_turn: &Array<f32>, per: f32) {
    let (d, c) = (part(fit, 9usize), part(fit, 12usize));
    let r = matrix(&quaternion(fit));
    let v_offset = rotated_back(&r, v);
    let mut of_turn = cross(&d, &v_offset);
    let per_scale = 1.0f32 / fit[19usize];
    #[unroll]
    for k in 0..3usize {
        of_turn[k] = (of_turn[k] + v_turn[k]) * per_scale;
    }
    let y = solve(&curvature(&pulled_back(&taken(fit, 0usize, 9usize), &r)), &of_turn);
    // V = R [y]×, whose rows are those of R times y.
    let mut v_a = zeros(9usize);
    #[unroll]
    for row in 0..3usize {
        let mut of_r = Array::<f32>::new(3usize);
        #[unroll]
        for k in 0..3usize {
            of_r[k] = r[3 * row + k];
        }
        let turned = cross(&of_r, &y);
        #[unroll]
        for k in 0..3usize {
            v_a[3 * row + k] = turned[k];
        }
    }
    let (of_d, of_c) = (rotated(&v_a, &d), rotated_back(&v_a, &c));
    let to = i * PULL;
    #[unroll]
    for row in 0..3usize {
        #[unroll]
        for k in 0..3usize {
            pulls[to + 4 * row + k] = v_a[3 * row + k];
        }
        pulls[to + 4 * row + 3] = v[row] * per + of_d[row];
        pulls[to + 12 + row] = -v_offset[row] * per - of_c[row];
        pulls[to + 15 + row] = v_offset[row];
    }
}

/// What stretches of owners send to their member `[stretches, ARRIVED]`; a stretch is its member and where
/// its owners begin and end.
#[cube(launch)]
pub(super) fn gather(motion: &[f32], pulls: &[f32], owners: &[u32], stretches: &[u32], arrived: &mut [f32]) {
    let i = ABSOLUTE_POS;
    if i < stretches.len() / 3usize {
        let member = stretches[3usize * i] as usize * MOTION;
        let mut sums = zeros(ARRIVED);
        for at in stretches[3usize * i + 1usize]..stretches[3usize * i + 2usize] {
            let owner = owners[at as usize] as usize;
            let pull = owner * PULL;
            let mut x = Array::<f32>::new(6usize);
            #[unroll]
            for k in 0..6usize {
                x[k] = motion[member + k] - motion[owner * MOTION + k];
            }
            #[unroll]
            for k in 0..3usize {
                let of_y = pulls[pull + k] * x[3usize]
                    + pulls[pull + 4 + k] * x[4usize]
                    + pulls[pull + 8 + k] * x[5usize];
                sums[k] = sums[k] + of_y + pulls[pull + 12 + k];
                let row = pull + 4 * k;
                let of_x = pulls[row] * x[0usize]
                    + pulls[row + 1usize] * x[1usize]
                    + pulls[row + 2usize] * x[2usize];
                sums[3 + k] = sums[3 + k] + of_x + pulls[row + 3usize];
            }
        }
        write(arrived, i * ARRIVED, &sums, ARRIVED);
    }
}

/// Cotangents `[n, 6]` of positions and candidates; in a step of length h, those of positions and velocities
/// after the kick, added to what is there.
#[cube(launch)]
pub(super) fn collect(
    pulls: &[f32],
    arrived: &[f32],
    begins: &[u32],
    carried: &mut [f32],
    h: f32,
    #[comptime] is_step: bool,
) {
    let i = ABSOLUTE_POS;
    if i < carried.len() / 6usize {
        let mut sums = zeros(ARRIVED);
        #[unroll]
        for k in 0..3usize {
            sums[k] = pulls[i * PULL + 15 + k];
        }
        add_arrived(&mut sums, arrived, begins, i, ARRIVED);
        #[unroll]
        for k in 0..3usize {
            let to = 6usize * i + k;
            if comptime!(is_step) {
                // A candidate is q₀ + h v₁.
                carried[to] = carried[to] + sums[k] + sums[3 + k];
                carried[to + 3usize] = carried[to + 3usize] + h * sums[3 + k];
            } else {
                carried[to] = sums[k];
                carried[to + 3usize] = sums[3 + k];
            }
        }
    }
}
