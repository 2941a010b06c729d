//! Velocities that supports carry through a step as rigid bodies, and their vector–Jacobian product
//! (`crate::twist`, method §4.6).

use cubecl::prelude::*;
use lgs_tensor::cube::vectors::{cross, dot, numbers, plus, write, zeros};

use super::field::{MOTION, STATE};
use super::rotation::{factor, solve};
use super::vectors::{add_arrived, part};
use crate::thresholds::LEAST_SCALE;

/// Numbers of a support's twist on the way back: means at the start (0) and the middle (3) of the step, mean
/// velocity (6), spin (9), `I⁻¹ ω̄` (12), cotangents of the mean in the middle (15) and of the mean velocity
/// (18), and whether it is a body (21).
pub(super) const TWIST: usize = 22;
/// Numbers that a stretch of owners sends to a member: cotangents of its position at the start and in the
/// middle, and of its velocity.
pub(super) const CARRIED: usize = 9;

/// A support's twist: means at the start and the middle, mean velocity (0 to 8), spin (9), and the factor of
/// its inertia over its scale (12), the scale (19).
#[cube]
fn twist(motion: &[f32], states: &[f32], members: &[u32], owner: usize, after: usize, k: u32) -> Array<f32> {
    let mut means = zeros(9usize);
    let per = 1.0f32 / k as f32;
    let own = offsets(motion, states, owner, after);
    for slot in 0..k {
        let member = members[owner * k as usize + slot as usize] as usize;
        let x = offsets(motion, states, member, after);
        #[unroll]
        for i in 0..9usize {
            means[i] = means[i] + (x[i] - own[i]) * per;
        }
    }
    #[unroll]
    for i in 0..9usize {
        means[i] = own[i] + means[i];
    }
    let mut momentum = zeros(3usize);
    let mut second = zeros(6usize);
    for slot in 0..k {
        let member = members[owner * k as usize + slot as usize] as usize;
        let mut x = offsets(motion, states, member, after);
        #[unroll]
        for i in 0..9usize {
            x[i] = x[i] - means[i];
        }
        let turning = cross(&part(&x, 0usize), &part(&x, 6usize));
        momentum = plus(&momentum, &turning, 1.0f32);
        let (rx, ry, rz) = (x[3usize], x[4usize], x[5usize]);
        second[0usize] = second[0usize] + rx * rx;
        second[1usize] = second[1usize] + ry * rx;
        second[2usize] = second[2usize] + ry * ry;
        second[3usize] = second[3usize] + rz * rx;
        second[4usize] = second[4usize] + rz * ry;
        second[5usize] = second[5usize] + rz * rz;
    }
    with_spin(&means, &momentum, &second)
}

/// Means, the spin of a momentum, and the inertia that second moments make.
#[cube]
fn with_spin(means: &Array<f32>, momentum: &Array<f32>, second: &Array<f32>) -> Array<f32> {
    let scale = second[0usize] + second[2usize] + second[5usize];
    let is_body = scale > LEAST_SCALE && scale < 1.0f32 / LEAST_SCALE;
    let per_scale = select(is_body, 1.0f32 / scale, 0.0f32);
    let mut inertia = Array::<f32>::new(6usize);
    inertia[0usize] = (second[2usize] + second[5usize]) * per_scale;
    inertia[1usize] = -second[1usize] * per_scale;
    inertia[2usize] = (second[0usize] + second[5usize]) * per_scale;
    inertia[3usize] = -second[3usize] * per_scale;
    inertia[4usize] = -second[4usize] * per_scale;
    inertia[5usize] = (second[0usize] + second[2usize]) * per_scale;
    let factor = factor(&inertia, select(is_body, 1.0f32, 0.0f32));
    let mut out = Array::<f32>::new(20usize);
    #[unroll]
    for i in 0..9usize {
        out[i] = means[i];
    }
    let spin = solve(&factor, momentum);
    #[unroll]
    for i in 0..3usize {
        out[9 + i] = spin[i] * per_scale;
    }
    #[unroll]
    for i in 0..7usize {
        out[12 + i] = factor[i];
    }
    out[19usize] = select(is_body, scale, 1.0f32);
    out
}

/// A particle's position before a step and in its middle, and its velocity after the kick.
#[cube]
fn offsets(motion: &[f32], states: &[f32], particle: usize, after: usize) -> Array<f32> {
    let mut out = Array::<f32>::new(9usize);
    #[unroll]
    for k in 0..3usize {
        let q = motion[particle * MOTION + k];
        out[k] = q;
        out[3 + k] = q + 0.5f32 * (states[after + particle * STATE + k] - q);
        out[6 + k] = motion[particle * MOTION + 6 + k];
    }
    out
}

/// Replaces velocities in the state that begins at `after` by those that supports have as bodies; degenerate
/// ones leave them.
#[cube(launch)]
pub(super) fn carry(motion: &[f32], members: &[u32], states: &mut [f32], after: u32, k: u32) {
    let i = ABSOLUTE_POS;
    if i < motion.len() / MOTION {
        let after = after as usize;
        let twist = twist(motion, &*states, members, i, after, k);
        if twist[18usize] > 0.0f32 {
            let own = offsets(motion, &*states, i, after);
            let arm = plus(&part(&own, 3usize), &part(&twist, 3usize), -1.0f32);
            let v = plus(&part(&twist, 6usize), &cross(&part(&twist, 9usize), &arm), 1.0f32);
            write(states, after + i * STATE + 3usize, &v, 3usize);
        }
    }
}

/// What supports send to their members `[n, TWIST]`, given cotangents of the state that begins at `after`.
#[cube(launch)]
pub(super) fn twist_vjp(
    motion: &[f32],
    members: &[u32],
    states: &[f32],
    adjoint: &[f32],
    twists: &mut [f32],
    after: u32,
    k: u32,
) {
    let i = ABSOLUTE_POS;
    if i < motion.len() / MOTION {
        let after = after as usize;
        let twist = twist(motion, states, members, i, after, k);
        let v = numbers(adjoint, i * STATE + 3usize, 3usize);
        let own = offsets(motion, states, i, after);
        let spin = part(&twist, 9usize);
        let arm = plus(&part(&own, 3usize), &part(&twist, 3usize), -1.0f32);
        let mut factor = Array::<f32>::new(7usize);
        #[unroll]
        for j in 0..7usize {
            factor[j] = twist[12 + j];
        }
        let y = solve(&factor, &cross(&arm, &v));
        let v_arm = cross(&v, &spin);
        let per = 1.0f32 / k as f32;
        let to = i * TWIST;
        #[unroll]
        for j in 0..12usize {
            twists[to + j] = twist[j];
        }
        #[unroll]
        for j in 0..3usize {
            twists[to + 12 + j] = y[j] / twist[19usize];
            twists[to + 15 + j] = -v_arm[j] * per;
            twists[to + 18 + j] = v[j] * per;
        }
        twists[to + 21usize] = twist[18usize];
    }
}

/// What stretches of owners send to their member `[stretches, CARRIED]`.
#[cube(launch)]
pub(super) fn gather_twists(
    motion: &[f32],
    states: &[f32],
    twists: &[f32],
    owners: &[u32],
    stretches: &[u32],
    arrived: &mut [f32],
    after: u32,
) {
    let i = ABSOLUTE_POS;
    if i < stretches.len() / 3usize {
        let own = offsets(motion, states, stretches[3usize * i] as usize, after as usize);
        let mut sums = zeros(CARRIED);
        for at in stretches[3usize * i + 1usize]..stretches[3usize * i + 2usize] {
            let twist = owners[at as usize] as usize * TWIST;
            if twists[twist + 21usize] > 0.0f32 {
                let mut x = Array::<f32>::new(9usize);
                #[unroll]
                for j in 0..9usize {
                    x[j] = own[j] - twists[twist + j];
                }
                let spin = numbers(twists, twist + 9usize, 3usize);
                let y = numbers(twists, twist + 12usize, 3usize);
                let r = part(&x, 3usize);
                let of_start = cross(&part(&x, 6usize), &y);
                let of_velocity = cross(&y, &part(&x, 0usize));
                let (y_spin, r_spin, y_r) = (dot(&y, &spin), dot(&r, &spin), dot(&y, &r));
                #[unroll]
                for j in 0..3usize {
                    // ω = I⁻¹L: ⟨ω̄, dω⟩ = ⟨y, dL⟩ − yᵀ dI ω
                    let of_inertia = y[j] * r_spin + spin[j] * y_r - 2.0f32 * r[j] * y_spin;
                    sums[j] = sums[j] + of_start[j];
                    sums[3 + j] = sums[3 + j] + of_inertia + twists[twist + 15 + j];
                    sums[6 + j] = sums[6 + j] + of_velocity[j] + twists[twist + 18 + j];
                }
            }
        }
        write(arrived, i * CARRIED, &sums, CARRIED);
    }
}

/// Cotangents `[n, 6]` of positions before a step and of velocities after its kick; those of positions after
/// it are added to.
#[cube(launch)]
pub(super) fn collect_twists(
    twists: &[f32],
    arrived: &[f32],
    begins: &[u32],
    adjoint: &mut [f32],
    carried: &mut [f32],
) {
    let i = ABSOLUTE_POS;
    if i < carried.len() / 6usize {
        let v = numbers(&*adjoint, i * STATE + 3usize, 3usize);
        let is_body = twists[i * TWIST + 21usize] > 0.0f32;
        // A degenerate support's velocity is kept, and so is its cotangent.
        let of_arm = cross(&v, &numbers(twists, i * TWIST + 9usize, 3usize));
        let mut sums = zeros(CARRIED);
        #[unroll]
        for j in 0..3usize {
            sums[3 + j] = select(is_body, of_arm[j], 0.0f32);
            sums[6 + j] = select(is_body, 0.0f32, v[j]);
        }
        add_arrived(&mut sums, arrived, begins, i, CARRIED);
        #[unroll]
        for j in 0..3usize {
            let of_end = 0.5f32 * sums[3 + j];
            carried[6usize * i + j] = sums[j] + of_end;
            carried[6usize * i + 3 + j] = sums[6 + j];
            adjoint[i * STATE + j] = adjoint[i * STATE + j] + of_end;
        }
    }
}
