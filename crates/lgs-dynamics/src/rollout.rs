//! Rollouts of a system and their backward pass.
//!
//! A step is semi-implicit Euler (Eq. 5: kick with the acceleration at the old state, drift with the new velocity), then, where there are
//! supports, local rigid alignment of the candidates (Eq. 6), the rotation's left product, and the velocity policy. Without supports
//! particles are independent, and each block of them runs through all steps while its state is in the cache. Only states are kept; the
//! backward pass walks them from the end and recomputes activations and rotations.

use crate::align::{Alignment, align, align_turns_vjp};
use crate::batch::{Pool, acceleration_vjp_grouped, group_buffers, group_size, sum_in_order};
use crate::block::{Vec3Rows, WIDTH, ZERO_ROWS, add_scaled, gather, gather_or_zero, scatter};
use crate::field::{Field, Workspace};
use crate::state::{RolloutSpec, State, VelocityPolicy};
use crate::supports::Supports;
use crate::system::System;
use crate::twist::{rigid_velocity, rigid_velocity_vjp};
use lgs_core::linear::{add, quat_mul, quat_normalize, scale, sub};
use rayon::prelude::*;

/// Cotangents of one state; empty arrays are zero.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StateCotangents {
    /// Of positions `[n, 3]`.
    pub q: Vec<[f32; 3]>,
    /// Of velocities `[n, 3]`.
    pub v: Vec<[f32; 3]>,
    /// Of rotations `[n, 4]`.
    pub rotation: Vec<[f32; 4]>,
}

/// Gradients through a rollout.
#[derive(Clone, Debug, PartialEq)]
pub struct RolloutGradients {
    /// By the flat parameter vector.
    pub params: Vec<f32>,
    /// By the starting positions `[n, 3]`.
    pub q0: Vec<[f32; 3]>,
    /// By the starting velocities `[n, 3]`, before they are scaled by α.
    pub v0: Vec<[f32; 3]>,
}

/// The states of a rollout: the start (its velocities scaled by α), then one per step.
#[must_use]
pub fn rollout(system: &System, start: &State, spec: &RolloutSpec) -> Vec<State> {
    let field = Field::new(system, &spec.edit);
    let start = State { v: start.v.iter().map(|v| v.map(|x| x * spec.edit.velocity_scale)).collect(), ..start.clone() };
    match spec.supports {
        None => independent(&field, start, &spec.step_lengths()),
        Some(supports) => aligned(&field, start, supports, spec),
    }
}

/// Backwards through [`rollout`], which gave `trajectory`; `cotangents` has one entry per state (missing ones are zero).
#[must_use]
pub fn rollout_vjp(system: &System, spec: &RolloutSpec, trajectory: &[State], cotangents: &[StateCotangents]) -> RolloutGradients {
    let lengths = spec.step_lengths();
    assert_eq!(trajectory.len(), lengths.len() + 1, "states of the trajectory");
    let field = Field::new(system, &spec.edit);
    let mut gradients = match spec.supports {
        None => independent_vjp(&field, trajectory, &lengths, cotangents),
        Some(supports) => aligned_vjp(&field, trajectory, supports, spec, cotangents),
    };
    for v in gradients.v0.as_flattened_mut() {
        *v *= spec.edit.velocity_scale;
    }
    gradients
}

/// One step of a block (Eq. 5).
fn step_block(field: &Field, workspace: &mut Workspace, q: &mut Vec3Rows, v: &mut Vec3Rows, h: f32) {
    let a = field.acceleration(workspace, q, v);
    add_scaled(v, &a, h);
    add_scaled(q, v, h);
}

fn independent(field: &Field, start: State, lengths: &[f32]) -> Vec<State> {
    let n = start.len();
    let pool = Pool::new(*field);
    let run = |(q, v): (&[[f32; 3]], &[[f32; 3]])| -> Vec<(Vec3Rows, Vec3Rows)> {
        let (mut q, mut v) = (gather(q), gather(v));
        let step = |&h: &f32| {
            pool.run(|field, workspace| step_block(field, workspace, &mut q, &mut v, h));
            (q, v)
        };
        lengths.iter().map(step).collect()
    };
    let blocks: Vec<_> = start.q.par_chunks(WIDTH).zip(start.v.par_chunks(WIDTH)).map(run).collect();
    let mut states = vec![State { q: vec![[0.0; 3]; n], v: vec![[0.0; 3]; n], rotation: start.rotation.clone() }; lengths.len()];
    states.par_iter_mut().enumerate().for_each(|(step, state)| {
        for ((block, q), v) in blocks.iter().zip(state.q.chunks_mut(WIDTH)).zip(state.v.chunks_mut(WIDTH)) {
            scatter(&block[step].0, q);
            scatter(&block[step].1, v);
        }
    });
    states.insert(0, start);
    states
}

/// The part of a step's cotangents that belongs to some particles.
fn cotangent_rows(values: &[[f32; 3]], first: usize, count: usize) -> Vec3Rows {
    if values.is_empty() { ZERO_ROWS } else { gather_or_zero(&values[first..first + count]) }
}

fn independent_vjp(field: &Field, trajectory: &[State], lengths: &[f32], cotangents: &[StateCotangents]) -> RolloutGradients {
    let n = trajectory[0].len();
    let pool = Pool::new(*field);
    let size = group_size(n);
    let (mut q0, mut v0) = (vec![[0.0; 3]; n], vec![[0.0; 3]; n]);
    let mut partials = group_buffers(n, field.parameters());
    let groups = q0.par_chunks_mut(size).zip(v0.par_chunks_mut(size)).zip(partials.par_iter_mut()).enumerate();
    groups.for_each(|(group, ((q0, v0), v_params))| {
        for (block, (q0, v0)) in q0.chunks_mut(WIDTH).zip(v0.chunks_mut(WIDTH)).enumerate() {
            let first = group * size + block * WIDTH;
            let task = BlockVjp { trajectory, lengths, cotangents, first, count: q0.len() };
            let (v_q, v_v) = pool.run(|field, workspace| task.run(field, workspace, v_params));
            scatter(&v_q, q0);
            scatter(&v_v, v0);
        }
    });
    RolloutGradients { params: sum_in_order(&partials, field.parameters()), q0, v0 }
}

/// The backward pass of one block through all steps.
struct BlockVjp<'a> {
    trajectory: &'a [State],
    lengths: &'a [f32],
    cotangents: &'a [StateCotangents],
    first: usize,
    count: usize,
}

impl BlockVjp<'_> {
    fn run(&self, field: &Field, workspace: &mut Workspace, v_params: &mut [f32]) -> (Vec3Rows, Vec3Rows) {
        let range = self.first..self.first + self.count;
        let (mut v_q, mut v_v) = (ZERO_ROWS, ZERO_ROWS);
        self.add_cotangents(self.lengths.len(), &mut v_q, &mut v_v);
        for (step, &h) in self.lengths.iter().enumerate().rev() {
            let (q, v) = (gather(&self.trajectory[step].q[range.clone()]), gather(&self.trajectory[step].v[range.clone()]));
            // q₁ = q₀ + h v₁, v₁ = v₀ + h a(q₀, v₀)
            add_scaled(&mut v_v, &v_q, h);
            let v_a = v_v.map(|row| row.map(|value| h * value));
            field.acceleration(workspace, &q, &v);
            let (of_q, of_v) = field.acceleration_vjp(workspace, &v, &v_a, v_params);
            add_scaled(&mut v_q, &of_q, 1.0);
            add_scaled(&mut v_v, &of_v, 1.0);
            self.add_cotangents(step, &mut v_q, &mut v_v);
        }
        (v_q, v_v)
    }

    fn add_cotangents(&self, state: usize, v_q: &mut Vec3Rows, v_v: &mut Vec3Rows) {
        let Some(own) = self.cotangents.get(state) else { return };
        add_scaled(v_q, &cotangent_rows(&own.q, self.first, self.count), 1.0);
        add_scaled(v_v, &cotangent_rows(&own.v, self.first, self.count), 1.0);
    }
}

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

fn aligned(field: &Field, start: State, supports: &Supports, spec: &RolloutSpec) -> Vec<State> {
    let pool = Pool::new(*field);
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
        VelocityPolicy::Rigid => rigid_velocity(&midpoints(q0, q1), &kicked, supports),
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

fn aligned_vjp(
    field: &Field,
    trajectory: &[State],
    supports: &Supports,
    spec: &RolloutSpec,
    cotangents: &[StateCotangents],
) -> RolloutGradients {
    let n = trajectory[0].len();
    let pool = Pool::new(*field);
    let mut partials = group_buffers(n, field.parameters());
    let mut adjoint = Adjoint { q: vec![[0.0; 3]; n], v: vec![[0.0; 3]; n], rotation: vec![[0.0; 4]; n] };
    let lengths = spec.step_lengths();
    adjoint.add(cotangents.get(lengths.len()));
    for (step, &h) in lengths.iter().enumerate().rev() {
        let (before, after) = (&trajectory[step], &trajectory[step + 1]);
        step_vjp(&pool, [before, after], supports, spec.velocity_policy, h, &mut adjoint, &mut partials);
        adjoint.add(cotangents.get(step));
    }
    RolloutGradients { params: sum_in_order(&partials, field.parameters()), q0: adjoint.q, v0: adjoint.v }
}

fn step_vjp(
    pool: &Pool,
    [before, after]: [&State; 2],
    supports: &Supports,
    policy: VelocityPolicy,
    h: f32,
    adjoint: &mut Adjoint,
    partials: &mut [Vec<f32>],
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
