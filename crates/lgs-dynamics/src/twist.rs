//! The `Rigid` velocity policy: a particle's velocity is replaced by the least-squares twist of its support, taken at the particle.
//!
//! With midpoints m = (q₀ + q₁)/2 of the step, `ω = I⁻¹ Σ r × (v − v̄)`, `r = m − m̄`, `I = Σ (|r|² − r rᵀ)`, and the new velocity is
//! `v̄ + ω × (m − m̄)`. For a rigid displacement `q₁ − q₀ = (R − 1) q₀ + t` is a twist of the midpoints exactly, since
//! `(R − 1)(R + 1)⁻¹` is skew (Cayley): rigid motions are fixed points of the policy for steps of any size. Degenerate supports keep v.

use crate::kabsch::Cholesky;
use crate::supports::Supports;
use lgs_core::linear::{add, cross, dot, scale, sub};
use rayon::prelude::*;

const CHUNK: usize = 128;

/// A support's twist.
struct Twist {
    mean: [f32; 3],
    mean_velocity: [f32; 3],
    spin: [f32; 3],
    /// None where the support is degenerate.
    inertia: Option<Cholesky>,
}

fn twist(m: &[[f32; 3]], v: &[[f32; 3]], members: &[u32], owner: usize) -> Twist {
    let per = 1.0 / members.len() as f32;
    let (m0, v0) = (m[owner], v[owner]);
    let (mut offset, mut velocity) = ([0.0; 3], [0.0; 3]);
    for &member in members {
        offset = add(offset, sub(m[member as usize], m0));
        velocity = add(velocity, sub(v[member as usize], v0));
    }
    let (mean, mean_velocity) = (add(m0, scale(offset, per)), add(v0, scale(velocity, per)));
    let (mut momentum, mut second) = ([0.0_f32; 3], [0.0_f32; 6]);
    for &member in members {
        let r = sub(m[member as usize], mean);
        let u = sub(v[member as usize], mean_velocity);
        momentum = add(momentum, cross(r, u));
        for (sum, value) in second.iter_mut().zip([r[0] * r[0], r[1] * r[0], r[1] * r[1], r[2] * r[0], r[2] * r[1], r[2] * r[2]]) {
            *sum += value;
        }
    }
    let [xx, yx, yy, zx, zy, zz] = second.map(f64::from);
    let inertia = Cholesky::new([yy + zz, -yx, xx + zz, -zx, -zy, xx + yy], xx + yy + zz);
    let spin = inertia.map_or([0.0; 3], |i| i.solve(momentum.map(f64::from)).map(|v| v as f32));
    Twist { mean, mean_velocity, spin, inertia }
}

/// Velocities `[n, 3]` of the least-squares twists of the supports at positions `m`, `[n, 3]`, each taken at its particle.
///
/// Beside the `Rigid` policy this removes independent noise from fitted starting velocities (reference G29).
#[must_use]
pub fn rigid_velocities(m: &[[f32; 3]], v: &[[f32; 3]], supports: &Supports) -> Vec<[f32; 3]> {
    let (m, v) = (&supports.to_slots(m), &supports.to_slots(v));
    let own = |owner: usize| {
        let t = twist(m, v, supports.slot_members(owner), owner);
        if t.inertia.is_none() { v[owner] } else { add(t.mean_velocity, cross(t.spin, sub(m[owner], t.mean))) }
    };
    let of_slots: Vec<_> = (0..m.len()).into_par_iter().with_min_len(CHUNK).map(own).collect();
    supports.to_particles(&of_slots)
}

/// What one support sends back to its members.
struct Pull {
    twist: Twist,
    /// `I⁻¹ ω̄`.
    y: [f32; 3],
    v_mean: [f32; 3],
    v_mean_velocity: [f32; 3],
}

/// Backwards through [`rigid_velocities`]: cotangents of `m` and `v`.
pub(crate) fn rigid_velocity_vjp(
    m: &[[f32; 3]],
    v: &[[f32; 3]],
    supports: &Supports,
    v_out: &[[f32; 3]],
) -> (Vec<[f32; 3]>, Vec<[f32; 3]>) {
    let per = 1.0 / supports.k() as f32;
    let [m, v, v_out] = &[m, v, v_out].map(|values| supports.to_slots(values));
    let pull = |owner: usize| {
        let twist = twist(m, v, supports.slot_members(owner), owner);
        let v_arm = cross(v_out[owner], twist.spin);
        let v_spin = cross(sub(m[owner], twist.mean), v_out[owner]);
        let y = twist.inertia.map_or([0.0; 3], |i| i.solve(v_spin.map(f64::from)).map(|v| v as f32));
        Pull { twist, y, v_mean: scale(v_arm, -per), v_mean_velocity: scale(v_out[owner], per) }
    };
    let pulls: Vec<Pull> = (0..m.len()).into_par_iter().with_min_len(CHUNK).map(pull).collect();
    let member_vjp = |member: usize| {
        let own = &pulls[member].twist;
        if own.inertia.is_none() {
            // Kept velocities pass their cotangent on; below, the same support sends nothing to its members.
            return gather(m, v, supports, &pulls, member, [0.0; 3], v_out[member]);
        }
        gather(m, v, supports, &pulls, member, cross(v_out[member], own.spin), [0.0; 3])
    };
    let (v_m, v_v): (Vec<_>, Vec<_>) = (0..m.len()).into_par_iter().with_min_len(CHUNK).map(member_vjp).unzip();
    (supports.to_particles(&v_m), supports.to_particles(&v_v))
}

/// Sums what the supports of a member send to it, on top of the given cotangents.
fn gather(
    m: &[[f32; 3]],
    v: &[[f32; 3]],
    supports: &Supports,
    pulls: &[Pull],
    member: usize,
    mut v_m: [f32; 3],
    mut v_v: [f32; 3],
) -> ([f32; 3], [f32; 3]) {
    for &owner in supports.slot_owners(member) {
        let p = &pulls[owner as usize];
        if p.twist.inertia.is_none() {
            continue;
        }
        let (y, spin) = (p.y, p.twist.spin);
        let r = sub(m[member], p.twist.mean);
        let u = sub(v[member], p.twist.mean_velocity);
        v_v = add(v_v, add(cross(y, r), p.v_mean_velocity));
        // ω = I⁻¹L: ⟨ω̄, dω⟩ = ⟨y, dL⟩ − yᵀ dI ω
        let of_momentum = cross(u, y);
        let of_inertia = add(scale(r, -2.0 * dot(y, spin)), add(scale(y, dot(r, spin)), scale(spin, dot(y, r))));
        v_m = add(v_m, add(add(of_momentum, of_inertia), p.v_mean));
    }
    (v_m, v_v)
}
