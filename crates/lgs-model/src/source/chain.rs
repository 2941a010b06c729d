//! A chain of linear layers on a block of Gaussians, and back: hidden layers with an activation, of which one
//! may read the inputs again, then a linear head. All features are feature-major, `[features, block]`.

use super::config::LinearRange;
use super::matrix::{Columns, add_backward_weight, add_forward, backward_inputs};

/// What stands between layers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Activation {
    /// `max(z, 0)`.
    Relu,
    /// `z / (1 + exp(−z))`.
    Silu,
}

/// A chain's place in a parameter vector.
#[derive(Clone, Copy)]
pub(super) struct Chain<'a> {
    pub(super) params: &'a [f32],
    pub(super) hidden: &'a [LinearRange],
    pub(super) head: &'a LinearRange,
    /// The hidden layer after which the inputs enter again, before the outputs of that layer; the number of
    /// layers or more: never.
    pub(super) skip_layer: usize,
    pub(super) activation: Activation,
}

/// Features that enter a chain.
#[derive(Clone, Copy)]
pub(super) struct Input<'a> {
    /// `[count, block]`.
    pub(super) values: &'a [f32],
    /// First of the columns that they meet in the layers that read inputs.
    pub(super) first: usize,
    /// Number of features.
    pub(super) count: usize,
}

/// What a block's way back needs.
#[derive(Clone, Debug, Default)]
pub(super) struct Kept {
    /// Outputs of the hidden layers.
    hidden: Vec<Vec<f32>>,
    /// Derivatives of the activations, where the outputs do not tell them.
    slopes: Vec<Vec<f32>>,
}

impl<'a> Chain<'a> {
    fn reads_input(&self, index: usize) -> bool {
        index == 0 || index == self.skip_layer + 1
    }

    fn weight(&self, l: &LinearRange) -> &'a [f32] {
        &self.params[l.weight..l.bias]
    }

    /// Columns of a layer that the outputs of the layer before it meet.
    fn own_columns(&self, l: &LinearRange, before: usize) -> Columns {
        let count = self.hidden[before].outputs;
        Columns { row: l.inputs, first: l.inputs - count, count, outputs: l.outputs }
    }

    /// Outputs of the head, and what the way back needs. `biases`, one row per hidden layer, replace those
    /// among the parameters.
    pub(super) fn forward(
        &self,
        inputs: &[Input<'_>],
        biases: Option<&[Vec<f32>]>,
        block: usize,
    ) -> (Vec<f32>, Kept) {
        let mut kept = Kept::default();
        for (i, l) in self.hidden.iter().enumerate() {
            let bias = biases.map_or(&self.params[l.bias..l.bias + l.outputs], |rows| &rows[i]);
            let mut z = filled(bias, block);
            if self.reads_input(i) {
                for input in inputs {
                    let columns =
                        Columns { row: l.inputs, first: input.first, count: input.count, outputs: l.outputs };
                    add_forward(self.weight(l), columns, input.values, &mut z, block);
                }
            }
            if let Some(before) = kept.hidden.last() {
                add_forward(self.weight(l), self.own_columns(l, i - 1), before, &mut z, block);
            }
            if let Some(slopes) = self.activate(&mut z) {
                kept.slopes.push(slopes);
            }
            kept.hidden.push(z);
        }
        let mut out = filled(&self.params[self.head.bias..self.head.bias + self.head.outputs], block);
        let last = kept.hidden.last().map_or(&[][..], Vec::as_slice);
        add_forward(self.weight(self.head), self.head_columns(), last, &mut out, block);
        (out, kept)
    }

    fn head_columns(&self) -> Columns {
        Columns { row: self.head.inputs, first: 0, count: self.head.inputs, outputs: self.head.outputs }
    }

    /// Activates in place; derivatives where they are needed beside the outputs.
    fn activate(&self, z: &mut [f32]) -> Option<Vec<f32>> {
        if self.activation == Activation::Relu {
            z.iter_mut().for_each(|v| *v = if *v > 0.0 { *v } else { 0.0 });
            return None;
        }
        let slope = |v: &mut f32| {
            let sigmoid = 1.0 / (1.0 + (-*v).exp());
            let slope = sigmoid * (1.0 + *v * (1.0 - sigmoid));
            *v *= sigmoid;
            slope
        };
        Some(z.iter_mut().map(slope).collect())
    }

    /// From the cotangent of the outputs: adds those of the parameters to `v_params`, and to `v_inputs` those
    /// of the inputs, for every input whose entry there is not empty.
    pub(super) fn backward(
        &self,
        kept: &Kept,
        inputs: &[Input<'_>],
        v_out: &[f32],
        v_params: &mut [f32],
        v_inputs: &mut [Vec<f32>],
    ) {
        let head = self.head;
        let block = v_out.len() / head.outputs;
        add_bias_gradient(&mut v_params[head.bias..head.bias + head.outputs], v_out, block);
        if let Some(last) = kept.hidden.last() {
            add_backward_weight(
                &mut v_params[head.weight..head.bias],
                self.head_columns(),
                v_out,
                last,
                block,
            );
        }
        let mut v_h = vec![0.0; head.inputs * block];
        backward_inputs(self.weight(head), self.head_columns(), v_out, &mut v_h, block);
        for (i, l) in self.hidden.iter().enumerate().rev() {
            self.deactivate(kept, i, &mut v_h);
            add_bias_gradient(&mut v_params[l.bias..l.bias + l.outputs], &v_h, block);
            if self.reads_input(i) {
                self.backward_reads(l, inputs, &v_h, v_params, v_inputs);
            }
            if i > 0 {
                let columns = self.own_columns(l, i - 1);
                add_backward_weight(
                    &mut v_params[l.weight..l.bias],
                    columns,
                    &v_h,
                    &kept.hidden[i - 1],
                    block,
                );
                let mut v_before = vec![0.0; columns.count * block];
                backward_inputs(self.weight(l), columns, &v_h, &mut v_before, block);
                v_h = v_before;
            }
        }
    }

    fn backward_reads(
        &self,
        l: &LinearRange,
        inputs: &[Input<'_>],
        v_z: &[f32],
        v_params: &mut [f32],
        v_inputs: &mut [Vec<f32>],
    ) {
        let block = v_z.len() / l.outputs;
        for (k, input) in inputs.iter().enumerate() {
            let columns =
                Columns { row: l.inputs, first: input.first, count: input.count, outputs: l.outputs };
            add_backward_weight(&mut v_params[l.weight..l.bias], columns, v_z, input.values, block);
            if let Some(v_input) = v_inputs.get_mut(k).filter(|v| !v.is_empty()) {
                let mut v_read = vec![0.0; input.count * block];
                backward_inputs(self.weight(l), columns, v_z, &mut v_read, block);
                v_input.iter_mut().zip(v_read).for_each(|(sum, v)| *sum += v);
            }
        }
    }

    fn deactivate(&self, kept: &Kept, index: usize, v: &mut [f32]) {
        match self.activation {
            Activation::Relu => {
                v.iter_mut().zip(&kept.hidden[index]).for_each(|(v, h)| *v = if *h > 0.0 { *v } else { 0.0 })
            }
            Activation::Silu => v.iter_mut().zip(&kept.slopes[index]).for_each(|(v, slope)| *v *= slope),
        }
    }
}

/// A row of every bias, `[bias, block]`.
fn filled(bias: &[f32], block: usize) -> Vec<f32> {
    bias.iter().flat_map(|&b| std::iter::repeat_n(b, block)).collect()
}

fn add_bias_gradient(v_bias: &mut [f32], v_z: &[f32], block: usize) {
    for (v, row) in v_bias.iter_mut().zip(v_z.chunks_exact(block)) {
        // Eight running sums in a fixed order let the loop use vector registers.
        let mut lanes = [0.0_f32; 8];
        let (chunks, rest) = row.as_chunks::<8>();
        chunks.iter().for_each(|c| (0..8).for_each(|i| lanes[i] += c[i]));
        *v += lanes.iter().sum::<f32>() + rest.iter().sum::<f32>();
    }
}
