//! Rollouts into the past (method §4.4).
//!
//! `NegatedStep` is the forward scheme with −h (Eq. 8). `Exact` inverts the forward step: drift back with the
//! velocity that is known, `q₀ = q₁ − h v₁`, then solve `v₀ + h a(q₀, v₀) = v₁`. Where the force is linear in
//! velocity that is a 3×3 system per particle, without force it is explicit, otherwise a fixed point. With
//! supports the drifted positions are candidates, aligned with the shapes at q₁, and
//! velocities then follow their policy over the same interval as in the forward step. Where a body moves as
//! one (policy `Rigid`, one support), that misses the state before the step by the second order of h, and the
//! forward step from there tells by how much.

use crate::align::align;
use crate::aligned::{AlignedDrift, rotate};
use crate::batch::Pool;
use crate::block::{Vec3Rows, WIDTH, add_scaled};
use crate::field::{Field, Workspace};
use crate::rollout::rollout;
use crate::state::{Edit, Reversal, RolloutSpec, State, VelocityPolicy};
use crate::supports::Supports;
use crate::system::{ForceKind, System};
use crate::twist::{Carrier, rigid_velocities};
use lgs_core::linear::{add, quat_conjugate, quat_mul, quat_normalize, scale, sub};

/// Times that a step back is corrected by the step forward from where it led.
const CORRECTIONS: usize = 2;

/// The states from `start` into the past: the start (its velocities scaled by α), then one per step of `−dt`.
#[must_use]
pub fn rollout_reversed(
    system: &System,
    start: &State,
    spec: &RolloutSpec,
    reversal: Reversal,
) -> Vec<State> {
    if reversal == Reversal::NegatedStep {
        return rollout(
            system,
            start,
            &RolloutSpec { dt: -spec.dt, last_dt: spec.last_dt.map(|h| -h), ..*spec },
        );
    }
    let field = Field::new(system, &spec.edit);
    let pool = Pool::new(&field);
    let v = start.v.iter().map(|v| v.map(|x| x * spec.edit.velocity_scale)).collect();
    let mut states = vec![State { v, ..start.clone() }];
    let corrections = if moves_as_one(spec) { CORRECTIONS } else { 0 };
    for h in spec.step_lengths() {
        let after = &states[states.len() - 1];
        let mut before = step_back(&pool, after, spec, h);
        for _ in 0..corrections {
            before = corrected(system, &before, after, spec, h);
        }
        states.push(before);
    }
    states
}

/// Whether all particles have one support and one twist.
fn moves_as_one(spec: &RolloutSpec) -> bool {
    spec.velocity_policy == VelocityPolicy::Rigid
        && spec.supports.is_some_and(|supports| supports.common().is_some())
}

/// A state before a step, less what a step forward of `h` from it misses of `after`. All changes are rigid:
/// what is not rigid does not survive a step and would grow on the way back.
fn corrected(system: &System, before: &State, after: &State, spec: &RolloutSpec, h: f32) -> State {
    let edit = Edit { velocity_scale: 1.0, ..spec.edit };
    let forward = rollout(system, before, &RolloutSpec { dt: h, steps: 1, last_dt: None, edit, ..*spec });
    let (Some(reached), Some(supports)) = (forward.last(), spec.supports) else { return before.clone() };
    let missed_v: Vec<[f32; 3]> = after.v.iter().zip(&reached.v).map(|(&a, &b)| sub(a, b)).collect();
    let displaced: Vec<[f32; 3]> = (0..after.len())
        .map(|i| add(before.q[i], sub(sub(after.q[i], reached.q[i]), scale(missed_v[i], h))))
        .collect();
    let turn = |i: usize| quat_mul(reached.rotation[i], quat_conjugate(before.rotation[i]));
    let rotation = (0..after.len())
        .map(|i| quat_normalize(quat_mul(quat_conjugate(turn(i)), after.rotation[i])))
        .collect();
    let q = align(&before.q, &displaced, supports).aligned;
    let v: Vec<[f32; 3]> = before.v.iter().zip(missed_v).map(|(&v, missed)| add(v, missed)).collect();
    State { v: carried(&q, &v, supports, h), q, rotation }
}

fn step_back(pool: &Pool, after: &State, spec: &RolloutSpec, h: f32) -> State {
    let drifted: Vec<_> = after.q.iter().zip(&after.v).map(|(&q, &v)| sub(q, scale(v, h))).collect();
    let (q, v, rotation) = match spec.supports {
        None => (drifted, after.v.clone(), after.rotation.clone()),
        Some(supports) => align_back(after, &drifted, supports, spec.velocity_policy, h),
    };
    let mut v = pool.map(&q, &v, |field, workspace, q, v| unkick(field, workspace, q, v, h));
    if let (Some(supports), VelocityPolicy::Rigid) = (spec.supports, spec.velocity_policy) {
        v = carried(&q, &v, supports, h);
    }
    State { q, v, rotation }
}

/// Velocities `[n, 3]` that the policy `Rigid` gives at the end of a step of `h`: the twist at the
/// midpoints of that step. Kicks are not rigid, and taking one off leaves what it added beside a twist.
fn carried(q: &[[f32; 3]], v: &[[f32; 3]], supports: &Supports, h: f32) -> Vec<[f32; 3]> {
    let midpoints: Vec<[f32; 3]> = q.iter().zip(v).map(|(&q, &v)| sub(q, scale(v, 0.5 * h))).collect();
    rigid_velocities(&midpoints, v, supports)
}

type Undrifted = (Vec<[f32; 3]>, Vec<[f32; 3]>, Vec<[f32; 4]>);

/// Positions, velocities over the interval and rotations before an aligned drift.
fn align_back(
    after: &State,
    drifted: &[[f32; 3]],
    supports: &Supports,
    policy: VelocityPolicy,
    h: f32,
) -> Undrifted {
    let back = align(&after.q, drifted, supports);
    let (mut rotation, mut v) = (vec![[0.0; 4]; after.len()], Vec::new());
    rotate(&back.quaternions, &after.rotation, &mut rotation);
    let ends: [&[[f32; 3]]; 2] = [&back.aligned, &after.q];
    let drift = AlignedDrift { supports, policy, h };
    drift.velocity(ends, &mut after.v.clone(), &mut Carrier::default(), &mut v);
    (back.aligned, v, rotation)
}

/// The velocity before a kick: `v₀` with `v₀ + h a(q₀, v₀) = v₁`.
fn unkick(field: &Field, workspace: &mut Workspace, q: &Vec3Rows, v1: &Vec3Rows, h: f32) -> Vec3Rows {
    match field.config.force {
        ForceKind::None => {
            let mut v0 = *v1;
            add_scaled(&mut v0, &field.acceleration(workspace, q, v1), -h);
            v0
        }
        ForceKind::Structured => unkick_linear(field, workspace, q, v1, h),
        ForceKind::Mlp => unkick_by_iteration(field, workspace, q, v1, h),
    }
}

/// Solves `(1 − h γ d) v₀ + h γ w × v₀ = v₁ + h β ∇U` for the structured force `−d v + w × v`.
fn unkick_linear(field: &Field, workspace: &mut Workspace, q: &Vec3Rows, v1: &Vec3Rows, h: f32) -> Vec3Rows {
    let gradient = field.potential_gradient(workspace, q);
    let Some([damping, spin @ ..]) = field.structured_coefficients(workspace, q) else { return *v1 };
    let beta = field.edit().potential_scale;
    let mut v0 = *v1;
    for lane in 0..WIDTH {
        let right: [f64; 3] = std::array::from_fn(|axis| {
            f64::from(v1[axis][lane]) + f64::from(h) * f64::from(beta * gradient[axis][lane])
        });
        let turn: [f64; 3] = std::array::from_fn(|axis| f64::from(h) * f64::from(spin[axis][lane]));
        let solved = solve_scaled_turn(1.0 - f64::from(h) * f64::from(damping[lane]), turn, right);
        for axis in 0..3 {
            v0[axis][lane] = solved[axis] as f32;
        }
    }
    v0
}

/// Solves `s x + b × x = r`: `x = (s² r − s b × r + (b·r) b) / (s (s² + |b|²))`.
fn solve_scaled_turn(s: f64, b: [f64; 3], r: [f64; 3]) -> [f64; 3] {
    // A step that stops or turns a velocity around (h d ≥ 1) has no usable inverse; the bound keeps it
    // finite.
    let s = s.max(1e-3);
    let cross = [b[1] * r[2] - b[2] * r[1], b[2] * r[0] - b[0] * r[2], b[0] * r[1] - b[1] * r[0]];
    let along = b[0] * r[0] + b[1] * r[1] + b[2] * r[2];
    let norm2 = b[0] * b[0] + b[1] * b[1] + b[2] * b[2];
    std::array::from_fn(|i| (s * s * r[i] - s * cross[i] + along * b[i]) / (s * (s * s + norm2)))
}

/// Solves by iterating `v₀ ← v₁ − h a(q₀, v₀)`, a contraction where h times the force's Lipschitz constant in
/// v is below 1.
fn unkick_by_iteration(
    field: &Field,
    workspace: &mut Workspace,
    q: &Vec3Rows,
    v1: &Vec3Rows,
    h: f32,
) -> Vec3Rows {
    const ITERATIONS: usize = 50;
    const CONVERGED: f32 = 1e-7;
    let mut fixed = *v1;
    let beta = field.edit().potential_scale;
    add_scaled(&mut fixed, &field.potential_gradient(workspace, q), h * beta);
    let mut v0 = fixed;
    for _ in 0..ITERATIONS {
        let mut next = fixed;
        add_scaled(&mut next, &field.force(workspace, q, &v0), -h * field.edit().force_scale);
        let largest = |rows: &Vec3Rows| rows.as_flattened().iter().fold(0.0_f32, |m, v| m.max(v.abs()));
        let mut change = next;
        add_scaled(&mut change, &v0, -1.0);
        v0 = next;
        if largest(&change) <= CONVERGED * largest(&v0) {
            break;
        }
    }
    v0
}
