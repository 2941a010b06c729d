//! The operations of [`super::ops`] on devices of CubeCL: kernels of their own. Nothing is read back.
#![allow(
    clippy::assign_op_pattern,
    clippy::needless_range_loop,
    clippy::manual_memcpy,
    clippy::too_many_arguments,
    reason = "kernels are written in the part of the language that CubeCL translates"
)]

mod align;
mod carry;
mod ends;
mod field;
mod field_vjp;
mod fits;
mod outer;
mod products;
mod program;
mod rollout;
mod rotation;
mod sums;
mod system;
mod tables;
mod tiles;
mod uploads;
mod vectors;

use burn::backend::TensorMetadata;
use burn::backend::ops::FloatTensorOps;
use burn::backend::tensor::FloatTensor;
use burn::tensor::DType;
use lgs_tensor::Kernel;
use lgs_tensor::cube::{CubeBackend, CubeTensor, arguments, contiguous, empty, zeros};

use super::RolloutCall;
use super::ops::{AccelerationCall, AlignCall};
use align::{ALIGNED, ARRIVED, PULL, pack, pair_up, pull};
use field::{MOTION, STATE, Use, begin};
use field_vjp::end_adjoint;
use fits::{FIT, fit};
use rollout::{arrive, pulled_back, rolled};
use system::{DeviceSystem, spread};
use uploads::uploaded;

impl Kernel<AccelerationCall, 3> for CubeBackend {
    /// The inputs.
    type Kept = [CubeTensor; 3];

    fn forward_kept(
        call: &AccelerationCall,
        inputs: [FloatTensor<Self>; 3],
    ) -> (FloatTensor<Self>, Self::Kept) {
        let kept = inputs.map(contiguous);
        let [params, q, v] = &kept;
        let n = q.shape()[0];
        let out = empty(q, [n, 3], DType::F32);
        if n > 0 {
            let states = states_of([q, v]);
            let system = DeviceSystem::new(&call.config, &call.edit, params, n);
            for rows in system.ranges(0) {
                system.evaluate(&states, rows);
                system.accelerate(&states, &out, rows, (Use::Result, 0.0));
            }
        }
        (out, kept)
    }

    fn vjp(
        call: &AccelerationCall,
        [params, q, v]: Self::Kept,
        v_out: FloatTensor<Self>,
    ) -> [FloatTensor<Self>; 3] {
        let n = q.shape()[0];
        let system = DeviceSystem::new(&call.config, &call.edit, &params, n);
        let (partials, out) = (system.partials(), [0; 2].map(|_| empty(&q, [n, 3], DType::F32)));
        if n > 0 {
            let states = states_of([&q, &v]);
            let carried = CubeBackend::float_cat(vec![zeros(&q, [n, 3], DType::F32), contiguous(v_out)], 1);
            let carried = contiguous(carried);
            let adjoint = empty(&q, [n, STATE], DType::F32);
            for rows in system.ranges(0) {
                system.evaluate(&states, rows);
                system.pull_back([&states, &adjoint], [Some(&carried), None], &partials, (rows, 1.0));
            }
            let (cubes, dim) = spread(&q.client, n);
            let [from, v_q, v_v] = arguments([&adjoint, &out[0], &out[1]]);
            end_adjoint::launch(&q.client, cubes, dim, from, v_q, v_v, 1.0);
        }
        let [v_q, v_v] = out;
        [system.gradient(&partials), v_q, v_v]
    }
}

/// The state of some particles.
fn states_of([q, v]: [&CubeTensor; 2]) -> CubeTensor {
    let n = q.shape()[0];
    let states = empty(q, [n, STATE], DType::F32);
    let (cubes, dim) = spread(&q.client, n);
    let [from_q, from_v, to] = arguments([q, v, &states]);
    begin::launch(&q.client, cubes, dim, from_q, from_v, to, 1.0);
    states
}

impl Kernel<RolloutCall, 3> for CubeBackend {
    /// The parameters and every state.
    type Kept = [CubeTensor; 2];

    fn forward_kept(call: &RolloutCall, inputs: [FloatTensor<Self>; 3]) -> (FloatTensor<Self>, Self::Kept) {
        let [params, q, v] = inputs.map(contiguous);
        let states = rolled(call, [&params, &q, &v]);
        (states.clone(), [params, states])
    }

    fn vjp(
        call: &RolloutCall,
        [params, states]: Self::Kept,
        v_states: FloatTensor<Self>,
    ) -> [FloatTensor<Self>; 3] {
        pulled_back(call, [&params, &states], v_states)
    }
}

impl Kernel<AlignCall, 2> for CubeBackend {
    /// Motions and fits.
    type Kept = [CubeTensor; 2];

    fn forward_kept(
        AlignCall { supports }: &AlignCall,
        inputs: [FloatTensor<Self>; 2],
    ) -> (FloatTensor<Self>, Self::Kept) {
        let [position, candidate] = inputs.map(contiguous);
        let (n, client) = (position.shape()[0], &position.client);
        assert_eq!(supports.particles(), n, "supports of the particles");
        let [motion, fits, packed] =
            [MOTION, FIT, ALIGNED].map(|width| empty(&position, [n, width], DType::F32));
        if n > 0 {
            let supports = uploaded(supports, &position);
            let (cubes, dim) = spread(client, n);
            let [q, c, to] = arguments([&position, &candidate, &motion]);
            pair_up::launch(client, cubes.clone(), dim, q, c, to);
            let [of, members, to] = arguments([&motion, &supports.members, &fits]);
            fit::launch(client, cubes.clone(), dim, of, members, to, supports.k);
            let [of, from, to] = arguments([&motion, &fits, &packed]);
            pack::launch(client, cubes, dim, of, from, to);
        }
        (packed, [motion, fits])
    }

    fn vjp(
        AlignCall { supports }: &AlignCall,
        [motion, fits]: Self::Kept,
        v_packed: FloatTensor<Self>,
    ) -> [FloatTensor<Self>; 2] {
        let n = motion.shape()[0];
        let carried = empty(&motion, [n, 6], DType::F32);
        if n > 0 {
            let supports = uploaded(supports, &motion);
            let pulls = empty(&motion, [n, PULL], DType::F32);
            let arrived = empty(&motion, [supports.count, ARRIVED], DType::F32);
            let (cubes, dim) = spread(&motion.client, n);
            let v_packed = contiguous(v_packed);
            let [from, v, to] = arguments([&fits, &v_packed, &pulls]);
            pull::launch(&motion.client, cubes, dim, from, v, to, supports.k);
            arrive(&supports, [&motion, &pulls, &arrived], &carried, None);
        }
        let part = |from: usize| {
            let part = Self::float_slice(carried.clone(), &[(0..n).into(), (from..from + 3).into()]);
            contiguous(part)
        };
        [part(0), part(3)]
    }
}
