//! Rollouts and their backward pass: launches for every step, one after the other; the processor waits for
//! none of them.

use burn::backend::TensorMetadata;
use burn::tensor::DType;
use lgs_tensor::cube::{CubeTensor, arguments, contiguous, empty, units};

use super::align::{ARRIVED, FROM_POSITIONS, KEEP, PULL, RIGID, advance, collect, gather, pull_state};
use super::carry::{CARRIED, TWIST, carry, collect_twists, gather_twists, twist_vjp};
use super::field::{MOTION, STATE, Use, begin};
use super::field_vjp::{begin_adjoint, end_adjoint};
use super::system::{DeviceSystem, spread};
use super::uploads::{Uploaded, uploaded};
use crate::state::VelocityPolicy;
use crate::tensor::RolloutCall;

/// The supports of a rollout with their treatment of velocities, and what its steps share.
struct Aligned {
    supports: Uploaded,
    policy: u32,
    motion: CubeTensor,
}

impl Aligned {
    fn new(call: &RolloutCall, like: &CubeTensor, n: usize) -> Option<Self> {
        let supports = call.supports.as_ref()?;
        assert_eq!(supports.particles(), n, "supports of the particles");
        let policy = match call.velocity_policy {
            VelocityPolicy::Keep => KEEP,
            VelocityPolicy::FromPositions => FROM_POSITIONS,
            VelocityPolicy::Rigid => RIGID,
        };
        Some(Self {
            supports: uploaded(supports, like),
            policy,
            motion: empty(like, [n, MOTION], DType::F32),
        })
    }

    /// The state behind one, from its motions.
    fn advance(&self, states: &CubeTensor, state: usize, h: f32) {
        let n = self.motion.shape()[0];
        let ((cubes, dim), client) = (spread(&states.client, n), &states.client);
        let [motion, members, to] = arguments([&self.motion, &self.supports.members, states]);
        let (count, before, k, policy) = (n as u32, state as u32, self.supports.k, self.policy);
        advance::launch(client, cubes.clone(), dim, motion, members, to, count, before, k, 1.0 / h, policy);
        if policy == RIGID {
            let [motion, members, to] = arguments([&self.motion, &self.supports.members, states]);
            carry::launch(client, cubes, dim, motion, members, to, begin_of(state + 1, n), k);
        }
    }
}

/// Where a state of `n` particles begins.
fn begin_of(state: usize, n: usize) -> u32 {
    (state * n * STATE) as u32
}

/// Lengths of the steps.
fn lengths(call: &RolloutCall) -> Vec<f32> {
    let mut lengths = vec![call.dt; call.steps];
    lengths.extend(call.last_dt);
    lengths
}

/// The states `[steps + 1, n, STATE]`.
pub(super) fn rolled(call: &RolloutCall, [params, q, v]: [&CubeTensor; 3]) -> CubeTensor {
    let (lengths, n) = (lengths(call), q.shape()[0]);
    let states = empty(q, [lengths.len() + 1, n, STATE], DType::F32);
    if n == 0 {
        return states;
    }
    let ((cubes, dim), client) = (spread(&q.client, n), &q.client);
    let [from_q, from_v, to] = arguments([q, v, &states]);
    begin::launch(client, cubes, dim, from_q, from_v, to, call.edit.velocity_scale);
    let system = DeviceSystem::new(&call.config, &call.edit, params, n);
    let aligned = Aligned::new(call, q, n);
    let spare = empty(q, [1], DType::F32);
    for (state, &h) in lengths.iter().enumerate() {
        let (out, purpose) =
            aligned.as_ref().map_or((&spare, Use::Step), |aligned| (&aligned.motion, Use::Candidate));
        for rows in system.ranges(state) {
            system.evaluate(&states, rows);
            system.accelerate(&states, out, rows, (purpose, h));
        }
        if let Some(aligned) = &aligned {
            aligned.advance(&states, state, h);
        }
    }
    states
}

/// What the steps of a backward pass share.
struct Walk<'a> {
    states: &'a CubeTensor,
    /// Cotangents of the state at hand `[n, STATE]`.
    adjoint: CubeTensor,
    /// Cotangents of positions before a step, and of velocities after its kick.
    carried: CubeTensor,
    aligned: Option<(Aligned, Arrivals)>,
}

/// What supports send on the way back, and what arrives.
struct Arrivals {
    pulls: CubeTensor,
    arrived: CubeTensor,
    twists: Option<[CubeTensor; 2]>,
}

impl Arrivals {
    fn new(aligned: &Aligned) -> Self {
        let (like, n, count) = (&aligned.motion, aligned.motion.shape()[0], aligned.supports.count);
        let array = |rows: usize, width: usize| empty(like, [rows, width], DType::F32);
        Self {
            pulls: array(n, PULL),
            arrived: array(count, ARRIVED),
            twists: (aligned.policy == RIGID).then(|| [array(n, TWIST), array(count, CARRIED)]),
        }
    }
}

/// Gradients of parameters, starting positions and velocities, given the cotangents of all states.
pub(super) fn pulled_back(
    call: &RolloutCall,
    [params, states]: [&CubeTensor; 2],
    v_states: CubeTensor,
) -> [CubeTensor; 3] {
    let (lengths, n, own) = (lengths(call), states.shape()[1], contiguous(v_states));
    let out = [0; 2].map(|_| empty(states, [n, 3], DType::F32));
    let system = DeviceSystem::new(&call.config, &call.edit, params, n);
    let partials = system.partials();
    if n > 0 {
        let walk = Walk::new(call, states, &own, lengths.len());
        for (state, &h) in lengths.iter().enumerate().rev() {
            walk.step_back(&system, &own, &partials, (state, h));
        }
        let ((cubes, dim), client) = (spread(&states.client, n), &states.client);
        let [adjoint, v_q, v_v] = arguments([&walk.adjoint, &out[0], &out[1]]);
        end_adjoint::launch(client, cubes, dim, adjoint, v_q, v_v, call.edit.velocity_scale);
    }
    let [v_q, v_v] = out;
    [system.gradient(&partials), v_q, v_v]
}

impl<'a> Walk<'a> {
    fn new(call: &RolloutCall, states: &'a CubeTensor, own: &CubeTensor, last: usize) -> Self {
        let n = states.shape()[1];
        let adjoint = empty(states, [n, STATE], DType::F32);
        let ((cubes, dim), client) = (units(&states.client, n * STATE), &states.client);
        let [from, to] = arguments([own, &adjoint]);
        begin_adjoint::launch(client, cubes, dim, from, to, last as u32);
        let aligned = Aligned::new(call, states, n).map(|aligned| {
            let arrivals = Arrivals::new(&aligned);
            (aligned, arrivals)
        });
        Self { states, adjoint, carried: empty(states, [n, 6], DType::F32), aligned }
    }

    /// Turns the cotangents of a state into those of the state before it.
    fn step_back(
        &self,
        system: &DeviceSystem,
        own: &CubeTensor,
        partials: &super::system::Partials,
        (state, h): (usize, f32),
    ) {
        if let Some((aligned, arrivals)) = &self.aligned {
            // The step is repeated up to its motions; the tape serves the way back if it holds all particles.
            for rows in system.ranges(state) {
                system.evaluate(self.states, rows);
                system.accelerate(self.states, &aligned.motion, rows, (Use::Candidate, h));
            }
            self.carry_vjp(aligned, arrivals, state);
            self.align_vjp(aligned, arrivals, (state, h));
        }
        let is_on_tape = self.aligned.is_some() && system.ranges(state).count() == 1;
        for rows in system.ranges(state) {
            if !is_on_tape {
                system.evaluate(self.states, rows);
            }
            let carried = self.aligned.as_ref().map(|_| &self.carried);
            system.pull_back([self.states, &self.adjoint], [carried, Some(own)], partials, (rows, h));
        }
    }

    /// The backward pass of velocities that supports carry.
    fn carry_vjp(&self, aligned: &Aligned, arrivals: &Arrivals, state: usize) {
        let (client, n) = (&self.carried.client, self.carried.shape()[0]);
        let (cubes, dim) = spread(client, n);
        let Some([twists, arrived]) = &arrivals.twists else { return };
        let Aligned { supports, motion, .. } = aligned;
        let [of, members, states, adjoint, to] =
            arguments([motion, &supports.members, self.states, &self.adjoint, twists]);
        let (after, k) = (begin_of(state + 1, n), supports.k);
        twist_vjp::launch(client, cubes.clone(), dim, of, members, states, adjoint, to, after, k);
        let [of, states, from, owners, stretches, to] =
            arguments([motion, self.states, twists, &supports.owners, &supports.stretches, arrived]);
        let (of_stretches, stretch_dim) = spread(client, supports.count);
        gather_twists::launch(
            client,
            of_stretches,
            stretch_dim,
            of,
            states,
            from,
            owners,
            stretches,
            to,
            after,
        );
        let [from, arrived, begins, adjoint, carried] =
            arguments([twists, arrived, &supports.begins, &self.adjoint, &self.carried]);
        collect_twists::launch(client, cubes, dim, from, arrived, begins, adjoint, carried);
    }

    /// The backward pass of rotations and aligned positions, and of velocities by the other policies.
    fn align_vjp(&self, aligned: &Aligned, arrivals: &Arrivals, (state, h): (usize, f32)) {
        let (client, n) = (&self.carried.client, self.carried.shape()[0]);
        let (cubes, dim) = spread(client, n);
        let Aligned { supports, policy, motion, .. } = aligned;
        let [of, members, states, adjoint, carried, pulls] = arguments([
            motion,
            &supports.members,
            self.states,
            &self.adjoint,
            &self.carried,
            &arrivals.pulls,
        ]);
        let (count, before, k, per_h) = (n as u32, state as u32, supports.k, 1.0 / h);
        pull_state::launch(
            client, cubes, dim, of, members, states, adjoint, carried, pulls, count, before, k, per_h,
            *policy,
        );
        arrive(
            &aligned.supports,
            [&aligned.motion, &arrivals.pulls, &arrivals.arrived],
            &self.carried,
            Some(h),
        );
    }
}

/// Sums what supports send to their members into rows `[n, 6]`: in a step of a length, cotangents of
/// positions before it and of velocities after its kick; else of positions and candidates.
pub(super) fn arrive(
    supports: &Uploaded,
    [motion, pulls, arrived]: [&CubeTensor; 3],
    carried: &CubeTensor,
    step: Option<f32>,
) {
    let client = &carried.client;
    let (cubes, dim) = spread(client, supports.count);
    let [of, from, owners, stretches, to] =
        arguments([motion, pulls, &supports.owners, &supports.stretches, arrived]);
    gather::launch(client, cubes, dim, of, from, owners, stretches, to);
    let (cubes, dim) = spread(client, carried.shape()[0]);
    let [from, arrived, begins, to] = arguments([pulls, arrived, &supports.begins, carried]);
    collect::launch(client, cubes, dim, from, arrived, begins, to, step.unwrap_or(0.0), step.is_some());
}
