//! FreeGave's networks on devices of CubeCL: layers by products of matrices, the integration by kernels of
//! its own. Nothing is read back.
#![allow(
    clippy::assign_op_pattern,
    clippy::needless_range_loop,
    reason = "kernels are written in the part of the language that CubeCL translates"
)]

mod carry;

use std::sync::Arc;

use burn::backend::TensorMetadata;
use burn::backend::tensor::FloatTensor;
use burn::tensor::{DType, Tensor, TensorData};
use lgs_nn::Activation;
use lgs_nn::encoding::encode;
use lgs_tensor::Kernel;
use lgs_tensor::cube::product::{Matrix, primitive, product, tensor};
use lgs_tensor::cube::{CubeBackend, CubeTensor, arguments, contiguous, empty, units};

use super::config::FreeGaveConfig;
use super::input::Learns;
use super::twist::{TWIST, steps, twist_times};
use crate::source::config::{DELTAS, DeformationConfig, RotationForm};
use crate::source::cube::mlp::{Gradient, Taped, mlp, mlp_vjp};
use crate::source::cube::{DeformKept, backward, cotangents, encoded, forward};
use crate::source::tensor::NetworkCall;
use carry::{FIXED, REFERENCE, carry_rows, carry_rows_vjp};

/// The constants of a call.
type Call = NetworkCall<FreeGaveConfig>;

/// What a forward pass leaves on the device.
#[derive(Clone, Debug)]
pub struct FreeGaveKept {
    params: Tensor<1>,
    code_tape: Taped,
    deformation: DeformKept,
    /// Present if the velocity field was asked.
    flow: Option<FlowKept>,
}

#[derive(Clone, Debug)]
struct FlowKept {
    /// Lengths of the steps `[S]`.
    steps: CubeTensor,
    /// Motion bases `[k, 2 S TWIST]`, and the times' network.
    bases: Tensor<2>,
    velocity_tape: Taped,
    /// Mixing weights `[n, k]`, and the segment head.
    weights: Tensor<2>,
    segment_tape: Taped,
    /// Twists `[n, 2 S TWIST]`, pose rows before the integration and turns `[n, 4]` along it.
    twists: CubeTensor,
    rows: CubeTensor,
    turns: CubeTensor,
}

/// The call of the deformation network within that of all.
fn deformation(call: &Call) -> NetworkCall<DeformationConfig> {
    NetworkCall { config: Arc::new(call.config.deformation.clone()), frame: call.frame, time: call.time.from }
}

/// Motion bases `[k, times TWIST]` at some times.
fn bases(call: &Call, params: &Tensor<1>, times: &[f32]) -> (Tensor<2>, Taped) {
    let frequencies = call.config.velocity.time_frequencies;
    let encoding: Vec<f32> = times.iter().flat_map(|time| encode(&[*time], frequencies)).collect();
    let shape = [times.len(), encoding.len() / times.len()];
    let input = Tensor::from_data(TensorData::new(encoding, shape), &params.device());
    let (out, taped) = mlp(params, &call.config.layout().velocity, &input, Activation::Silu);
    let (k, count) = (call.config.bases(), times.len());
    (out.reshape([count, k, TWIST]).swap_dims(0, 1).reshape([k, count * TWIST]), taped)
}

/// The form of the turns that a call asks for.
fn form(call: &Call) -> u32 {
    match (call.time.turns, call.config.velocity.rotation) {
        (false, _) => 0,
        (true, RotationForm::Reference) => REFERENCE,
        (true, RotationForm::Fixed) => FIXED,
    }
}

/// Carries pose rows through the velocity field.
fn flow(
    call: &Call,
    params: &Tensor<1>,
    codes: &Tensor<2>,
    lengths: &[f32],
    rows: CubeTensor,
) -> (CubeTensor, FlowKept) {
    let (weights, segment_tape) = mlp(params, &call.config.layout().segment, codes, Activation::Relu);
    let (bases, velocity_tape) = bases(call, params, &twist_times(call.time.from, lengths));
    let twists = primitive(product(&Matrix::of(&weights), &Matrix::of(&bases)));
    let steps = primitive(Tensor::<1>::from_floats(lengths, &params.device()));
    let n = rows.shape()[0];
    let [out, turns] = [DELTAS, 4].map(|width| empty(&rows, [n, width], DType::F32));
    let ((count, dim), client) = (units(&rows.client, n), rows.client.clone());
    let [by, along, from, to, turning] = arguments([&twists, &steps, &rows, &out, &turns]);
    carry_rows::launch(&client, count, dim, by, along, from, to, turning, form(call));
    (out, FlowKept { steps, bases, velocity_tape, weights, segment_tape, twists, rows, turns })
}

/// Cotangents of the codes and of the rows before the integration; those of segment head and velocity network
/// are written to the gradient.
fn flow_vjp(
    call: &Call,
    params: &Tensor<1>,
    flow: &FlowKept,
    v_poses: CubeTensor,
    gradient: &Gradient,
) -> (Tensor<2>, CubeTensor) {
    let FlowKept { steps, twists, rows, turns, .. } = flow;
    let n = rows.shape()[0];
    let v_twists = empty(twists, twists.shape(), DType::F32);
    let v_rows = empty(rows, [n, DELTAS], DType::F32);
    let ((count, dim), client, v) = (units(&rows.client, n), &rows.client, contiguous(v_poses));
    let [by, along, from, turning, v, to, to_rows] =
        arguments([twists, steps, rows, turns, &v, &v_twists, &v_rows]);
    carry_rows_vjp::launch(client, count, dim, by, along, from, turning, v, to, to_rows);
    let (layout, v_twists) = (call.config.layout(), tensor::<2>(v_twists));
    let v_bases = product(&Matrix::of(&flow.weights).transposed(), &Matrix::of(&v_twists));
    let [k, width] = v_bases.dims();
    let count = width / TWIST;
    let v_out = v_bases.reshape([k, count, TWIST]).swap_dims(0, 1).reshape([count, k * TWIST]);
    mlp_vjp(params, &layout.velocity, &flow.velocity_tape, &v_out, gradient);
    let v_weights = product(&Matrix::of(&v_twists), &Matrix::of(&flow.bases).transposed());
    (mlp_vjp(params, &layout.segment, &flow.segment_tape, &v_weights, gradient), v_rows)
}

impl Kernel<Call, 3> for CubeBackend {
    type Kept = FreeGaveKept;

    fn forward_kept(
        call: &Call,
        [params, means, rotations]: [FloatTensor<Self>; 3],
    ) -> (FloatTensor<Self>, FreeGaveKept) {
        let (params, gaussians) = (tensor::<1>(params), [means, rotations].map(contiguous));
        let own = deformation(call);
        let encoded = encoded(&own, &gaussians[0]);
        let (codes, code_tape) = mlp(&params, &call.config.layout().code, &encoded, Activation::Relu);
        let (rows, deformation) = forward(&own, &params, gaussians, encoded, Some(codes.clone()));
        let lengths = steps(call.time.from, call.time.to, call.time.longest_step);
        let carried = (!lengths.is_empty()).then(|| flow(call, &params, &codes, &lengths, rows.clone()));
        let (rows, flow) = carried.map_or((rows, None), |(rows, flow)| (rows, Some(flow)));
        (rows, FreeGaveKept { params, code_tape, deformation, flow })
    }

    fn vjp(call: &Call, kept: FreeGaveKept, v_poses: FloatTensor<Self>) -> [FloatTensor<Self>; 3] {
        let FreeGaveKept { params, code_tape, deformation: deformed, flow } = kept;
        let gradient = Gradient::none(&params);
        let (v_from_flow, mut v_rows) = match &flow {
            Some(flow) => {
                let (v_codes, v_rows) = flow_vjp(call, &params, flow, v_poses, &gradient);
                (Some(v_codes), v_rows)
            }
            None => (None, v_poses),
        };
        if call.time.learns == Learns::Velocity {
            v_rows = primitive(tensor::<2>(v_rows).zeros_like());
        }
        let (v_gaussians, v_codes) = backward(&deformation(call), &deformed, v_rows, &gradient);
        let v_codes = v_from_flow.map_or(v_codes.clone(), |v| v_codes + v);
        mlp_vjp(&params, &call.config.layout().code, &code_tape, &v_codes, &gradient);
        cotangents(gradient, &v_gaussians)
    }
}
