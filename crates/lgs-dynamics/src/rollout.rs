//! Rollouts of a system and their backward pass.
//!
//! A step is semi-implicit Euler (Eq. 5: kick with the acceleration at the old state, drift with the new
//! velocity). Without supports particles are independent, and each block of them runs through all steps while
//! its state is in the cache; rollouts with alignment are in `aligned.rs`. Only states are kept; the backward
//! pass walks them from the end and recomputes activations and rotations.

use crate::aligned::aligned;
use crate::aligned_vjp::aligned_vjp;
use crate::batch::{Pool, group_gradients, group_size};
use crate::block::{Vec3Rows, WIDTH, ZERO_ROWS, add_scaled, gather, gather_or_zero, scatter};
use crate::field::{Field, Gradients, Workspace};
use crate::state::{RolloutGradients, RolloutSpec, State, StateCotangents};
use crate::system::System;
use rayon::prelude::*;

/// The states of a rollout: the start (its velocities scaled by α), then one per step.
#[must_use]
pub fn rollout(system: &System, start: &State, spec: &RolloutSpec) -> Vec<State> {
    let field = Field::new(system, &spec.edit);
    let start = State {
        v: start.v.iter().map(|v| v.map(|x| x * spec.edit.velocity_scale)).collect(),
        ..start.clone()
    };
    // Entered once, so that the loops of all steps begin on a thread of the pool; so is the backward pass.
    rayon::scope(|_| match spec.supports {
        None => independent(&field, start, &spec.step_lengths()),
        Some(supports) => aligned(&field, start, supports, spec),
    })
}

/// The backward pass of [`rollout`], which gave `trajectory`; `cotangents` has one entry per state (missing
/// ones are zero).
#[must_use]
pub fn rollout_vjp(
    system: &System,
    spec: &RolloutSpec,
    trajectory: &[State],
    cotangents: &[StateCotangents],
) -> RolloutGradients {
    let lengths = spec.step_lengths();
    assert_eq!(trajectory.len(), lengths.len() + 1, "states of the trajectory");
    let field = Field::new(system, &spec.edit);
    let mut gradients = rayon::scope(|_| match spec.supports {
        None => independent_vjp(&field, trajectory, &lengths, cotangents),
        Some(supports) => aligned_vjp(&field, trajectory, supports, spec, cotangents),
    });
    for v in gradients.v0.as_flattened_mut() {
        *v *= spec.edit.velocity_scale;
    }
    gradients
}

/// Takes one step of a block (Eq. 5).
fn step_block(field: &Field, workspace: &mut Workspace, q: &mut Vec3Rows, v: &mut Vec3Rows, h: f32) {
    let a = field.acceleration(workspace, q, v);
    add_scaled(v, &a, h);
    add_scaled(q, v, h);
}

fn independent(field: &Field, start: State, lengths: &[f32]) -> Vec<State> {
    let n = start.len();
    let pool = Pool::new(field);
    let run = |(q, v): (&[[f32; 3]], &[[f32; 3]])| -> Vec<(Vec3Rows, Vec3Rows)> {
        let (mut q, mut v) = (gather(q), gather(v));
        let mut run = |field: &Field, workspace: &mut Workspace| {
            let step = |&h: &f32| {
                step_block(field, workspace, &mut q, &mut v, h);
                (q, v)
            };
            lengths.iter().map(step).collect()
        };
        pool.run(&mut run)
    };
    let blocks: Vec<_> = start.q.par_chunks(WIDTH).zip(start.v.par_chunks(WIDTH)).map(run).collect();
    let mut states =
        vec![
            State { q: vec![[0.0; 3]; n], v: vec![[0.0; 3]; n], rotation: start.rotation.clone() };
            lengths.len()
        ];
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

fn independent_vjp(
    field: &Field,
    trajectory: &[State],
    lengths: &[f32],
    cotangents: &[StateCotangents],
) -> RolloutGradients {
    let n = trajectory[0].len();
    let pool = Pool::new(field);
    let size = group_size(n);
    let (mut q0, mut v0) = (vec![[0.0; 3]; n], vec![[0.0; 3]; n]);
    let mut partials = group_gradients(field, n);
    let groups =
        q0.par_chunks_mut(size).zip(v0.par_chunks_mut(size)).zip(partials.par_iter_mut()).enumerate();
    groups.for_each(|(group, ((q0, v0), gradients))| {
        for (block, (q0, v0)) in q0.chunks_mut(WIDTH).zip(v0.chunks_mut(WIDTH)).enumerate() {
            let first = group * size + block * WIDTH;
            let task = BlockVjp { trajectory, lengths, cotangents, first, count: q0.len() };
            let (v_q, v_v) = pool.run(|field, workspace| task.run(field, workspace, gradients));
            scatter(&v_q, q0);
            scatter(&v_v, v0);
        }
    });
    RolloutGradients { params: field.sum_in_order(&partials), q0, v0 }
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
    fn run(
        &self,
        field: &Field,
        workspace: &mut Workspace,
        gradients: &mut Gradients,
    ) -> (Vec3Rows, Vec3Rows) {
        let range = self.first..self.first + self.count;
        let (mut v_q, mut v_v) = (ZERO_ROWS, ZERO_ROWS);
        self.add_cotangents(self.lengths.len(), &mut v_q, &mut v_v);
        for (step, &h) in self.lengths.iter().enumerate().rev() {
            let (q, v) = (
                gather(&self.trajectory[step].q[range.clone()]),
                gather(&self.trajectory[step].v[range.clone()]),
            );
            // q₁ = q₀ + h v₁, v₁ = v₀ + h a(q₀, v₀)
            add_scaled(&mut v_v, &v_q, h);
            let v_a = v_v.map(|row| row.map(|value| h * value));
            let (of_q, of_v) = field.acceleration_vjp(workspace, [&q, &v], &v_a, gradients);
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
