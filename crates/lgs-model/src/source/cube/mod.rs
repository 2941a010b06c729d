//! The deformation network on devices of CubeCL: encodings and poses by kernels of its own, layers by the
//! products of the tensor library. Nothing is read back.
#![allow(
    clippy::assign_op_pattern,
    reason = "kernels are written in the part of the language that CubeCL translates"
)]

mod gate;
pub(in crate::source) mod mlp;
pub(in crate::source) mod quaternions;
mod rows;

use burn::backend::TensorMetadata;
use burn::backend::tensor::FloatTensor;
use burn::tensor::{DType, Tensor, TensorData};
use cubecl::prelude::BufferArg;
use lgs_nn::Activation;
use lgs_nn::encoding::encode as encode_values;
use lgs_tensor::Kernel;
use lgs_tensor::cube::product::{column_sums, primitive, tensor};
use lgs_tensor::cube::{CubeBackend, CubeTensor, arguments, contiguous, empty, units};

use super::config::{DELTAS, DeformationConfig, MotionHead};
use super::tensor::NetworkCall;
use gate::relu_vjp;
use mlp::{Gradient, Taped, linear, linear_relu, linear_vjp, mlp, mlp_vjp};
use rows::{GAUSSIAN, MapLaunch, RIGID, TURN, encode, poses, poses_vjp};

/// The constants of a call.
type Call = NetworkCall<DeformationConfig>;

/// What a forward pass leaves on the device.
#[derive(Clone, Debug)]
pub struct DeformKept {
    params: Tensor<1>,
    means: CubeTensor,
    rotations: CubeTensor,
    time: TimeKept,
    taped: Taped,
    raw: CubeTensor,
}

impl DeformKept {
    /// The arguments that the kernels of rows begin with.
    fn rows(&self) -> [BufferArg; 3] {
        arguments([&self.raw, &self.means, &self.rotations])
    }
}

/// The time's encoding and the values of its network's hidden layer, if there is one.
#[derive(Clone, Debug)]
struct TimeKept {
    encoding: Tensor<2>,
    hidden: Option<Tensor<2>>,
}

fn map(spec: &Call) -> MapLaunch {
    let [x, y, z] = spec.frame.center;
    MapLaunch::new(x, y, z, spec.frame.scale)
}

fn head(config: &DeformationConfig) -> u32 {
    match config.motion_head {
        MotionHead::Displacement => 0,
        MotionHead::Turn => TURN,
        MotionHead::Rigid => RIGID,
    }
}

/// Features `[1, features]` of the time.
fn time_features(spec: &Call, params: &Tensor<1>) -> (Tensor<2>, TimeKept) {
    let encoding = encode_values(&[spec.time], spec.config.time_frequencies);
    let width = encoding.len();
    let encoding = Tensor::<2>::from_data(TensorData::new(encoding, [1, width]), &params.device());
    let Some([first, second]) = &spec.config.layout().time else {
        return (encoding.clone(), TimeKept { encoding, hidden: None });
    };
    let hidden = linear_relu(params, first, &encoding);
    (linear(params, second, &hidden), TimeKept { encoding, hidden: Some(hidden) })
}

/// Encodings `[n, features]` of positions, which are constants to them.
pub(in crate::source) fn encoded(spec: &Call, means: &CubeTensor) -> Tensor<2> {
    let n = means.shape()[0];
    let (width, frequencies) = (spec.config.position_width(), spec.config.position_frequencies);
    let out = empty(means, [n, width], DType::F32);
    let (count, dim) = units(&means.client, n * width);
    let [from, to] = [means.clone(), out.clone()].map(CubeTensor::into_buffer_arg);
    encode::launch(&means.client, count, dim, from, to, map(spec), frequencies);
    tensor(out)
}

fn pose_rows(spec: &Call, kept: &DeformKept) -> CubeTensor {
    let n = kept.means.shape()[0];
    let out = empty(&kept.means, [n, DELTAS], DType::F32);
    let ((count, dim), [raw, means, rotations]) = (units(&out.client, n), kept.rows());
    let (client, rows, head) = (&out.client, out.clone().into_buffer_arg(), head(&spec.config));
    poses::launch(client, count, dim, raw, means, rotations, rows, map(spec), head);
    out
}

/// Cotangents of raw rows, and of centres and quaternions together.
fn pose_rows_vjp(spec: &Call, kept: &DeformKept, v_poses: CubeTensor) -> [CubeTensor; 2] {
    let n = kept.means.shape()[0];
    let out = [DELTAS, GAUSSIAN].map(|width| empty(&kept.means, [n, width], DType::F32));
    let client = &kept.means.client;
    let ((count, dim), [raw, means, rotations]) = (units(client, n), kept.rows());
    let (v, head) = (contiguous(v_poses).into_buffer_arg(), head(&spec.config));
    let [v_raw, v_own] = out.clone().map(CubeTensor::into_buffer_arg);
    poses_vjp::launch(client, count, dim, raw, means, rotations, v, v_raw, v_own, map(spec), head);
    out
}

/// Writes the gradients of the time's network, given the cotangent of its features.
fn time_vjp(spec: &Call, kept: &DeformKept, v: &Tensor<2>, gradient: &Gradient) {
    let (Some([first, second]), Some(hidden)) = (&spec.config.layout().time, &kept.time.hidden) else {
        return;
    };
    let v = linear_vjp(&kept.params, second, hidden, v, gradient);
    let v = relu_vjp((hidden, 0), (&v, 0), first.outputs);
    linear_vjp(&kept.params, first, &kept.time.encoding, &v, gradient);
}

/// Pose rows of Gaussians with encoded positions and, where the network reads them, codes `[n, code]`; the
/// network's parameters are the first of those given.
pub(in crate::source) fn forward(
    spec: &Call,
    params: &Tensor<1>,
    [means, rotations]: [CubeTensor; 2],
    encoded: Tensor<2>,
    codes: Option<Tensor<2>>,
) -> (CubeTensor, DeformKept) {
    let (features, time) = time_features(spec, params);
    let [n, width] = [means.shape()[0], features.dims()[1]];
    let inputs = [Some(encoded), Some(features.expand([n, width])), codes].into_iter().flatten();
    let input = Tensor::cat(inputs.collect(), 1);
    let (raw, taped) = mlp(params, &spec.config.layout().mlp, &input, Activation::Relu);
    let raw = primitive(raw.mul_scalar(spec.config.gain(spec.time)));
    let kept = DeformKept { params: params.clone(), means, rotations, time, taped, raw };
    (pose_rows(spec, &kept), kept)
}

/// Cotangents `[n, GAUSSIAN]` of centres and quaternions, and of the codes; those of parameters are written
/// to the gradient.
pub(in crate::source) fn backward(
    spec: &Call,
    kept: &DeformKept,
    v_poses: CubeTensor,
    gradient: &Gradient,
) -> (Tensor<2>, Tensor<2>) {
    let [v_raw, v_gaussians] = pose_rows_vjp(spec, kept, v_poses);
    let v_raw = tensor::<2>(v_raw).mul_scalar(spec.config.gain(spec.time));
    let v_input = mlp_vjp(&kept.params, &spec.config.layout().mlp, &kept.taped, &v_raw, gradient);
    let (position, time) = (spec.config.position_width(), spec.config.time_width());
    time_vjp(spec, kept, &column_sums(&v_input.clone().narrow(1, position, time)), gradient);
    let codes = v_input.dims()[1] - position - time;
    let v_codes = if codes > 0 { v_input.narrow(1, position + time, codes) } else { v_input };
    (tensor(v_gaussians), v_codes)
}

/// Cotangents of a network's inputs, from the gradient and those of Gaussians `[n, GAUSSIAN]`.
pub(in crate::source) fn cotangents(gradient: Gradient, v_gaussians: &Tensor<2>) -> [CubeTensor; 3] {
    let part = |from: usize, count: usize| primitive(v_gaussians.clone().narrow(1, from, count));
    [gradient.into_inner(), part(0, 3), part(3, 4)]
}

impl Kernel<Call, 3> for CubeBackend {
    type Kept = DeformKept;

    fn forward_kept(
        spec: &Call,
        [params, means, rotations]: [FloatTensor<Self>; 3],
    ) -> (FloatTensor<Self>, DeformKept) {
        let gaussians = [means, rotations].map(contiguous);
        let encoded = encoded(spec, &gaussians[0]);
        forward(spec, &tensor(params), gaussians, encoded, None)
    }

    fn vjp(spec: &Call, kept: DeformKept, v_poses: FloatTensor<Self>) -> [FloatTensor<Self>; 3] {
        let gradient = Gradient::none(&kept.params);
        let (v_gaussians, _) = backward(spec, &kept, v_poses, &gradient);
        cotangents(gradient, &v_gaussians)
    }
}
