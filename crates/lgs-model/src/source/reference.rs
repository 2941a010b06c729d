//! The deformation network in plain tensor operations: the twin that tests compare [`super::network`] with,
//! differentiated by Burn.

use burn::tensor::{Tensor, TensorData, activation::relu};

use lgs_nn::encoding::encode;
use lgs_nn::{LinearRange, MlpLayout};

use super::config::{DeformationConfig, MotionHead};
use super::input::InputFrame;
use super::pose_network::PoseNetwork;

fn linear(params: &Tensor<1>, l: &LinearRange, x: Tensor<2>) -> Tensor<2> {
    let weight: Tensor<2> =
        params.clone().narrow(0, l.weight, l.inputs * l.outputs).reshape([l.outputs, l.inputs]);
    let bias: Tensor<2> = params.clone().narrow(0, l.bias, l.outputs).reshape([1, l.outputs]);
    x.matmul(weight.transpose()) + bias
}

/// Columns of a matrix.
pub(super) fn columns(x: &Tensor<2>, from: usize, count: usize) -> Tensor<2> {
    x.clone().narrow(1, from, count)
}

/// `a × b`, row by row.
pub(super) fn cross(a: &Tensor<2>, b: &Tensor<2>) -> Tensor<2> {
    let term = |i, j| columns(a, i, 1) * columns(b, j, 1) - columns(a, j, 1) * columns(b, i, 1);
    Tensor::cat(vec![term(1, 2), term(2, 0), term(0, 1)], 1)
}

/// The product of quaternions, row by row.
pub(super) fn quat_mul(a: &Tensor<2>, b: &Tensor<2>) -> Tensor<2> {
    let ((a_w, a_n), (b_w, b_n)) =
        ((columns(a, 0, 1), columns(a, 1, 3)), (columns(b, 0, 1), columns(b, 1, 3)));
    let w = a_w.clone() * b_w.clone() - (a_n.clone() * b_n.clone()).sum_dim(1);
    let n = b_n.clone() * a_w + a_n.clone() * b_w + cross(&a_n, &b_n);
    Tensor::cat(vec![w, n], 1)
}

/// Inputs of [`deform`] and of the twins of other networks: those of [`NetworkInput`](super::NetworkInput)
/// as tensors.
pub struct ReferenceInput<'a, N: PoseNetwork> {
    /// Sizes.
    pub config: &'a N,
    /// The map of positions before encoding.
    pub frame: InputFrame,
    /// Parameters `[P]`.
    pub params: Tensor<1>,
    /// Canonical centres `[n, 3]`.
    pub means: Tensor<2>,
    /// Canonical quaternions `[n, 4]`.
    pub rotations: Tensor<2>,
    /// The time of the call, or its times.
    pub time: N::Time,
}

/// Pose rows `[n, DELTAS]`, as [`super::tensor::deform`]. The rotation's coefficients are written for angles
/// that are not tiny.
#[must_use]
pub fn deform(input: ReferenceInput<'_, DeformationConfig>) -> Tensor<2> {
    deform_with_codes(input, None)
}

/// The same for a network that also reads codes `[n, code]`.
pub(super) fn deform_with_codes(
    input: ReferenceInput<'_, DeformationConfig>,
    codes: Option<Tensor<2>>,
) -> Tensor<2> {
    let ReferenceInput { config, frame, params, means, rotations, time } = input;
    let mut input =
        vec![encoded_positions(config, frame, &means), time_features(config, &params, time, means.dims()[0])];
    input.extend(codes);
    let raw = mlp(&params, &config.layout().mlp, &Tensor::cat(input, 1), relu).mul_scalar(config.gain(time));
    let length = rotations.clone().square().sum_dim(1).sqrt();
    let unit = rotations / length;
    let (a, s) = (columns(&raw, 0, 3), columns(&raw, 7, 3));
    if config.motion_head == MotionHead::Displacement {
        return Tensor::cat(vec![means + a, unit + columns(&raw, 3, 4), s], 1);
    }
    if config.motion_head == MotionHead::Turn {
        let r = columns(&raw, 3, 4);
        let length = r.clone().square().sum_dim(1).sqrt();
        return Tensor::cat(vec![means + a, quat_mul(&(r / length), &unit), s], 1);
    }
    let w = columns(&raw, 3, 3);
    let theta = w.clone().square().sum_dim(1).sqrt();
    let cos = (theta.clone() * 0.5).cos();
    let n = w * ((theta.clone() * 0.5).sin() / theta);
    let center = Tensor::<2>::from_data(TensorData::from([frame.center]), &params.device());
    let u = means - center.clone();
    let twice = cross(&n, &u) * 2.0;
    let turned = u + twice.clone() * cos.clone() + cross(&n, &twice);
    let product = quat_mul(&Tensor::cat(vec![cos, n], 1), &unit);
    Tensor::cat(vec![turned + center + a * frame.scale, product, s], 1)
}

/// Encodings `[n, features]` of centres, as constants.
pub(super) fn encoded_positions(
    config: &DeformationConfig,
    frame: InputFrame,
    means: &Tensor<2>,
) -> Tensor<2> {
    let points = means.to_data().try_to_vec::<f32>().unwrap_or_default();
    let rows = points.as_chunks::<3>().0.iter().flat_map(|p| {
        let local: [f32; 3] = std::array::from_fn(|i| (p[i] - frame.center[i]) / frame.scale);
        encode(&local, config.position_frequencies)
    });
    Tensor::from_data(
        TensorData::new(rows.collect(), [means.dims()[0], config.position_width()]),
        &means.device(),
    )
}

/// Features of the time at the network's input, `[n, features]`.
fn time_features(config: &DeformationConfig, params: &Tensor<1>, time: f32, n: usize) -> Tensor<2> {
    let encoding = encode(&[time], config.time_frequencies);
    let width = encoding.len();
    let mut t = Tensor::<2>::from_data(TensorData::new(encoding, [1, width]), &params.device());
    if let Some([first, second]) = &config.layout().time {
        t = linear(params, second, relu(linear(params, first, t)));
    }
    t.expand([n, config.time_width()])
}

/// A chain of linear layers with activations between them, of which one may read the input again.
pub(super) fn mlp(
    params: &Tensor<1>,
    layout: &MlpLayout,
    input: &Tensor<2>,
    activation: fn(Tensor<2>) -> Tensor<2>,
) -> Tensor<2> {
    let mut hidden = input.clone();
    for (i, l) in layout.hidden.iter().enumerate() {
        if i > 0 && layout.reads_inputs(i) {
            hidden = Tensor::cat(vec![input.clone(), hidden], 1);
        }
        hidden = activation(linear(params, l, hidden));
    }
    linear(params, &layout.head, hidden)
}
