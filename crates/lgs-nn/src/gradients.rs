//! Parameter gradients in the shape in which products add to them: units padded to whole vectors, weights
//! of inputs transposed.

use crate::buffer::Buffer;
use crate::layout::{LinearRange, MlpShape};
use crate::packed::{Right, padded};
use crate::product::{Add, Columns, Left, Product, UnpaddedRows};
use crate::sums::{add_over_rows, sum_over_rows};
use std::ops::Range;

/// Sums of a network's parameter gradients.
#[derive(Debug)]
pub struct MlpGradients {
    /// Hidden layers, then the head.
    pub(crate) layers: Vec<LayerGradients>,
}

impl MlpGradients {
    /// Zeros.
    #[must_use]
    pub fn zeros(shape: &MlpShape) -> Self {
        let layout = &shape.layout;
        let hidden = layout.hidden.iter().enumerate().map(|(index, layer)| {
            let inputs = if layout.reads_inputs(index) { &shape.inputs[..] } else { &[] };
            LayerGradients::zeros(layer, inputs, if index == 0 { 0 } else { layout.width() })
        });
        let head = LayerGradients::zeros(&layout.head, &[], layout.width());
        Self { layers: hidden.chain([head]).collect() }
    }

    /// Adds them to the flat parameter vector.
    pub fn add_to(&self, flat: &mut [f32]) {
        self.layers.iter().for_each(|layer| layer.add_to(flat));
    }
}

/// The gradients of one layer.
#[derive(Debug)]
pub(crate) struct LayerGradients {
    place: LinearRange,
    /// `[features, outputs]` of each input that the layer reads, and the columns that it meets.
    inputs: Vec<(Sums, Range<usize>)>,
    /// `[outputs, units]` of the layer below, whose columns are the last ones.
    below: Sums,
    /// `[outputs]`, padded.
    bias: Buffer,
}

/// A matrix `[rows, stride]` of sums.
#[derive(Debug)]
struct Sums {
    values: Buffer,
    rows: usize,
    columns: usize,
    /// `columns` and padding.
    stride: usize,
}

impl Sums {
    fn zeros(rows: usize, columns: usize) -> Self {
        let stride = padded(columns);
        Self { values: Buffer::zeros(rows * stride), rows, columns, stride }
    }

    /// Adds `leftᵀ right` summed over the rows of a block, `right: [rows, stride]`.
    fn add_outer<L: Left>(&mut self, left: L, right: &[f32]) {
        let epilogue = Add(&mut self.values, self.stride);
        Product { left, rows: self.rows, right: Right::plain(right, self.stride), epilogue }.run();
    }
}

impl LayerGradients {
    fn zeros(place: &LinearRange, inputs: &[Range<usize>], below: usize) -> Self {
        let input = |columns: &Range<usize>| (Sums::zeros(columns.len(), place.outputs), columns.clone());
        Self {
            place: *place,
            inputs: inputs.iter().map(input).collect(),
            below: Sums::zeros(place.outputs, below),
            bias: Buffer::zeros(padded(place.outputs)),
        }
    }

    /// Adds the products of an input `[features, rows]` and a cotangent `[rows, units]`.
    pub(crate) fn add_input(&mut self, input: usize, features: &[f32], v_z: &[f32]) {
        let sums = &mut self.inputs[input].0;
        sums.add_outer(UnpaddedRows(features, features.len() / sums.rows), v_z);
    }

    /// Adds the products of a cotangent `[rows, units]` and the layer below, `h: [rows, units]`.
    pub(crate) fn add_below(&mut self, v_z: &[f32], units: usize, h: &[f32]) {
        self.below.add_outer(Columns(v_z, units), h);
    }

    /// Adds the products of a cotangent `[outputs, rows]` and the layer below, and its sums.
    pub(crate) fn add_output(&mut self, v_y: &[f32], h: &[f32]) {
        let rows = v_y.len() / self.place.outputs;
        self.below.add_outer(UnpaddedRows(v_y, rows), h);
        for (sum, row) in self.bias.iter_mut().zip(v_y.chunks_exact(rows)) {
            *sum += sum_over_rows(row);
        }
    }

    /// Adds the sum of a cotangent `[rows, units]` over rows.
    pub(crate) fn add_bias(&mut self, v_z: &[f32]) {
        add_over_rows(v_z, &mut self.bias);
    }

    /// Adds the sum of `[rows, units]` over rows to the weight of the only output.
    pub(crate) fn add_only_output(&mut self, v_weight: &[f32]) {
        add_over_rows(v_weight, &mut self.below.values);
    }

    fn add_to(&self, flat: &mut [f32]) {
        let LinearRange { inputs, outputs, .. } = self.place;
        add(&mut flat[self.place.bias_range()], self.bias.iter());
        let weight = &mut flat[self.place.weight_range()];
        for (output, row) in weight.chunks_exact_mut(inputs).enumerate() {
            for (sums, columns) in &self.inputs {
                add(&mut row[columns.clone()], sums.values.iter().skip(output).step_by(sums.stride));
            }
        }
        if self.below.columns > 0 {
            let lines = self.below.values.chunks_exact(self.below.stride);
            for (row, line) in weight.chunks_exact_mut(inputs).zip(lines.take(outputs)) {
                add(&mut row[inputs - self.below.columns..], line.iter());
            }
        }
    }
}

fn add<'a>(sums: &mut [f32], values: impl Iterator<Item = &'a f32>) {
    sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += value);
}
