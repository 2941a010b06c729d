//! Layers with packed weights.

use crate::buffer::Buffer;
use crate::layout::{LinearRange, MlpShape};
use crate::packed::{Packed, padded};
use std::ops::Range;

/// A range of a weight's columns in the forms that products read.
#[derive(Debug)]
pub(crate) struct Part {
    /// `Wᵀ`, `[inputs, outputs]`.
    pub(crate) forward: Packed,
    /// `W`, `[outputs, inputs]`.
    pub(crate) backward: Packed,
}

impl Part {
    /// Columns of a layer's weight; depths that are units of hidden layers are padded as those are in memory.
    fn new(params: &[f32], layer: &LinearRange, columns: Range<usize>, [below, above]: [Units; 2]) -> Self {
        let weight = &params[layer.weight_range()];
        let (first, count, outputs) = (columns.start, columns.len(), layer.outputs);
        let entry = |output: usize, input: usize| {
            if output < outputs && input < count {
                weight[output * layer.inputs + first + input]
            } else {
                0.0
            }
        };
        Self {
            forward: Packed::new(below.depth(count), outputs, |input, output| entry(output, input)),
            backward: Packed::new(above.depth(outputs), count, entry),
        }
    }
}

/// Whether the units on one side of a weight are padded in memory.
#[derive(Clone, Copy)]
enum Units {
    Hidden,
    Outer,
}

impl Units {
    fn depth(self, units: usize) -> usize {
        match self {
            Self::Hidden => padded(units),
            Self::Outer => units,
        }
    }
}

/// A layer with packed weights.
#[derive(Debug)]
pub(crate) struct Layer {
    /// One part per input that it reads.
    pub(crate) inputs: Vec<Part>,
    /// The columns of the layer below, where there is one.
    pub(crate) below: Option<Part>,
    pub(crate) bias: Buffer,
}

impl Layer {
    pub(crate) fn new(shape: &MlpShape, index: usize, params: &[f32]) -> Self {
        let layout = &shape.layout;
        let (place, above) = match layout.hidden.get(index) {
            Some(hidden) => (hidden, Units::Hidden),
            None => (&layout.head, Units::Outer),
        };
        let reads = index < layout.hidden.len() && layout.reads_inputs(index);
        let inputs = if reads { &shape.inputs[..] } else { &[] };
        let below = (index > 0).then(|| place.inputs - layout.width()..place.inputs);
        let mut bias = Buffer::zeros(padded(place.outputs));
        bias[..place.outputs].copy_from_slice(&params[place.bias_range()]);
        Self {
            inputs: inputs
                .iter()
                .map(|c| Part::new(params, place, c.clone(), [Units::Outer, above]))
                .collect(),
            below: below.map(|columns| Part::new(params, place, columns, [Units::Hidden, above])),
            bias,
        }
    }
}
