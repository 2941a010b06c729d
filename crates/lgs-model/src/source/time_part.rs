//! The part of the deformation network that depends on the time alone.
//!
//! All Gaussians of a frame share its time, so the time's columns of a weight act as a bias that is worked
//! out once per call.

use lgs_nn::LinearRange;
use lgs_nn::encoding::encode;

use super::config::{DeformationConfig, NetworkLayout};

/// The hidden layers' biases at a time, and the values that the backward pass needs.
pub(super) struct TimePart {
    encoding: Vec<f32>,
    hidden: Vec<f32>,
    features: Vec<f32>,
    /// Bias plus time columns times features, per hidden layer.
    pub(super) biases: Vec<Vec<f32>>,
}

impl TimePart {
    pub(super) fn new(config: &DeformationConfig, layout: &NetworkLayout, params: &[f32], time: f32) -> Self {
        let encoding = encode(&[time], config.time_frequencies);
        let (hidden, features) = match &layout.time {
            Some([first, second]) => {
                let hidden: Vec<f32> =
                    linear_row(first, params, &encoding).into_iter().map(|v| v.max(0.0)).collect();
                let features = linear_row(second, params, &hidden);
                (hidden, features)
            }
            None => (Vec::new(), encoding.clone()),
        };
        let first_column = config.position_width();
        let biases = layout.mlp.hidden.iter().enumerate().map(|(i, l)| {
            let mut bias = params[l.bias..l.bias + l.outputs].to_vec();
            if layout.mlp.reads_inputs(i) {
                for (o, b) in bias.iter_mut().enumerate() {
                    let row = &params[l.weight + o * l.inputs + first_column..][..features.len()];
                    *b += dot(row, &features);
                }
            }
            bias
        });
        let biases = biases.collect();
        Self { encoding, hidden, features, biases }
    }

    /// Turns the gradients of the effective biases, already in `v_params`, into those of time columns and
    /// time network.
    pub(super) fn backward(
        &self,
        config: &DeformationConfig,
        layout: &NetworkLayout,
        params: &[f32],
        v_params: &mut [f32],
    ) {
        let first_column = config.position_width();
        let mut v_features = vec![0.0; self.features.len()];
        for (_, l) in layout.mlp.hidden.iter().enumerate().filter(|&(i, _)| layout.mlp.reads_inputs(i)) {
            for o in 0..l.outputs {
                let v_bias = v_params[l.bias + o];
                let row = l.weight + o * l.inputs + first_column;
                for (t, &feature) in self.features.iter().enumerate() {
                    v_params[row + t] += v_bias * feature;
                    v_features[t] += v_bias * params[row + t];
                }
            }
        }
        let Some([first, second]) = &layout.time else { return };
        let mut v_hidden = linear_row_vjp(second, params, &self.hidden, &v_features, v_params);
        v_hidden.iter_mut().zip(&self.hidden).filter(|(_, h)| **h <= 0.0).for_each(|(v, _)| *v = 0.0);
        linear_row_vjp(first, params, &self.encoding, &v_hidden, v_params);
    }
}

fn dot(a: &[f32], b: &[f32]) -> f32 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

fn linear_row(l: &LinearRange, params: &[f32], x: &[f32]) -> Vec<f32> {
    (0..l.outputs)
        .map(|o| params[l.bias + o] + dot(&params[l.weight + o * l.inputs..][..l.inputs], x))
        .collect()
}

fn linear_row_vjp(l: &LinearRange, params: &[f32], x: &[f32], v_z: &[f32], v_params: &mut [f32]) -> Vec<f32> {
    let mut v_x = vec![0.0; l.inputs];
    for (o, &v) in v_z.iter().enumerate() {
        v_params[l.bias + o] += v;
        let row = l.weight + o * l.inputs;
        for i in 0..l.inputs {
            v_params[row + i] += v * x[i];
            v_x[i] += v * params[row + i];
        }
    }
    v_x
}
