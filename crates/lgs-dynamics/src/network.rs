//! SiLU networks on blocks of particles: the output, the gradient of a scalar output by the input, and the
//! backward passes of both.
//!
//! The spatial gradient is an ordinary forward computation (reference §8.3): with `z_l = W_l h_l + b_l`,
//! `h_{l+1} = φ(z_l)` and `g_L = w_L`, each layer gives `e_l = φ'(z_l) ⊙ g_{l+1}` and `g_l = W_lᵀ e_l`. Its
//! backward pass first walks that chain from `g_0` to `g_L`, which leaves the cotangent `φ'' ⊙ g ⊙ v_e` on
//! every `z_l`, and then the chain of `h` the other way.
//!
//! Every elementwise operation is the end of a matrix product, so an activation is written once and read once
//! per use. Weights are packed once per network, in both directions, with the units of hidden layers padded
//! to whole vectors.

use crate::block::WIDTH;
use crate::block::activation::{Silu, SiluCurvature, SiluSlope};
use crate::block::buffer::Buffer;
use crate::block::chain::{AddScaled, Chain, EveryRow, Scale, SlopeVjp};
use crate::block::packed::{Packed, padded};
use crate::block::product::{Columns, Epilogue, Product, Rows, Set};
use crate::gradients::LayerGradients;
use crate::mlp_shape::MlpShape;
use pulp::Arch;

/// A layer in the forms that products read.
#[derive(Debug)]
struct Layer {
    /// `Wᵀ`, `[inputs, outputs]`.
    forward: Packed,
    /// `W`, `[outputs, inputs]`.
    backward: Packed,
    bias: Buffer,
}

impl Layer {
    fn new(shape: &MlpShape, layer: usize, params: &[f32]) -> Self {
        let (outputs, inputs) = (shape.layer_outputs(layer), shape.layer_inputs(layer));
        let weight = &params[shape.weight(layer)];
        let mut bias = Buffer::zeros(padded(outputs));
        bias[..outputs].copy_from_slice(&params[shape.bias(layer)]);
        let entry = |output: usize, input: usize| {
            if output < outputs && input < inputs { weight[output * inputs + input] } else { 0.0 }
        };
        // What is read from a hidden layer is as deep as that layer is in memory.
        let depth = |units: usize, hidden: bool| if hidden { padded(units) } else { units };
        let forward = Packed::new(depth(inputs, layer > 0), outputs, |input, output| entry(output, input));
        let backward = Packed::new(depth(outputs, layer < shape.hidden_layers), inputs, entry);
        Self { forward, backward, bias }
    }
}

/// What a forward pass keeps of one hidden layer, `[WIDTH, units]` each.
#[derive(Debug)]
struct LayerTape {
    /// `φ(z)`.
    h: Buffer,
    /// `φ'(z)`.
    slope: Buffer,
    /// First `φ''(z)`, then `φ''(z) ⊙ g`, then the cotangent of `z`.
    curvature: Buffer,
    /// `φ'(z) ⊙ g`.
    e: Buffer,
}

/// Activations of one block, kept from a forward pass to the backward pass after it, and scratch.
#[derive(Debug)]
pub(crate) struct Tape {
    layers: Vec<LayerTape>,
    /// Cotangents of `g`, of one layer and the next.
    v_g: [Buffer; 2],
    /// A few values per particle, `[WIDTH, few]`.
    narrow: Buffer,
}

impl Tape {
    /// For a network of whose output the input's gradient is taken (`second_order`), or its value alone.
    pub(crate) fn new(shape: &MlpShape, second_order: bool) -> Self {
        let size = padded(shape.hidden) * WIDTH;
        let rows = || Buffer::zeros(size);
        let second = || Buffer::zeros(if second_order { size } else { 0 });
        let layer = || LayerTape { h: rows(), slope: rows(), curvature: second(), e: second() };
        let layers = (0..shape.hidden_layers).map(|_| layer()).collect();
        Self {
            layers,
            v_g: [second(), second()],
            narrow: Buffer::zeros(WIDTH * padded(shape.inputs.max(shape.outputs))),
        }
    }
}

/// How much a forward pass keeps.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Keep {
    /// The result.
    Result,
    /// What the backward pass needs.
    Tape,
}

/// A network with packed weights.
#[derive(Debug)]
pub(crate) struct Mlp {
    pub(crate) shape: MlpShape,
    /// Hidden layers, then the output.
    layers: Vec<Layer>,
    /// Units of a hidden layer in memory.
    units: usize,
}

impl Mlp {
    /// Packs a network's part of the parameter vector.
    pub(crate) fn new(shape: MlpShape, params: &[f32]) -> Self {
        assert!(shape.hidden_layers > 0, "a network has at least one hidden layer");
        Self {
            shape,
            layers: (0..=shape.hidden_layers).map(|layer| Layer::new(&shape, layer, params)).collect(),
            units: padded(shape.hidden),
        }
    }

    fn top(&self) -> &Layer {
        &self.layers[self.shape.hidden_layers]
    }

    /// One hidden layer of inputs `x: [inputs, WIDTH]` with the given end.
    fn hidden_layer<E: Epilogue>(&self, layer: usize, x: &[f32], below: Option<&LayerTape>, epilogue: E) {
        let right = self.layers[layer].forward.right();
        match below {
            None => Product { left: Columns(x, WIDTH), rows: WIDTH, right, epilogue }.run(),
            Some(below) => Product { left: Rows(&below.h, self.units), rows: WIDTH, right, epilogue }.run(),
        }
    }

    /// `Wᵀ v` of a layer for `v: [WIDTH, units]`, with the given end.
    fn pull_back<E: Epilogue>(&self, layer: usize, v: &[f32], epilogue: E) {
        Product {
            left: Rows(v, self.units),
            rows: WIDTH,
            right: self.layers[layer].backward.right(),
            epilogue,
        }
        .run();
    }

    /// `W₀ᵀ v` as rows `[inputs, WIDTH]`.
    fn pull_back_to_inputs(&self, v: &[f32], narrow: &mut [f32], out: &mut [f32]) {
        let stride = padded(self.shape.inputs);
        self.pull_back(0, v, Set(narrow, stride));
        to_rows(narrow, stride, out);
    }

    /// The output `[outputs, WIDTH]` for inputs `[inputs, WIDTH]`.
    pub(crate) fn output(&self, x: &[f32], tape: &mut Tape, y: &mut [f32], keep: Keep) {
        for (layer, own) in self.layers[..self.shape.hidden_layers].iter().enumerate() {
            let (below, rest) = tape.layers.split_at_mut(layer);
            let LayerTape { h, slope, .. } = &mut rest[0];
            match keep {
                Keep::Result => self.hidden_layer(layer, x, below.last(), Silu { bias: &own.bias, h }),
                Keep::Tape => {
                    self.hidden_layer(layer, x, below.last(), SiluSlope { bias: &own.bias, h, slope })
                }
            }
        }
        let (top, stride) = (self.top(), padded(self.shape.outputs));
        let last = &tape.layers[self.shape.hidden_layers - 1].h;
        let epilogue = Set(&mut tape.narrow, stride);
        Product { left: Rows(last, self.units), rows: WIDTH, right: top.forward.right(), epilogue }.run();
        to_rows(&tape.narrow, stride, y);
        for (row, &bias) in y.chunks_exact_mut(WIDTH).zip(top.bias.iter()) {
            row.iter_mut().for_each(|value| *value += bias);
        }
    }

    /// Backwards through [`Mlp::output`] whose activations `tape` holds: adds to `gradients`, writes `v_x`.
    pub(crate) fn output_vjp(
        &self,
        x: &[f32],
        tape: &mut Tape,
        v_y: &[f32],
        gradients: &mut [LayerGradients],
        v_x: &mut [f32],
    ) {
        let top = self.shape.hidden_layers;
        let Tape { layers, narrow, .. } = tape;
        let last = &mut layers[top - 1];
        gradients[top].add_outer(Rows(v_y, WIDTH), &last.h);
        gradients[top].add_row_sums(v_y);
        // From here on `slope` holds the cotangent of `z`.
        let right = self.top().backward.right();
        Product {
            left: Columns(v_y, WIDTH),
            rows: WIDTH,
            right,
            epilogue: Scale { by: &mut last.slope, units: self.units },
        }
        .run();
        for layer in (0..top).rev() {
            let (below, rest) = layers.split_at_mut(layer);
            let v_z = &rest[0].slope;
            gradients[layer].add_bias(v_z);
            match below.last_mut() {
                None => gradients[0].add_outer(Rows(x, WIDTH), v_z),
                Some(below) => {
                    gradients[layer].add_outer(Columns(v_z, self.units), &below.h);
                    self.pull_back(layer, v_z, Scale { by: &mut below.slope, units: self.units });
                }
            }
        }
        self.pull_back_to_inputs(&layers[0].slope, narrow, v_x);
    }

    /// The gradient `[inputs, WIDTH]` of the only output by the inputs.
    pub(crate) fn input_gradient(&self, x: &[f32], tape: &mut Tape, gradient: &mut [f32], keep: Keep) {
        let top = self.shape.hidden_layers;
        for (layer, own) in self.layers[..top].iter().enumerate() {
            let (below, rest) = tape.layers.split_at_mut(layer);
            let LayerTape { h, slope, curvature, .. } = &mut rest[0];
            match keep {
                Keep::Result => {
                    self.hidden_layer(layer, x, below.last(), SiluSlope { bias: &own.bias, h, slope })
                }
                Keep::Tape => self.hidden_layer(
                    layer,
                    x,
                    below.last(),
                    SiluCurvature { bias: &own.bias, h, slope, curvature },
                ),
            }
        }
        let last = tape.layers[top - 1].chain(self.units, keep);
        Arch::new().dispatch(EveryRow { row: self.top().backward.row(), epilogue: last });
        for layer in (1..top).rev() {
            let (below, rest) = tape.layers.split_at_mut(layer);
            self.pull_back(layer, &rest[0].e, below[layer - 1].chain(self.units, keep));
        }
        self.pull_back_to_inputs(&tape.layers[0].e, &mut tape.narrow, gradient);
    }

    /// Backwards through [`Mlp::input_gradient`] whose activations `tape` holds: adds to `gradients`, writes
    /// `v_x`.
    pub(crate) fn input_gradient_vjp(
        &self,
        x: &[f32],
        tape: &mut Tape,
        v_gradient: &[f32],
        gradients: &mut [LayerGradients],
        v_x: &mut [f32],
    ) {
        let (top, units) = (self.shape.hidden_layers, self.units);
        let Tape { layers, v_g, narrow } = tape;
        let [v_g, v_next] = v_g;
        for layer in 0..top {
            let LayerTape { slope, curvature, e, .. } = &mut layers[layer];
            let right = self.layers[layer].forward.right();
            let epilogue = SlopeVjp { slope, curvature, v_g: v_next, units };
            if layer == 0 {
                gradients[0].add_outer(Rows(v_gradient, WIDTH), e);
                Product { left: Columns(v_gradient, WIDTH), rows: WIDTH, right, epilogue }.run();
            } else {
                gradients[layer].add_outer(Columns(e, units), v_g);
                Product { left: Rows(v_g, units), rows: WIDTH, right, epilogue }.run();
            }
            std::mem::swap(v_g, v_next);
        }
        gradients[top].add_weight_sums(v_g);
        // The output itself is not part of the result: nothing comes down through the last layer.
        for layer in (0..top).rev() {
            let (below, rest) = layers.split_at_mut(layer);
            let v_z = &rest[0].curvature;
            gradients[layer].add_bias(v_z);
            match below.last_mut() {
                None => gradients[0].add_outer(Rows(x, WIDTH), v_z),
                Some(below) => {
                    gradients[layer].add_outer(Columns(v_z, units), &below.h);
                    self.pull_back(
                        layer,
                        v_z,
                        AddScaled { slope: &below.slope, v_z: &mut below.curvature, units },
                    );
                }
            }
        }
        self.pull_back_to_inputs(&layers[0].curvature, narrow, v_x);
    }
}

impl LayerTape {
    /// The end of a product that gives `g` at this layer.
    fn chain(&mut self, units: usize, keep: Keep) -> Chain<'_> {
        Chain {
            slope: &self.slope,
            curvature: (keep == Keep::Tape).then_some(&mut *self.curvature),
            e: &mut self.e,
            units,
        }
    }
}

/// `out[features, WIDTH]` of `narrow[WIDTH, stride]`.
fn to_rows(narrow: &[f32], stride: usize, out: &mut [f32]) {
    for (feature, row) in out.chunks_exact_mut(WIDTH).enumerate() {
        for (value, line) in row.iter_mut().zip(narrow.chunks_exact(stride)) {
            *value = line[feature];
        }
    }
}
