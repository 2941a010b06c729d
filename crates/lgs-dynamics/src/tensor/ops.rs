//! The backend extension: the traits, the CPU implementation, the autodiff nodes.

use super::RolloutCall;
use crate::align::{Alignment, align};
use crate::align_vjp::align_vjp;
use crate::batch::acceleration_vjp;
use crate::rollout::{StateCotangents, rollout, rollout_vjp};
use crate::state::{Edit, RolloutSpec, State};
use crate::supports::Supports;
use crate::system::{System, SystemConfig};
use burn::backend::autodiff::checkpoint::{base::Checkpointer, strategy::CheckpointStrategy};
use burn::backend::autodiff::grads::Gradients;
use burn::backend::autodiff::ops::{Backward, Ops, OpsKind};
use burn::backend::ops::FloatTensorOps;
use burn::backend::tensor::FloatTensor;
use burn::backend::{Autodiff, Backend, Flex, TensorMetadata, backend_extension};
use burn::tensor::TensorData;
use std::sync::Arc;

/// Backends that can run systems.
#[backend_extension(Autodiff, Flex)]
pub trait DynamicsOps: Backend {
    /// Accelerations `[n, 3]`.
    fn acceleration(
        params: FloatTensor<Self>,
        q: FloatTensor<Self>,
        v: FloatTensor<Self>,
        config: SystemConfig,
        edit: Edit,
    ) -> FloatTensor<Self>;
    /// States `[states, n, 10]`.
    fn rollout(
        params: FloatTensor<Self>,
        q0: FloatTensor<Self>,
        v0: FloatTensor<Self>,
        call: RolloutCall,
    ) -> FloatTensor<Self>;
    /// Aligned positions and rotation matrices `[n, 3 + 9]`.
    fn align(
        position: FloatTensor<Self>,
        candidate: FloatTensor<Self>,
        supports: Arc<Supports>,
    ) -> FloatTensor<Self>;
}

/// Backends that can pull cotangents back through [`DynamicsOps`]; apart from it, as only the inner backend
/// of an autodiff one is asked.
pub trait DynamicsKernels: DynamicsOps {
    /// Cotangents of parameters, positions and velocities.
    fn acceleration_vjp(
        inputs: [FloatTensor<Self>; 3],
        config: SystemConfig,
        edit: Edit,
        v_out: FloatTensor<Self>,
    ) -> [FloatTensor<Self>; 3];
    /// The packed states and the states themselves.
    fn rollout_states(
        inputs: [FloatTensor<Self>; 3],
        call: &RolloutCall,
    ) -> (FloatTensor<Self>, Arc<Vec<State>>);
    /// Cotangents of parameters, starting positions and velocities.
    fn rollout_vjp(
        params: FloatTensor<Self>,
        call: &RolloutCall,
        states: &[State],
        v_packed: FloatTensor<Self>,
    ) -> [FloatTensor<Self>; 3];
    /// The packed alignment and the alignment itself.
    fn alignment(inputs: [FloatTensor<Self>; 2], supports: &Supports) -> (FloatTensor<Self>, Arc<Alignment>);
    /// Cotangents of positions and candidates.
    fn align_vjp(
        supports: &Supports,
        alignment: &Alignment,
        v_packed: FloatTensor<Self>,
    ) -> [FloatTensor<Self>; 2];
}

fn floats(tensor: &FloatTensor<Flex>) -> Vec<f32> {
    let tensor = tensor.to_contiguous();
    tensor.as_slice::<f32>().expect("a contiguous f32 tensor").to_vec()
}

fn points(tensor: &FloatTensor<Flex>) -> Vec<[f32; 3]> {
    let shape = tensor.shape();
    assert!(shape.num_dims() == 2 && shape[1] == 3, "shape {shape:?} where [n, 3] is expected");
    floats(tensor).as_chunks().0.to_vec()
}

fn tensor<const D: usize>(values: Vec<f32>, shape: [usize; D]) -> FloatTensor<Flex> {
    Flex::float_from_data(TensorData::new(values, shape), &Default::default())
}

fn tensor_of_points(points: Vec<[f32; 3]>) -> FloatTensor<Flex> {
    let n = points.len();
    tensor(points.into_flattened(), [n, 3])
}

impl RolloutCall {
    fn spec(&self) -> RolloutSpec<'_> {
        RolloutSpec {
            dt: self.dt,
            steps: self.steps,
            last_dt: self.last_dt,
            edit: self.edit,
            supports: self.supports.as_deref(),
            velocity_policy: self.velocity_policy,
        }
    }
}

fn pack(states: &[State]) -> FloatTensor<Flex> {
    let n = states.first().map_or(0, State::len);
    let mut values = Vec::with_capacity(states.len() * n * 10);
    for state in states {
        for ((q, v), r) in state.q.iter().zip(&state.v).zip(&state.rotation) {
            values.extend(q.iter().chain(v).chain(r));
        }
    }
    tensor(values, [states.len(), n, 10])
}

fn unpack_cotangents(packed: &[f32], n: usize) -> Vec<StateCotangents> {
    let of_state = |rows: &[[f32; 10]]| StateCotangents {
        q: rows.iter().map(|r| [r[0], r[1], r[2]]).collect(),
        v: rows.iter().map(|r| [r[3], r[4], r[5]]).collect(),
        rotation: rows.iter().map(|r| [r[6], r[7], r[8], r[9]]).collect(),
    };
    packed.as_chunks::<10>().0.chunks(n.max(1)).map(of_state).collect()
}

impl DynamicsOps for Flex {
    fn acceleration(
        params: FloatTensor<Self>,
        q: FloatTensor<Self>,
        v: FloatTensor<Self>,
        config: SystemConfig,
        edit: Edit,
    ) -> FloatTensor<Self> {
        let _span = tracing::trace_span!("accelerations").entered();
        let system = System { config, params: floats(&params) };
        tensor_of_points(system.accelerations(&points(&q), &points(&v), &edit))
    }

    fn rollout(
        params: FloatTensor<Self>,
        q0: FloatTensor<Self>,
        v0: FloatTensor<Self>,
        call: RolloutCall,
    ) -> FloatTensor<Self> {
        Self::rollout_states([params, q0, v0], &call).0
    }

    fn align(
        position: FloatTensor<Self>,
        candidate: FloatTensor<Self>,
        supports: Arc<Supports>,
    ) -> FloatTensor<Self> {
        Self::alignment([position, candidate], &supports).0
    }
}

impl DynamicsKernels for Flex {
    fn acceleration_vjp(
        [params, q, v]: [FloatTensor<Self>; 3],
        config: SystemConfig,
        edit: Edit,
        v_out: FloatTensor<Self>,
    ) -> [FloatTensor<Self>; 3] {
        let _span = tracing::trace_span!("accelerations, backward").entered();
        let system = System { config, params: floats(&params) };
        let g = acceleration_vjp(&system, &points(&q), &points(&v), &edit, &points(&v_out));
        let len = g.params.len();
        [tensor(g.params, [len]), tensor_of_points(g.q), tensor_of_points(g.v)]
    }

    fn rollout_states(
        [params, q0, v0]: [FloatTensor<Self>; 3],
        call: &RolloutCall,
    ) -> (FloatTensor<Self>, Arc<Vec<State>>) {
        let _span = tracing::trace_span!("rollout").entered();
        let system = System { config: call.config, params: floats(&params) };
        let states = rollout(&system, &State::at_start(points(&q0), points(&v0)), &call.spec());
        (pack(&states), Arc::new(states))
    }

    fn rollout_vjp(
        params: FloatTensor<Self>,
        call: &RolloutCall,
        states: &[State],
        v_packed: FloatTensor<Self>,
    ) -> [FloatTensor<Self>; 3] {
        let _span = tracing::trace_span!("rollout, backward").entered();
        let system = System { config: call.config, params: floats(&params) };
        let cotangents = unpack_cotangents(&floats(&v_packed), states[0].len());
        let g = rollout_vjp(&system, &call.spec(), states, &cotangents);
        let len = g.params.len();
        [tensor(g.params, [len]), tensor_of_points(g.q0), tensor_of_points(g.v0)]
    }

    fn alignment(
        [position, candidate]: [FloatTensor<Self>; 2],
        supports: &Supports,
    ) -> (FloatTensor<Self>, Arc<Alignment>) {
        let _span = tracing::trace_span!("alignment").entered();
        let alignment = align(&points(&position), &points(&candidate), supports);
        let mut values = Vec::with_capacity(12 * supports.particles());
        for (aligned, rotation) in alignment.aligned.iter().zip(alignment.rotations()) {
            values.extend(aligned.iter().chain(rotation.as_flattened()));
        }
        (tensor(values, [supports.particles(), 12]), Arc::new(alignment))
    }

    fn align_vjp(
        supports: &Supports,
        alignment: &Alignment,
        v_packed: FloatTensor<Self>,
    ) -> [FloatTensor<Self>; 2] {
        let _span = tracing::trace_span!("alignment, backward").entered();
        let values = floats(&v_packed);
        let rows = values.as_chunks::<12>().0;
        let v_aligned: Vec<[f32; 3]> = rows.iter().map(|r| [r[0], r[1], r[2]]).collect();
        let v_rotations: Vec<_> =
            rows.iter().map(|r| [[r[3], r[4], r[5]], [r[6], r[7], r[8]], [r[9], r[10], r[11]]]).collect();
        let (v_position, v_candidate) = align_vjp(supports, alignment, &v_aligned, &v_rotations);
        [tensor_of_points(v_position), tensor_of_points(v_candidate)]
    }
}

/// Hands cotangents to the parents that ask for them.
fn register<B: Backend, S, const N: usize>(
    ops: Ops<S, N>,
    grads: &mut Gradients,
    cotangents: [FloatTensor<B>; N],
) {
    for (parent, cotangent) in ops.parents.into_iter().zip(cotangents) {
        if let Some(node) = parent {
            grads.register::<B>(node.id, cotangent);
        }
    }
}

#[derive(Debug)]
struct Acceleration;

impl<B: DynamicsKernels> Backward<B, 3> for Acceleration {
    type State = ([FloatTensor<B>; 3], SystemConfig, Edit);

    fn backward(self, ops: Ops<Self::State, 3>, grads: &mut Gradients, _checkpointer: &mut Checkpointer) {
        let v_out = grads.consume::<B>(&ops.node);
        let (inputs, config, edit) = ops.state.clone();
        register::<B, _, 3>(ops, grads, B::acceleration_vjp(inputs, config, edit, v_out));
    }
}

#[derive(Debug)]
struct Rollout;

impl<B: DynamicsKernels> Backward<B, 3> for Rollout {
    type State = (FloatTensor<B>, RolloutCall, Arc<Vec<State>>);

    fn backward(self, ops: Ops<Self::State, 3>, grads: &mut Gradients, _checkpointer: &mut Checkpointer) {
        let v_packed = grads.consume::<B>(&ops.node);
        let (params, call, states) = ops.state.clone();
        register::<B, _, 3>(ops, grads, B::rollout_vjp(params, &call, &states, v_packed));
    }
}

#[derive(Debug)]
struct Align;

impl<B: DynamicsKernels> Backward<B, 2> for Align {
    type State = (Arc<Supports>, Arc<Alignment>);

    fn backward(self, ops: Ops<Self::State, 2>, grads: &mut Gradients, _checkpointer: &mut Checkpointer) {
        let v_packed = grads.consume::<B>(&ops.node);
        let (supports, alignment) = ops.state.clone();
        register::<B, _, 2>(ops, grads, B::align_vjp(&supports, &alignment, v_packed));
    }
}

impl<B: DynamicsKernels, C: CheckpointStrategy> DynamicsOps for Autodiff<B, C> {
    fn acceleration(
        params: FloatTensor<Self>,
        q: FloatTensor<Self>,
        v: FloatTensor<Self>,
        config: SystemConfig,
        edit: Edit,
    ) -> FloatTensor<Self> {
        let nodes = [params.node(), q.node(), v.node()];
        let inputs = [params.into_primitive(), q.into_primitive(), v.into_primitive()];
        let [p, q, v] = inputs.clone();
        let out = B::acceleration(p, q, v, config, edit);
        match Acceleration.prepare::<C>(nodes).compute_bound().stateful() {
            OpsKind::Tracked(prep) => prep.finish((inputs, config, edit), out),
            OpsKind::UnTracked(prep) => prep.finish(out),
        }
    }

    fn rollout(
        params: FloatTensor<Self>,
        q0: FloatTensor<Self>,
        v0: FloatTensor<Self>,
        call: RolloutCall,
    ) -> FloatTensor<Self> {
        let nodes = [params.node(), q0.node(), v0.node()];
        let params = params.into_primitive();
        let (out, states) =
            B::rollout_states([params.clone(), q0.into_primitive(), v0.into_primitive()], &call);
        match Rollout.prepare::<C>(nodes).compute_bound().stateful() {
            OpsKind::Tracked(prep) => prep.finish((params, call, states), out),
            OpsKind::UnTracked(prep) => prep.finish(out),
        }
    }

    fn align(
        position: FloatTensor<Self>,
        candidate: FloatTensor<Self>,
        supports: Arc<Supports>,
    ) -> FloatTensor<Self> {
        let nodes = [position.node(), candidate.node()];
        let inputs = [position.into_primitive(), candidate.into_primitive()];
        let (out, alignment) = B::alignment(inputs, &supports);
        match Align.prepare::<C>(nodes).compute_bound().stateful() {
            OpsKind::Tracked(prep) => prep.finish((supports, alignment), out),
            OpsKind::UnTracked(prep) => prep.finish(out),
        }
    }
}
