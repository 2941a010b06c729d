//! Rollouts with local rigid alignment: all particles take a step together.
//!
//! After the integrator's step the candidates are aligned (Eq. 6), the support's rotation multiplies the
//! particle's from the left, and velocities follow their policy (method §4.6). All arrays are there before
//! the first step; the backward pass is in [`crate::aligned_vjp`].

use crate::align::Alignment;
use crate::batch::Pool;
use crate::field::Field;
use crate::state::{RolloutSpec, State, VelocityPolicy};
use crate::supports::Supports;
use crate::twist::Carrier;
use lgs_core::linear::{add, quat_mul, quat_normalize, scale, sub};

/// Intermediate results of a step, in arrays that all steps share.
#[derive(Default)]
pub(crate) struct Step {
    /// Velocities after the kick.
    pub(crate) kicked: Vec<[f32; 3]>,
    candidate: Vec<[f32; 3]>,
    pub(crate) alignment: Alignment,
    pub(crate) carrier: Carrier,
}

impl Step {
    pub(crate) fn run(&mut self, pool: &Pool, state: &State, supports: &Supports, h: f32) {
        pool.kick(&state.q, &state.v, h, &mut self.kicked);
        self.candidate.clear();
        self.candidate.extend(state.q.iter().zip(&self.kicked).map(|(&q, &v)| add(q, scale(v, h))));
        self.alignment.update(&state.q, &self.candidate, supports);
    }
}

/// The states of a rollout with alignment after every step.
pub(crate) fn aligned(field: &Field, start: State, supports: &Supports, spec: &RolloutSpec) -> Vec<State> {
    let (pool, lengths) = (Pool::new(field), spec.step_lengths());
    let n = start.len();
    let mut states = vec![start];
    states.resize_with(1 + lengths.len(), || State {
        q: vec![[0.0; 3]; n],
        v: vec![[0.0; 3]; n],
        rotation: vec![[0.0; 4]; n],
    });
    let mut step = Step::default();
    for (at, &h) in lengths.iter().enumerate() {
        let [before, after] = &mut states[at..at + 2] else { unreachable!("a slice of two states") };
        step.run(&pool, before, supports, h);
        rotate(&step.alignment.quaternions, &before.rotation, &mut after.rotation);
        std::mem::swap(&mut after.q, &mut step.alignment.aligned);
        let Step { kicked, carrier, .. } = &mut step;
        let drift = AlignedDrift { supports, policy: spec.velocity_policy, h };
        drift.velocity([&before.q, &after.q], kicked, carrier, &mut after.v);
    }
    states
}

/// `r₁ = p ⊗ r₀`, normalised, for every particle.
pub(crate) fn rotate(quaternions: &[[f32; 4]], before: &[[f32; 4]], after: &mut [[f32; 4]]) {
    for ((after, &r), &p) in after.iter_mut().zip(before).zip(quaternions) {
        *after = quat_normalize(quat_mul(p, r));
    }
}

/// The drift of a step whose end is aligned.
#[derive(Clone, Copy)]
pub(crate) struct AlignedDrift<'a> {
    pub(crate) supports: &'a Supports,
    pub(crate) policy: VelocityPolicy,
    /// Length of the step.
    pub(crate) h: f32,
}

impl AlignedDrift<'_> {
    /// Velocities after alignment took particles from `q0` to `q1`; may leave anything in `kicked`.
    pub(crate) fn velocity(
        self,
        [q0, q1]: [&[[f32; 3]]; 2],
        kicked: &mut Vec<[f32; 3]>,
        carrier: &mut Carrier,
        velocity: &mut Vec<[f32; 3]>,
    ) {
        match self.policy {
            VelocityPolicy::Keep => std::mem::swap(kicked, velocity),
            VelocityPolicy::FromPositions => {
                velocity.clear();
                velocity.extend(q0.iter().zip(q1).map(|(&q0, &q1)| scale(sub(q1, q0), 1.0 / self.h)));
            }
            VelocityPolicy::Rigid => carrier.midway([q0, q1], kicked, self.supports, velocity),
        }
    }
}
