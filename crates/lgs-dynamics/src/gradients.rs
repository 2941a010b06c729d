//! Parameter gradients in the shape in which products add to them: hidden units padded to whole vectors,
//! first layers transposed.

use crate::block::WIDTH;
use crate::block::buffer::Buffer;
use crate::block::packed::{Right, padded};
use crate::block::product::{Add, Left, Product, Rows};
use crate::mlp_shape::MlpShape;

/// A one for every particle of a block.
const ONES: [f32; WIDTH] = [1.0; WIDTH];

/// The gradients of one layer.
#[derive(Debug)]
pub(crate) struct LayerGradients {
    /// `[outputs, inputs]`; of the first layer `[inputs, outputs]`. The second index is padded.
    weight: Buffer,
    /// `[outputs]`, padded.
    bias: Buffer,
    rows: usize,
    stride: usize,
}

impl LayerGradients {
    fn new(shape: &MlpShape, layer: usize) -> Self {
        let (outputs, inputs) = (shape.layer_outputs(layer), shape.layer_inputs(layer));
        let (rows, columns) = if layer == 0 { (inputs, outputs) } else { (outputs, inputs) };
        let stride = padded(columns);
        Self { weight: Buffer::zeros(rows * stride), bias: Buffer::zeros(padded(outputs)), rows, stride }
    }

    /// Zeros for all layers of a network.
    pub(crate) fn of_network(shape: &MlpShape) -> Vec<Self> {
        (0..=shape.hidden_layers).map(|layer| Self::new(shape, layer)).collect()
    }

    /// Adds `leftᵀ right` summed over the particles of a block, `right: [WIDTH, stride]`, to the weight.
    pub(crate) fn add_outer<L: Left>(&mut self, left: L, right: &[f32]) {
        let epilogue = Add(&mut self.weight, self.stride);
        Product { left, rows: self.rows, right: Right::plain(right, self.stride), epilogue }.run();
    }

    /// Adds the sum of `v_z: [WIDTH, outputs]` over particles to the bias.
    pub(crate) fn add_bias(&mut self, v_z: &[f32]) {
        let columns = self.bias.len();
        let epilogue = Add(&mut self.bias, columns);
        Product { left: Rows(&ONES, WIDTH), rows: 1, right: Right::plain(v_z, columns), epilogue }.run();
    }

    /// Adds the sum of `v: [WIDTH, inputs]` over particles to the weight of the only output.
    pub(crate) fn add_weight_sums(&mut self, v: &[f32]) {
        self.add_outer(Rows(&ONES, WIDTH), v);
    }

    /// Adds the sums of the rows `v_y: [outputs, WIDTH]` to the bias.
    pub(crate) fn add_row_sums(&mut self, v_y: &[f32]) {
        for (sum, row) in self.bias.iter_mut().zip(v_y.chunks_exact(WIDTH)) {
            *sum += row.iter().sum::<f32>();
        }
    }

    /// Adds the gradients of a layer to the flat parameter vector.
    fn add_to(&self, shape: &MlpShape, layer: usize, flat: &mut [f32]) {
        for (sum, &value) in flat[shape.bias(layer)].iter_mut().zip(self.bias.iter()) {
            *sum += value;
        }
        let inputs = shape.layer_inputs(layer);
        for (output, row) in flat[shape.weight(layer)].chunks_exact_mut(inputs).enumerate() {
            for (input, sum) in row.iter_mut().enumerate() {
                *sum += self.weight
                    [if layer == 0 { input * self.stride + output } else { output * self.stride + input }];
            }
        }
    }
}

/// Adds the gradients of a network to the flat parameter vector.
pub(crate) fn add_network(gradients: &[LayerGradients], shape: &MlpShape, flat: &mut [f32]) {
    for (layer, own) in gradients.iter().enumerate() {
        own.add_to(shape, layer, flat);
    }
}
