//! The backward pass of rollouts with alignment: repeats each step from its state and walks it in reverse, in
//! arrays that all steps share.

use crate::align_vjp::AlignmentVjp;
use crate::aligned::{AlignedDrift, Step};
use crate::batch::{Pool, acceleration_vjp_grouped, group_gradients};
use crate::field::{Field, Gradients};
use crate::state::{RolloutGradients, RolloutSpec, State, StateCotangents, VelocityPolicy};
use crate::supports::Supports;
use lgs_core::linear::{add, quat_mul, scale};

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

fn accumulate<const D: usize>(sum: &mut [[f32; D]], values: &[[f32; D]], factor: f32) {
    for (sum, value) in sum.as_flattened_mut().iter_mut().zip(values.as_flattened()) {
        *sum += factor * value;
    }
}

/// The backward pass of [`crate::aligned::aligned`].
pub(crate) fn aligned_vjp(
    field: &Field,
    trajectory: &[State],
    supports: &Supports,
    spec: &RolloutSpec,
    cotangents: &[StateCotangents],
) -> RolloutGradients {
    let n = trajectory[0].len();
    let (pool, lengths) = (Pool::new(field), spec.step_lengths());
    let mut partials = group_gradients(field, n);
    let mut walk = Walk::new(n);
    walk.adjoint.add(cotangents.get(lengths.len()));
    for (step, &h) in lengths.iter().enumerate().rev() {
        let drift = AlignedDrift { supports, policy: spec.velocity_policy, h };
        walk.step_back(&pool, [&trajectory[step], &trajectory[step + 1]], drift, &mut partials);
        walk.adjoint.add(cotangents.get(step));
    }
    RolloutGradients { params: field.sum_in_order(&partials), q0: walk.adjoint.q, v0: walk.adjoint.v }
}

/// The cotangents on their way back, and the arrays of a step.
struct Walk {
    adjoint: Adjoint,
    step: Step,
    alignment_vjp: AlignmentVjp,
    /// Cotangents of a small turn θ in `p ⊗ (1, θ/2)`.
    v_turns: Vec<[f32; 3]>,
    v_q0: Vec<[f32; 3]>,
    v_kicked: Vec<[f32; 3]>,
    of_q: Vec<[f32; 3]>,
    of_v: Vec<[f32; 3]>,
}

impl Walk {
    fn new(n: usize) -> Self {
        let zeros = || vec![[0.0; 3]; n];
        Self {
            adjoint: Adjoint { q: zeros(), v: zeros(), rotation: vec![[0.0; 4]; n] },
            step: Step::default(),
            alignment_vjp: AlignmentVjp::default(),
            v_turns: Vec::with_capacity(n),
            v_q0: zeros(),
            v_kicked: zeros(),
            of_q: zeros(),
            of_v: zeros(),
        }
    }

    /// Turns the cotangents of a state into those of the state before it.
    fn step_back(
        &mut self,
        pool: &Pool,
        states: [&State; 2],
        drift: AlignedDrift<'_>,
        partials: &mut [Gradients],
    ) {
        let ([before, after], AlignedDrift { supports, h, .. }) = (states, drift);
        self.step.run(pool, before, supports, h);
        rotate_vjp(
            &self.step.alignment.quaternions,
            before,
            after,
            &mut self.adjoint.rotation,
            &mut self.v_turns,
        );
        self.v_q0.fill([0.0; 3]);
        self.policy_vjp(drift, states);
        let Self { adjoint, step, alignment_vjp, v_turns, v_q0, v_kicked, of_q, of_v } = self;
        alignment_vjp.update(supports, &step.alignment, &adjoint.q, v_turns);
        accumulate(v_q0, &alignment_vjp.v_position, 1.0);
        accumulate(v_q0, &alignment_vjp.v_candidate, 1.0);
        accumulate(v_kicked, &alignment_vjp.v_candidate, h);
        acceleration_vjp_grouped(pool, [&before.q, &before.v, v_kicked], h, partials, [of_q, of_v]);
        accumulate(v_q0, of_q, 1.0);
        accumulate(v_kicked, of_v, 1.0);
        std::mem::swap(&mut adjoint.q, v_q0);
        std::mem::swap(&mut adjoint.v, v_kicked);
    }

    /// The backward pass of the velocity policy: sets the cotangents of the kicked velocities, adds those of
    /// both positions.
    fn policy_vjp(&mut self, drift: AlignedDrift<'_>, [before, after]: [&State; 2]) {
        let AlignedDrift { supports, policy, h } = drift;
        let (v_v, v_q0, v_q1) = (&self.adjoint.v, &mut self.v_q0, &mut self.adjoint.q);
        match policy {
            VelocityPolicy::Keep => self.v_kicked.copy_from_slice(v_v),
            VelocityPolicy::FromPositions => {
                accumulate(v_q1, v_v, 1.0 / h);
                accumulate(v_q0, v_v, -1.0 / h);
                self.v_kicked.fill([0.0; 3]);
            }
            VelocityPolicy::Rigid => {
                let Step { kicked, carrier, .. } = &mut self.step;
                let cotangents = carrier.midway_vjp([&before.q, &after.q], kicked, supports, v_v);
                let sums = v_q0.iter_mut().zip(v_q1).zip(&mut self.v_kicked);
                for (((v_q0, v_q1), v_kicked), own) in sums.zip(cotangents) {
                    let v_end = scale(own[1], 0.5);
                    *v_q0 = add(*v_q0, add(own[0], v_end));
                    *v_q1 = add(*v_q1, v_end);
                    *v_kicked = own[2];
                }
            }
        }
    }
}

/// Backwards through [`crate::aligned::rotate`]: replaces the rotations' cotangents by those of the rotations
/// before, and sets those of a small turn θ in `p ⊗ (1, θ/2)`.
fn rotate_vjp(
    quaternions: &[[f32; 4]],
    before: &State,
    after: &State,
    v_rotation: &mut [[f32; 4]],
    v_turns: &mut Vec<[f32; 3]>,
) {
    let conjugate = |[w, x, y, z]: [f32; 4]| [w, -x, -y, -z];
    v_turns.clear();
    v_turns.extend(quaternions.iter().enumerate().map(|(particle, &p)| {
        let (r0, r1, v) = (before.rotation[particle], after.rotation[particle], v_rotation[particle]);
        let along: f32 = (0..4).map(|i| v[i] * r1[i]).sum();
        let v = std::array::from_fn(|i| v[i] - along * r1[i]);
        let v_r0 = quat_mul(conjugate(p), v);
        v_rotation[particle] = v_r0;
        let [_, x, y, z] = quat_mul(v_r0, conjugate(r0));
        [0.5 * x, 0.5 * y, 0.5 * z]
    }));
}
