//! The kernels of [`super::ops`] on the CPU: conversions around the functions on slices.

use super::RolloutCall;
use super::ops::{AccelerationCall, AlignCall};
use crate::align::{Alignment, align};
use crate::align_vjp::align_vjp;
use crate::batch::acceleration_vjp;
use crate::rollout::{rollout, rollout_vjp};
use crate::state::{State, StateCotangents};
use crate::system::{System, SystemConfig};
use burn::backend::Flex;
use burn::backend::tensor::FloatTensor;
use lgs_tensor::Kernel;
use lgs_tensor::flex::{floats, rows, tensor, tensor_of_rows};
use std::sync::Arc;

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

fn system(config: &SystemConfig, params: &FloatTensor<Flex>) -> System {
    System { config: *config, params: floats(&params.to_contiguous()).to_vec() }
}

fn points(tensor: &FloatTensor<Flex>) -> Vec<[f32; 3]> {
    rows(&tensor.to_contiguous()).to_vec()
}

/// Cotangents of parameters, positions and velocities as tensors.
fn cotangents(params: Vec<f32>, q: Vec<[f32; 3]>, v: Vec<[f32; 3]>) -> [FloatTensor<Flex>; 3] {
    let len = params.len();
    [tensor(params, [len]), tensor_of_rows(q), tensor_of_rows(v)]
}

impl Kernel<AccelerationCall, 3> for Flex {
    /// The inputs.
    type Kept = [FloatTensor<Self>; 3];

    fn forward_kept(
        call: &AccelerationCall,
        inputs: [FloatTensor<Self>; 3],
    ) -> (FloatTensor<Self>, Self::Kept) {
        let [params, q, v] = &inputs;
        let out = system(&call.config, params).accelerations(&points(q), &points(v), &call.edit);
        (tensor_of_rows(out), inputs)
    }

    fn vjp(
        call: &AccelerationCall,
        [params, q, v]: Self::Kept,
        v_out: FloatTensor<Self>,
    ) -> [FloatTensor<Self>; 3] {
        let system = system(&call.config, &params);
        let g = acceleration_vjp(&system, &points(&q), &points(&v), &call.edit, &points(&v_out));
        cotangents(g.params, g.q, g.v)
    }
}

impl Kernel<RolloutCall, 3> for Flex {
    /// The parameters and every state.
    type Kept = (FloatTensor<Self>, Arc<Vec<State>>);

    fn forward_kept(
        call: &RolloutCall,
        [params, q0, v0]: [FloatTensor<Self>; 3],
    ) -> (FloatTensor<Self>, Self::Kept) {
        let start = State::at_start(points(&q0), points(&v0));
        let states = rollout(&system(&call.config, &params), &start, &call.spec());
        (pack(&states), (params, Arc::new(states)))
    }

    fn vjp(
        call: &RolloutCall,
        (params, states): Self::Kept,
        v_packed: FloatTensor<Self>,
    ) -> [FloatTensor<Self>; 3] {
        let v_states = unpack_cotangents(floats(&v_packed.to_contiguous()), states[0].len());
        let g = rollout_vjp(&system(&call.config, &params), &call.spec(), &states, &v_states);
        cotangents(g.params, g.q0, g.v0)
    }
}

impl Kernel<AlignCall, 2> for Flex {
    type Kept = Arc<Alignment>;

    fn forward_kept(
        AlignCall { supports }: &AlignCall,
        [position, candidate]: [FloatTensor<Self>; 2],
    ) -> (FloatTensor<Self>, Self::Kept) {
        let alignment = align(&points(&position), &points(&candidate), supports);
        let mut values = Vec::with_capacity(12 * supports.particles());
        for (aligned, rotation) in alignment.aligned.iter().zip(alignment.rotations()) {
            values.extend(aligned.iter().chain(rotation.as_flattened()));
        }
        (tensor(values, [supports.particles(), 12]), Arc::new(alignment))
    }

    fn vjp(
        AlignCall { supports }: &AlignCall,
        alignment: Self::Kept,
        v_packed: FloatTensor<Self>,
    ) -> [FloatTensor<Self>; 2] {
        let v_packed = v_packed.to_contiguous();
        let rows = rows::<12>(&v_packed);
        let v_aligned: Vec<[f32; 3]> = rows.iter().map(|r| [r[0], r[1], r[2]]).collect();
        let v_rotations: Vec<_> =
            rows.iter().map(|r| [[r[3], r[4], r[5]], [r[6], r[7], r[8]], [r[9], r[10], r[11]]]).collect();
        let (v_position, v_candidate) = align_vjp(supports, &alignment, &v_aligned, &v_rotations);
        [tensor_of_rows(v_position), tensor_of_rows(v_candidate)]
    }
}
