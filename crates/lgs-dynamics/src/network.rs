//! SiLU networks on blocks of particles: the output, the gradient of a scalar output by the input, and the backward passes of both.
//!
//! The spatial gradient is an ordinary forward computation (reference §8.3): with `z_l = W_l h_l + b_l`, `h_{l+1} = φ(z_l)` and
//! `g_L = w_L`, each layer gives `e_l = φ'(z_l) ⊙ g_{l+1}` and `g_l = W_lᵀ e_l`. Its backward pass first walks that chain from `g_0` to
//! `g_L`, which leaves a cotangent on every `z_l` through `φ''`, and then the chain of `h` the other way.

use crate::block::activation::{multiply, silu_with_slope, slope_product_vjp};
use crate::block::matmul::{Product, Read, Store, transpose};
use crate::block::{WIDTH, activation};
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

/// Activations of one block, kept from a forward pass to the backward pass after it.
#[derive(Clone, Debug)]
pub(crate) struct Tape {
    layers: Vec<LayerTape>,
    /// Scratch for cotangents, `[hidden, WIDTH]` each.
    v_a: Vec<f32>,
    v_b: Vec<f32>,
    transposed: Vec<f32>,
}

#[derive(Clone, Debug)]
struct LayerTape {
    z: Vec<f32>,
    /// `φ(z)`.
    h: Vec<f32>,
    /// `φ'(z)`.
    slope: Vec<f32>,
    /// `g_{l+1}`, the gradient by `h`.
    g: Vec<f32>,
    e: Vec<f32>,
    v_z: Vec<f32>,
}

impl Tape {
    pub(crate) fn new(shape: &MlpShape) -> Self {
        let size = shape.hidden * WIDTH;
        let rows = || vec![0.0; size];
        let layer = || LayerTape { z: rows(), h: rows(), slope: rows(), g: rows(), e: rows(), v_z: rows() };
        let widest = shape.hidden.max(shape.inputs) * WIDTH;
        let layers = (0..shape.hidden_layers).map(|_| layer()).collect();
        Self { layers, v_a: vec![0.0; widest], v_b: vec![0.0; widest], transposed: vec![0.0; widest] }
    }
}

/// A network: its sizes and the whole parameter vector.
#[derive(Clone, Copy)]
pub(crate) struct Mlp<'a> {
    pub(crate) shape: MlpShape,
    pub(crate) params: &'a [f32],
}

impl Mlp<'_> {
    /// The hidden layers for inputs `x: [inputs, WIDTH]`.
    fn hidden(&self, x: &[f32], tape: &mut Tape) {
        for layer in 0..self.shape.hidden_layers {
            let (before, rest) = tape.layers.split_at_mut(layer);
            let own = &mut rest[0];
            let input = before.last().map_or(x, |l| &l.h);
            self.affine(layer, input, &mut own.z);
            silu_with_slope(&own.z, &mut own.h, &mut own.slope);
        }
    }

    fn affine(&self, layer: usize, input: &[f32], out: &mut [f32]) {
        let (m, k) = (self.shape.layer_outputs(layer), self.shape.layer_inputs(layer));
        for (row, &bias) in out.chunks_exact_mut(WIDTH).zip(&self.params[self.shape.bias(layer)]) {
            row.fill(bias);
        }
        let a = &self.params[self.shape.weight(layer)];
        Product { out, a, read: Read::Rows, b: input, shape: [m, k, WIDTH], store: Store::Add }.run();
    }

    /// `Wᵀ v`.
    fn pull_back(&self, layer: usize, v: &[f32], out: &mut [f32]) {
        let (k, m) = (self.shape.layer_outputs(layer), self.shape.layer_inputs(layer));
        let a = &self.params[self.shape.weight(layer)];
        Product { out, a, read: Read::Columns, b: v, shape: [m, k, WIDTH], store: Store::Set }.run();
    }

    /// The output `[outputs, WIDTH]` for inputs `[inputs, WIDTH]`.
    pub(crate) fn output(&self, x: &[f32], tape: &mut Tape, y: &mut [f32]) {
        self.hidden(x, tape);
        let last = tape.layers.last().map_or(x, |l| &l.h);
        self.affine(self.shape.hidden_layers, last, y);
    }

    /// Backwards through [`Mlp::output`] whose activations `tape` holds: adds to `v_params`, writes `v_x`.
    pub(crate) fn output_vjp(&self, x: &[f32], tape: &mut Tape, v_y: &[f32], v_params: &mut [f32], v_x: &mut [f32]) {
        let top = self.shape.hidden_layers;
        for layer in &mut tape.layers {
            layer.v_z.fill(0.0);
        }
        let last = tape.layers.last().map_or(x, |l| &l.h);
        add_outer(&mut v_params[self.shape.weight(top)], v_y, last, &mut tape.transposed);
        add_row_sums(&mut v_params[self.shape.bias(top)], v_y);
        if top == 0 {
            self.pull_back(0, v_y, v_x);
            return;
        }
        let size = self.shape.hidden * WIDTH;
        self.pull_back(top, v_y, &mut tape.v_a[..size]);
        self.hidden_vjp(x, tape, v_params, v_x);
    }

    /// Backwards through the hidden layers: `tape.v_a` holds the cotangent of the last `h`, each `v_z` what came to it otherwise.
    fn hidden_vjp(&self, x: &[f32], tape: &mut Tape, v_params: &mut [f32], v_x: &mut [f32]) {
        let size = self.shape.hidden * WIDTH;
        for layer in (0..self.shape.hidden_layers).rev() {
            let (before, rest) = tape.layers.split_at_mut(layer);
            let own = &mut rest[0];
            for ((v_z, &v_h), &slope) in own.v_z.iter_mut().zip(&tape.v_a[..size]).zip(&own.slope) {
                *v_z += v_h * slope;
            }
            let input = before.last().map_or(x, |l| &l.h);
            add_outer(&mut v_params[self.shape.weight(layer)], &own.v_z, input, &mut tape.transposed);
            add_row_sums(&mut v_params[self.shape.bias(layer)], &own.v_z);
            if layer == 0 {
                self.pull_back(0, &own.v_z, v_x);
            } else {
                self.pull_back(layer, &own.v_z, &mut tape.v_a[..size]);
            }
        }
    }

    /// The gradient `[inputs, WIDTH]` of the only output by the inputs.
    pub(crate) fn input_gradient(&self, x: &[f32], tape: &mut Tape, gradient: &mut [f32]) {
        self.hidden(x, tape);
        let top = self.shape.hidden_layers;
        let last_weight = &self.params[self.shape.weight(top)];
        let Some(last) = tape.layers.last_mut() else {
            fill_rows(gradient, last_weight);
            return;
        };
        fill_rows(&mut last.g, last_weight);
        for layer in (0..top).rev() {
            let (before, rest) = tape.layers.split_at_mut(layer);
            let own = &mut rest[0];
            multiply(&own.slope, &own.g, &mut own.e);
            match before.last_mut() {
                Some(below) => self.pull_back(layer, &own.e, &mut below.g),
                None => self.pull_back(layer, &own.e, gradient),
            }
        }
    }

    /// Backwards through [`Mlp::input_gradient`] whose activations `tape` holds: adds to `v_params`, writes `v_x`.
    pub(crate) fn input_gradient_vjp(&self, x: &[f32], tape: &mut Tape, v_gradient: &[f32], v_params: &mut [f32], v_x: &mut [f32]) {
        let top = self.shape.hidden_layers;
        let size = self.shape.hidden * WIDTH;
        for layer in 0..top {
            let own = &mut tape.layers[layer];
            let v_g: &[f32] = if layer == 0 { v_gradient } else { &tape.v_a[..size] };
            let (m, k) = (self.shape.layer_outputs(layer), self.shape.layer_inputs(layer));
            let a = &self.params[self.shape.weight(layer)];
            let v_e = &mut tape.v_b[..size];
            Product { out: v_e, a, read: Read::Rows, b: v_g, shape: [m, k, WIDTH], store: Store::Set }.run();
            add_outer(&mut v_params[self.shape.weight(layer)], &own.e, v_g, &mut tape.transposed);
            slope_product_vjp(&own.z, &own.g, v_e, &mut own.v_z);
            std::mem::swap(&mut tape.v_a, &mut tape.v_b);
        }
        let v_last = if top == 0 { v_gradient } else { &tape.v_a[..size] };
        add_row_sums(&mut v_params[self.shape.weight(top)], v_last);
        // The output itself is not part of the result: nothing comes down through the last layer.
        tape.v_a.fill(0.0);
        v_x.fill(0.0);
        self.hidden_vjp(x, tape, v_params, v_x);
    }

    /// The output of a block without keeping what a backward pass needs.
    pub(crate) fn value(&self, x: &[f32], tape: &mut Tape, y: &mut [f32]) {
        for layer in 0..self.shape.hidden_layers {
            let (before, rest) = tape.layers.split_at_mut(layer);
            let own = &mut rest[0];
            self.affine(layer, before.last().map_or(x, |l| &l.h), &mut own.z);
            activation::silu(&own.z, &mut own.h);
        }
        let last = tape.layers.last().map_or(x, |l| &l.h);
        self.affine(self.shape.hidden_layers, last, y);
    }
}

fn fill_rows(rows: &mut [f32], values: &[f32]) {
    for (row, &value) in rows.chunks_exact_mut(WIDTH).zip(values) {
        row.fill(value);
    }
}

/// `out[m, n] += a[m, WIDTH] b[n, WIDTH]ᵀ`.
fn add_outer(out: &mut [f32], a: &[f32], b: &[f32], transposed: &mut [f32]) {
    let (m, n) = (a.len() / WIDTH, b.len() / WIDTH);
    if m.min(n) < 16 {
        Arch::new().dispatch(DotRows { out, a, b });
        return;
    }
    let b_columns = &mut transposed[..b.len()];
    transpose(b, n, WIDTH, b_columns);
    Product { out, a, read: Read::Rows, b: b_columns, shape: [m, WIDTH, n], store: Store::Add }.run();
}

/// `out[m] += Σ a[m, WIDTH]`.
fn add_row_sums(out: &mut [f32], a: &[f32]) {
    Arch::new().dispatch(DotRows { out, a, b: &[1.0; WIDTH] });
}

/// `out[m, n] += a[m] · b[n]` for narrow shapes, one dot product of two rows at a time.
struct DotRows<'a> {
    out: &'a mut [f32],
    a: &'a [f32],
    b: &'a [f32],
}

impl WithSimd for DotRows<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let n = self.b.len() / WIDTH;
        for (out, a) in self.out.chunks_exact_mut(n).zip(self.a.chunks_exact(WIDTH)) {
            let (a, _) = S::as_simd_f32s(a);
            for (out, b) in out.iter_mut().zip(self.b.chunks_exact(WIDTH)) {
                let (b, _) = S::as_simd_f32s(b);
                let mut sum = simd.splat_f32s(0.0);
                for (&a, &b) in a.iter().zip(b) {
                    sum = simd.mul_add_f32s(a, b, sum);
                }
                *out += simd.reduce_sum_f32s(sum);
            }
        }
    }
}
