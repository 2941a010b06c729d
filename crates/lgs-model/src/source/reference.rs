//! The deformation network in plain tensor operations: the twin that tests compare [`super::network`] with, differentiated by Burn.

use burn::tensor::{Tensor, TensorData, activation::relu};

use super::config::{DeformationConfig, LinearRange};
use super::encoding::encode;
use super::network::InputFrame;

fn linear(params: &Tensor<1>, l: &LinearRange, x: Tensor<2>) -> Tensor<2> {
    let weight: Tensor<2> = params.clone().narrow(0, l.weight, l.inputs * l.outputs).reshape([l.outputs, l.inputs]);
    let bias: Tensor<2> = params.clone().narrow(0, l.bias, l.outputs).reshape([1, l.outputs]);
    x.matmul(weight.transpose()) + bias
}

/// Deltas `[n, DELTAS]` of `positions` at a time, from the flat parameters `[P]`.
#[must_use]
pub fn deltas(config: &DeformationConfig, frame: InputFrame, params: &Tensor<1>, positions: &[[f32; 3]], time: f32) -> Tensor<2> {
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
    let gain = if config.anchored { time } else { 1.0 };
    linear(params, &layout.head, hidden).mul_scalar(gain)
}
