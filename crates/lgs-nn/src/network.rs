//! Values of networks, and their backward pass. Every elementwise operation is the end of a matrix product,
//! so an activation is written once and read once per use.

use crate::activation::{Linear, Offset, Relu, Silu};
use crate::buffer::Buffer;
use crate::epilogue::{Mask, Scale};
use crate::gradients::MlpGradients;
use crate::layer::Part;
use crate::layout::Activation;
use crate::mlp::Mlp;
use crate::packed::padded;
use crate::product::{Add, Columns, Epilogue, Left, Product, Rows, Set};
use crate::tape::{CallArrays, Keep, LayerTape, Scratch, Tape};

/// A block whose activations are kept, and the cotangent of its outputs.
#[derive(Clone, Copy, Debug)]
pub struct OutputCotangents<'a> {
    /// The inputs, `[features, rows]` each.
    pub inputs: &'a [&'a [f32]],
    /// Activations that [`Mlp::output`] kept with [`Keep::Tape`] for these inputs.
    pub tape: &'a Tape,
    /// `[outputs, rows]`.
    pub v_y: &'a [f32],
}

impl Mlp {
    /// The outputs `[outputs, rows]` for inputs `[features, rows]` each.
    ///
    /// # Panics
    /// If lengths do not fit.
    pub fn output(&self, inputs: &[&[f32]], arrays: CallArrays<'_>, keep: Keep, y: &mut [f32]) {
        let CallArrays { tape, scratch } = arrays;
        let (rows, units) = (tape.rows, self.units);
        for index in 0..self.shape.layout.hidden.len() {
            let (below, rest) = tape.layers.split_at_mut(index);
            let LayerTape { h, slope, .. } = &mut rest[0];
            let call = LayerCall { mlp: self, index, inputs, rows, below: below.last() };
            let partial = &mut scratch.hidden[0];
            match self.shape.activation {
                Activation::Relu => call.run(partial, |offset| Relu { offset, units, h }),
                Activation::Silu => {
                    let slope = (keep == Keep::Tape).then_some(&mut **slope);
                    call.run(partial, |offset| Silu { offset, units, h, slope, curvature: None });
                }
            }
        }
        let (head, part) = self.head();
        let stride = padded(self.shape.layout.head.outputs);
        let last = &tape.layers[tape.layers.len() - 1].h;
        let (right, epilogue) = (part.forward.right(), Set(&mut scratch.narrow, stride));
        Product { left: Rows(last, units), rows, right, epilogue }.run();
        for (feature, (row, bias)) in y.chunks_exact_mut(rows).zip(head.bias.iter()).enumerate() {
            for (value, line) in row.iter_mut().zip(scratch.narrow.chunks_exact(stride)) {
                *value = line[feature] + bias;
            }
        }
    }

    /// The backward pass of [`Mlp::output`]: adds to `gradients` and writes the cotangents `[features, rows]`
    /// of those inputs whose entry in `v_inputs` is not empty.
    ///
    /// # Panics
    /// If lengths do not fit.
    pub fn output_vjp(
        &self,
        block: OutputCotangents<'_>,
        scratch: &mut Scratch,
        gradients: &mut MlpGradients,
        v_inputs: &mut [&mut [f32]],
    ) {
        let OutputCotangents { inputs, tape, v_y } = block;
        let (rows, units, depth) = (tape.rows, self.units, tape.layers.len());
        let Scratch { hidden: [v_z, v_below], narrow } = scratch;
        let used = rows * units;
        v_inputs.iter_mut().for_each(|v| v.fill(0.0));
        gradients.layers[depth].add_output(v_y, &tape.layers[depth - 1].h);
        self.through_activation(self.head().1, Columns(v_y, rows), &tape.layers[depth - 1], v_z);
        for index in (0..depth).rev() {
            let (own, layer) = (&mut gradients.layers[index], &self.layers[index]);
            own.add_bias(&v_z[..used]);
            for (k, part) in layer.inputs.iter().enumerate() {
                own.add_input(k, inputs[k], &v_z[..used]);
                if let Some(v_input) = v_inputs.get_mut(k).filter(|v| !v.is_empty()) {
                    self.add_pulled_back(part, &v_z[..used], narrow, v_input);
                }
            }
            if let Some(part) = &layer.below {
                let below = &tape.layers[index - 1];
                own.add_below(&v_z[..used], units, &below.h);
                self.through_activation(part, Rows(&v_z[..used], units), below, v_below);
                std::mem::swap(v_z, v_below);
            }
        }
    }

    /// [`Mlp::output`] in arrays of its own: the outputs `[outputs, rows]` and the tape.
    ///
    /// # Panics
    /// If lengths do not fit.
    #[must_use]
    pub fn evaluate(&self, inputs: &[&[f32]], rows: usize) -> (Vec<f32>, Tape) {
        let (mut tape, mut scratch) = (Tape::new(self, rows), Scratch::new(self, rows));
        let mut y = vec![0.0; self.shape.layout.head.outputs * rows];
        let arrays = CallArrays { tape: &mut tape, scratch: &mut scratch };
        self.output(inputs, arrays, Keep::Tape, &mut y);
        (y, tape)
    }

    /// The cotangent of `z` below a part from that of its outputs.
    fn through_activation<L: Left>(&self, part: &Part, v: L, below: &LayerTape, v_z: &mut Buffer) {
        let (units, right) = (self.units, part.backward.right());
        let rows = below.h.len() / units;
        match self.shape.activation {
            Activation::Relu => {
                Product { left: v, rows, right, epilogue: Mask { h: &below.h, out: v_z, units } }.run();
            }
            Activation::Silu => {
                let epilogue = Scale { slope: &below.slope, curvature: None, out: v_z, units };
                Product { left: v, rows, right, epilogue }.run();
            }
        }
    }

    /// Adds `Wᵀ v`, of `v: [rows, units]`, to the cotangent `[features, rows]` of an input.
    pub(crate) fn add_pulled_back(&self, part: &Part, v: &[f32], narrow: &mut [f32], v_input: &mut [f32]) {
        let rows = v.len() / self.units;
        let stride = padded(v_input.len() / rows);
        let epilogue = Set(narrow, stride);
        Product { left: Rows(v, self.units), rows, right: part.backward.right(), epilogue }.run();
        for (feature, row) in v_input.chunks_exact_mut(rows).enumerate() {
            for (value, line) in row.iter_mut().zip(narrow.chunks_exact(stride)) {
                *value += line[feature];
            }
        }
    }
}

/// One hidden layer on a block.
#[derive(Clone, Copy)]
pub(crate) struct LayerCall<'a> {
    pub(crate) mlp: &'a Mlp,
    pub(crate) index: usize,
    pub(crate) inputs: &'a [&'a [f32]],
    pub(crate) rows: usize,
    pub(crate) below: Option<&'a LayerTape>,
}

impl<'a> LayerCall<'a> {
    /// Adds up the parts that the layer reads, in `partial` where there are several; the last one goes into
    /// the epilogue, whose offset is the bias plus the others.
    pub(crate) fn run<'p, E: Epilogue>(self, partial: &'p mut [f32], epilogue: impl FnOnce(Offset<'p>) -> E)
    where
        'a: 'p,
    {
        let (layer, units) = (&self.mlp.layers[self.index], self.mlp.units);
        let bias = Offset::row(&layer.bias);
        let last = layer.inputs.len() + usize::from(layer.below.is_some()) - 1;
        if last == 0 {
            return self.product(0, epilogue(bias));
        }
        self.product(0, Linear { offset: bias, z: partial, units });
        (1..last).for_each(|part| self.product(part, Add(partial, units)));
        self.product(last, epilogue(Offset::matrix(partial, units)));
    }

    /// The product of one part: an input, or behind those the layer below.
    fn product<E: Epilogue>(self, part: usize, epilogue: E) {
        let (layer, rows) = (&self.mlp.layers[self.index], self.rows);
        if let Some(input) = layer.inputs.get(part) {
            let (left, right) = (Columns(self.inputs[part], rows), input.forward.right());
            Product { left, rows, right, epilogue }.run();
        } else if let (Some(own), Some(below)) = (&layer.below, self.below) {
            let (left, right) = (Rows(&below.h, self.mlp.units), own.forward.right());
            Product { left, rows, right, epilogue }.run();
        }
    }
}
