//! Rollouts with local rigid alignment: all particles take a step together.
//!
//! After the integrator's step the candidates are aligned (Eq. 6), the support's rotation multiplies the particle's from the left, and
//! velocities follow their policy (reference §8.7). The backward pass repeats each step from its state and walks it in reverse.

use crate::align::{Alignment, align, align_turns_vjp};
use crate::batch::{Pool, acceleration_vjp_grouped, group_gradients};
use crate::field::{Field, Gradients};
use crate::rollout::{RolloutGradients, StateCotangents};
use crate::state::{RolloutSpec, State, VelocityPolicy};
use crate::supports::Supports;
use crate::twist::{rigid_velocities, rigid_velocity_vjp};
use lgs_core::linear::{add, quat_mul, quat_normalize, scale, sub};

/// What a step computes on its way from one state to the next.
struct Step {
    /// Velocities after the kick.
    kicked: Vec<[f32; 3]>,
    candidate: Vec<[f32; 3]>,
    alignment: Alignment,
}

impl Step {
    fn new(pool: &Pool, state: &State, supports: &Supports, h: f32) -> Self {
        let kicked = pool.kick(&state.q, &state.v, h);
        let candidate: Vec<_> = state.q.iter().zip(&kicked).map(|(&q, &v)| add(q, scale(v, h))).collect();
        let alignment = align(&state.q, &candidate, supports);
        Self { kicked, candidate, alignment }
    }
}

/// The states of a rollout with alignment after every step.
pub(crate) fn aligned(field: &Field, start: State, supports: &Supports, spec: &RolloutSpec) -> Vec<State> {
    let pool = Pool::new(field);
    let mut states = vec![start];
    for h in spec.step_lengths() {
        let state = &states[states.len() - 1];
        let step = Step::new(&pool, state, supports, h);
        let v = policy_velocity(spec.velocity_policy, &state.q, &step.alignment.aligned, step.kicked, supports, h);
        let rotation = rotated(&step.alignment.quaternions, &state.rotation);
        states.push(State { q: step.alignment.aligned, v, rotation });
    }
    states
}

/// `r₁ = p ⊗ r₀`, normalised, for every particle.
pub(crate) fn rotated(quaternions: &[[f32; 4]], rotation: &[[f32; 4]]) -> Vec<[f32; 4]> {
    quaternions.iter().zip(rotation).map(|(&p, &r)| quat_normalize(quat_mul(p, r))).collect()
}

/// Velocities after alignment took particles from `q0` to `q1` in a step of `h`.
pub(crate) fn policy_velocity(
    policy: VelocityPolicy,
    q0: &[[f32; 3]],
    q1: &[[f32; 3]],
    kicked: Vec<[f32; 3]>,
    supports: &Supports,
    h: f32,
) -> Vec<[f32; 3]> {
    match policy {
        VelocityPolicy::Keep => kicked,
        VelocityPolicy::FromPositions => q0.iter().zip(q1).map(|(&q0, &q1)| scale(sub(q1, q0), 1.0 / h)).collect(),
        VelocityPolicy::Rigid => rigid_velocities(&midpoints(q0, q1), &kicked, supports),
    }
}

fn midpoints(q0: &[[f32; 3]], q1: &[[f32; 3]]) -> Vec<[f32; 3]> {
    q0.iter().zip(q1).map(|(&a, &b)| add(a, scale(sub(b, a), 0.5))).collect()
}

fn accumulate<const D: usize>(sum: &mut [[f32; D]], values: &[[f32; D]], factor: f32) {
    for (sum, value) in sum.as_flattened_mut().iter_mut().zip(values.as_flattened()) {
        *sum += factor * value;
    }
}

/// Cotangents of a whole state on its way back.
struct Adjoint {
    q: Vec<[f32; 3]>,
    v: Vec<[f32; 3]>,
    rotation: Vec<[f32; 4]>,
}

impl Adjoint {
    fn add(&mut self, own: Option<&StateCotangents>) {
        let Some(own) = own else { return };
        accumulate(&mut self.q, &own.q, 1.0);
        accumulate(&mut self.v, &own.v, 1.0);
        accumulate(&mut self.rotation, &own.rotation, 1.0);
    }
}

/// Backwards through [`aligned`].
pub(crate) fn aligned_vjp(
    field: &Field,
    trajectory: &[State],
    supports: &Supports,
    spec: &RolloutSpec,
    cotangents: &[StateCotangents],
) -> RolloutGradients {
    let n = trajectory[0].len();
    let pool = Pool::new(field);
    let mut partials = group_gradients(field, n);
    let mut adjoint = Adjoint { q: vec![[0.0; 3]; n], v: vec![[0.0; 3]; n], rotation: vec![[0.0; 4]; n] };
    let lengths = spec.step_lengths();
    adjoint.add(cotangents.get(lengths.len()));
    for (step, &h) in lengths.iter().enumerate().rev() {
        let (before, after) = (&trajectory[step], &trajectory[step + 1]);
        step_vjp(&pool, [before, after], supports, spec.velocity_policy, h, &mut adjoint, &mut partials);
        adjoint.add(cotangents.get(step));
    }
    RolloutGradients { params: field.sum_in_order(&partials), q0: adjoint.q, v0: adjoint.v }
}

fn step_vjp(
    pool: &Pool,
    [before, after]: [&State; 2],
    supports: &Supports,
    policy: VelocityPolicy,
    h: f32,
    adjoint: &mut Adjoint,
    partials: &mut [Gradients],
) {
    let step = Step::new(pool, before, supports, h);
    let v_turns = rotated_vjp(&step.alignment.quaternions, before, after, &mut adjoint.rotation);
    let v_q1 = &mut adjoint.q;
    let mut v_q0 = vec![[0.0; 3]; v_q1.len()];
    let mut v_kicked = policy_vjp(policy, [before, after], &step.kicked, supports, h, &adjoint.v, (&mut v_q0, v_q1));
    let (of_position, of_candidate) = align_turns_vjp(&before.q, &step.candidate, supports, &step.alignment, v_q1, &v_turns);
    accumulate(&mut v_q0, &of_position, 1.0);
    accumulate(&mut v_q0, &of_candidate, 1.0);
    accumulate(&mut v_kicked, &of_candidate, h);
    let (of_q, of_v) = acceleration_vjp_grouped(pool, &before.q, &before.v, &v_kicked, h, partials);
    accumulate(&mut v_q0, &of_q, 1.0);
    accumulate(&mut v_kicked, &of_v, 1.0);
    adjoint.q = v_q0;
    adjoint.v = v_kicked;
}

/// Backwards through the velocity policy: returns the cotangents of the kicked velocities, adds those of both positions.
fn policy_vjp(
    policy: VelocityPolicy,
    [before, after]: [&State; 2],
    kicked: &[[f32; 3]],
    supports: &Supports,
    h: f32,
    v_v: &[[f32; 3]],
    (v_q0, v_q1): (&mut [[f32; 3]], &mut [[f32; 3]]),
) -> Vec<[f32; 3]> {
    match policy {
        VelocityPolicy::Keep => v_v.to_vec(),
        VelocityPolicy::FromPositions => {
            accumulate(v_q1, v_v, 1.0 / h);
            accumulate(v_q0, v_v, -1.0 / h);
            vec![[0.0; 3]; v_v.len()]
        }
        VelocityPolicy::Rigid => {
            let (v_m, v_kicked) = rigid_velocity_vjp(&midpoints(&before.q, &after.q), kicked, supports, v_v);
            accumulate(v_q0, &v_m, 0.5);
            accumulate(v_q1, &v_m, 0.5);
            v_kicked
        }
    }
}

/// Backwards through [`rotated`]: replaces the rotations' cotangents by those of the rotations before, and returns those of a small turn
/// θ in `p ⊗ (1, θ/2)`.
fn rotated_vjp(quaternions: &[[f32; 4]], before: &State, after: &State, v_rotation: &mut [[f32; 4]]) -> Vec<[f32; 3]> {
    let conjugate = |[w, x, y, z]: [f32; 4]| [w, -x, -y, -z];
    let mut turn = |particle: usize| {
        let (p, r0, r1) = (quaternions[particle], before.rotation[particle], after.rotation[particle]);
        let v = v_rotation[particle];
        let along: f32 = (0..4).map(|i| v[i] * r1[i]).sum();
        let v = std::array::from_fn(|i| v[i] - along * r1[i]);
        let v_r0 = quat_mul(conjugate(p), v);
        v_rotation[particle] = v_r0;
        let [_, x, y, z] = quat_mul(v_r0, conjugate(r0));
        [0.5 * x, 0.5 * y, 0.5 * z]
    };
    (0..quaternions.len()).map(&mut turn).collect()
}
