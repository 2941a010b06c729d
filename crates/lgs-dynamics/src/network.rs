//! SiLU networks on blocks of particles: the output, the gradient of a scalar output by the input, and the backward passes of both.
//!
//! The spatial gradient is an ordinary forward computation (reference §8.3): with `z_l = W_l h_l + b_l`, `h_{l+1} = φ(z_l)` and
//! `g_L = w_L`, each layer gives `e_l = φ'(z_l) ⊙ g_{l+1}` and `g_l = W_lᵀ e_l`. Its backward pass first walks that chain from `g_0` to
//! `g_L`, which leaves the cotangent `φ'' ⊙ g ⊙ v_e` on every `z_l`, and then the chain of `h` the other way.
//!
//! Every elementwise operation is the end of a matrix product, so an activation is written once and read once per use. Weights are packed
//! once per network, in both directions, with the units of hidden layers padded to whole vectors.

use crate::block::WIDTH;
use crate::block::activation::{Silu, SiluCurvature, SiluSlope};
use crate::block::buffer::Buffer;
use crate::block::product::{Columns, Epilogue, Packed, Product, Rows, Set, padded, vector, vector_at};
use crate::gradients::LayerGradients;
use pulp::{Arch, Simd, WithSimd};
use std::ops::Range;

/// Sizes of a network and where it starts in the parameter vector; each layer's weight `[out, in]` is followed by its bias.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct MlpShape {
    pub(crate) start: usize,
    pub(crate) inputs: usize,
    pub(crate) hidden: usize,
    pub(crate) hidden_layers: usize,
    pub(crate) outputs: usize,
}

impl MlpShape {
    pub(crate) fn layer_inputs(&self, layer: usize) -> usize {
        if layer == 0 { self.inputs } else { self.hidden }
    }

    pub(crate) fn layer_outputs(&self, layer: usize) -> usize {
        if layer == self.hidden_layers { self.outputs } else { self.hidden }
    }

    fn layer_len(&self, layer: usize) -> usize {
        self.layer_outputs(layer) * (self.layer_inputs(layer) + 1)
    }

    pub(crate) fn weight(&self, layer: usize) -> Range<usize> {
        let start = self.start + (0..layer).map(|l| self.layer_len(l)).sum::<usize>();
        start..start + self.layer_outputs(layer) * self.layer_inputs(layer)
    }

    pub(crate) fn bias(&self, layer: usize) -> Range<usize> {
        let start = self.weight(layer).end;
        start..start + self.layer_outputs(layer)
    }

    pub(crate) fn len(&self) -> usize {
        (0..=self.hidden_layers).map(|l| self.layer_len(l)).sum()
    }
}

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
        let entry = |output: usize, input: usize| if output < outputs && input < inputs { weight[output * inputs + input] } else { 0.0 };
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
        Self { layers, v_g: [second(), second()], narrow: Buffer::zeros(WIDTH * padded(shape.inputs.max(shape.outputs))) }
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
        Product { left: Rows(v, self.units), rows: WIDTH, right: self.layers[layer].backward.right(), epilogue }.run();
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
                Keep::Tape => self.hidden_layer(layer, x, below.last(), SiluSlope { bias: &own.bias, h, slope }),
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
    pub(crate) fn output_vjp(&self, x: &[f32], tape: &mut Tape, v_y: &[f32], gradients: &mut [LayerGradients], v_x: &mut [f32]) {
        let top = self.shape.hidden_layers;
        let Tape { layers, narrow, .. } = tape;
        let last = &mut layers[top - 1];
        gradients[top].add_outer(Rows(v_y, WIDTH), &last.h);
        gradients[top].add_row_sums(v_y);
        // From here on `slope` holds the cotangent of `z`.
        let right = self.top().backward.right();
        Product { left: Columns(v_y, WIDTH), rows: WIDTH, right, epilogue: Scale { by: &mut last.slope, units: self.units } }.run();
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
                Keep::Result => self.hidden_layer(layer, x, below.last(), SiluSlope { bias: &own.bias, h, slope }),
                Keep::Tape => self.hidden_layer(layer, x, below.last(), SiluCurvature { bias: &own.bias, h, slope, curvature }),
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

    /// Backwards through [`Mlp::input_gradient`] whose activations `tape` holds: adds to `gradients`, writes `v_x`.
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
                    self.pull_back(layer, v_z, AddScaled { slope: &below.slope, v_z: &mut below.curvature, units });
                }
            }
        }
        self.pull_back_to_inputs(&layers[0].curvature, narrow, v_x);
    }
}

impl LayerTape {
    /// The end of a product that gives `g` at this layer.
    fn chain(&mut self, units: usize, keep: Keep) -> Chain<'_> {
        Chain { slope: &self.slope, curvature: (keep == Keep::Tape).then_some(&mut *self.curvature), e: &mut self.e, units }
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

/// `by = by ⊙ sums`, all `[WIDTH, units]`.
struct Scale<'a> {
    by: &'a mut [f32],
    units: usize,
}

impl Epilogue for Scale<'_> {
    #[inline(always)]
    fn take<S: Simd>(&mut self, simd: S, row: usize, column: usize, sums: S::f32s) {
        let by = vector::<S>(self.by, row * self.units + column);
        *by = simd.mul_f32s(*by, sums);
    }
}

/// `v_z = v_z + slope ⊙ sums`.
struct AddScaled<'a> {
    slope: &'a [f32],
    v_z: &'a mut [f32],
    units: usize,
}

impl Epilogue for AddScaled<'_> {
    #[inline(always)]
    fn take<S: Simd>(&mut self, simd: S, row: usize, column: usize, sums: S::f32s) {
        let at = row * self.units + column;
        let v_z = vector::<S>(self.v_z, at);
        *v_z = simd.mul_add_f32s(vector_at::<S>(self.slope, at), sums, *v_z);
    }
}

/// With sums `g`: `e = slope ⊙ g`, and `curvature = curvature ⊙ g` for the backward pass.
struct Chain<'a> {
    slope: &'a [f32],
    curvature: Option<&'a mut [f32]>,
    e: &'a mut [f32],
    units: usize,
}

impl Epilogue for Chain<'_> {
    #[inline(always)]
    fn take<S: Simd>(&mut self, simd: S, row: usize, column: usize, sums: S::f32s) {
        let at = row * self.units + column;
        if let Some(curvature) = &mut self.curvature {
            let curvature = vector::<S>(curvature, at);
            *curvature = simd.mul_f32s(*curvature, sums);
        }
        *vector::<S>(self.e, at) = simd.mul_f32s(vector_at::<S>(self.slope, at), sums);
    }
}

/// With sums `v_e`: the part of `v_z` that comes through `φ''`, in place of `φ'' ⊙ g`, and `v_g = slope ⊙ v_e`.
struct SlopeVjp<'a> {
    slope: &'a [f32],
    curvature: &'a mut [f32],
    v_g: &'a mut [f32],
    units: usize,
}

impl Epilogue for SlopeVjp<'_> {
    #[inline(always)]
    fn take<S: Simd>(&mut self, simd: S, row: usize, column: usize, sums: S::f32s) {
        let at = row * self.units + column;
        let curvature = vector::<S>(self.curvature, at);
        *curvature = simd.mul_f32s(*curvature, sums);
        *vector::<S>(self.v_g, at) = simd.mul_f32s(vector_at::<S>(self.slope, at), sums);
    }
}

/// Hands one row to an epilogue as every particle's.
struct EveryRow<'a, E> {
    row: &'a [f32],
    epilogue: E,
}

impl<E: Epilogue> WithSimd for EveryRow<'_, E> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        for row in 0..WIDTH {
            for (at, &values) in S::as_simd_f32s(self.row).0.iter().enumerate() {
                self.epilogue.take(simd, row, at * S::F32_LANES, values);
            }
        }
    }
}
