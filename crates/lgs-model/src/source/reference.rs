//! The deformation network in plain tensor operations: the twin that tests compare [`super::network`] with, differentiated by Burn.

use burn::tensor::{Tensor, TensorData, activation::relu};

use super::config::{DeformationConfig, LinearRange, MotionHead};
use super::encoding::encode;
use super::network::InputFrame;

fn linear(params: &Tensor<1>, l: &LinearRange, x: Tensor<2>) -> Tensor<2> {
    let weight: Tensor<2> = params.clone().narrow(0, l.weight, l.inputs * l.outputs).reshape([l.outputs, l.inputs]);
    let bias: Tensor<2> = params.clone().narrow(0, l.bias, l.outputs).reshape([1, l.outputs]);
    x.matmul(weight.transpose()) + bias
}

/// Columns of a matrix.
fn columns(x: &Tensor<2>, from: usize, count: usize) -> Tensor<2> {
    x.clone().narrow(1, from, count)
}

/// `a × b`, row by row.
fn cross(a: &Tensor<2>, b: &Tensor<2>) -> Tensor<2> {
    let term = |i, j| columns(a, i, 1) * columns(b, j, 1) - columns(a, j, 1) * columns(b, i, 1);
    Tensor::cat(vec![term(1, 2), term(2, 0), term(0, 1)], 1)
}

/// Inputs of [`deform`].
pub struct ReferenceInput<'a> {
    /// Sizes.
    pub config: &'a DeformationConfig,
    /// The map of positions before encoding.
    pub frame: InputFrame,
    /// Parameters `[P]`.
    pub params: Tensor<1>,
    /// Canonical centres `[n, 3]`.
    pub means: Tensor<2>,
    /// Canonical quaternions `[n, 4]`.
    pub rotations: Tensor<2>,
    /// Time of the frame.
    pub time: f32,
}

/// Pose rows `[n, DELTAS]`, as [`super::network::deform`]. The rotation's coefficients are written for angles that are not tiny.
#[must_use]
pub fn deform(input: ReferenceInput<'_>) -> Tensor<2> {
    let ReferenceInput { config, frame, params, means, rotations, time } = input;
    let points = means.to_data().try_to_vec::<f32>().unwrap_or_default();
    let raw = raw_rows(config, frame, &params, points.as_chunks::<3>().0, time);
    let length = rotations.clone().square().sum_dim(1).sqrt();
    let unit = rotations / length;
    let (a, s) = (columns(&raw, 0, 3), columns(&raw, 7, 3));
    if config.motion_head == MotionHead::Displacement {
        return Tensor::cat(vec![means + a, unit + columns(&raw, 3, 4), s], 1);
    }
    let w = columns(&raw, 3, 3);
    let theta = w.clone().square().sum_dim(1).sqrt();
    let cos = (theta.clone() * 0.5).cos();
    let n = w * ((theta.clone() * 0.5).sin() / theta);
    let center = Tensor::<2>::from_data(TensorData::from([frame.center]), &params.device());
    let u = means - center.clone();
    let twice = cross(&n, &u) * 2.0;
    let turned = u + twice.clone() * cos.clone() + cross(&n, &twice);
    let (unit_w, unit_n) = (columns(&unit, 0, 1), columns(&unit, 1, 3));
    let product_w = cos.clone() * unit_w.clone() - (n.clone() * unit_n.clone()).sum_dim(1);
    let product_n = unit_n.clone() * cos + n.clone() * unit_w + cross(&n, &unit_n);
    Tensor::cat(vec![turned + center + a * frame.scale, product_w, product_n, s], 1)
}

/// Raw rows `[n, DELTAS]` of `positions` at a time, from the flat parameters `[P]`.
fn raw_rows(config: &DeformationConfig, frame: InputFrame, params: &Tensor<1>, positions: &[[f32; 3]], time: f32) -> Tensor<2> {
    let device = params.device();
    let n = positions.len();
    let encoded: Vec<f32> = positions
        .iter()
        .flat_map(|p| {
            let local: [f32; 3] = std::array::from_fn(|i| (p[i] - frame.center[i]) / frame.scale);
            encode(&local, config.position_frequencies)
        })
        .collect();
    let x = Tensor::<2>::from_data(TensorData::new(encoded, [n, config.position_width()]), &device);
    let time_encoding = encode(&[time], config.time_frequencies);
    let width = time_encoding.len();
    let mut t = Tensor::<2>::from_data(TensorData::new(time_encoding, [1, width]), &device);
    let layout = config.layout();
    if let Some([first, second]) = &layout.time {
        t = linear(params, second, relu(linear(params, first, t)));
    }
    let input = Tensor::cat(vec![x, t.expand([n, config.time_width()])], 1);
    let mut hidden = input.clone();
    for (i, l) in layout.layers.iter().enumerate() {
        if i > 0 && config.reads_input(i) {
            hidden = Tensor::cat(vec![input.clone(), hidden], 1);
        }
        hidden = relu(linear(params, l, hidden));
    }
    linear(params, &layout.head, hidden).mul_scalar(config.gain(time))
}
