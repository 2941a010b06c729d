//! The gradient of a network's only output by its input, and the backward pass of that gradient.
//!
//! The gradient is an ordinary forward computation (method §4.1): with `z_l = W_l h_l + b_l`,
//! `h_{l+1} = φ(z_l)` and `g_L = w_L`, each layer gives `e_l = φ'(z_l) ⊙ g_{l+1}` and `g_l = W_lᵀ e_l`. Its
//! backward pass first walks that chain from `g_0` to `g_L`, which leaves the cotangent `φ'' ⊙ g ⊙ v_e` on
//! every `z_l`, and then the chain of `h` the other way.

use crate::activation::Silu;
use crate::buffer::Buffer;
use crate::epilogue::{AddScaled, EveryRow, Scale};
use crate::gradients::MlpGradients;
use crate::layer::Part;
use crate::layout::Activation;
use crate::mlp::Mlp;
use crate::network::LayerCall;
use crate::product::{Columns, Epilogue, Product, Rows};
use crate::tape::{CallArrays, Keep, LayerTape, Tape};
use pulp::Arch;

impl Mlp {
    /// The gradient `[features, rows]` of the only output by the only input, for a tape with curvature.
    ///
    /// # Panics
    /// If lengths do not fit, or the network has several inputs, several outputs, a skip layer or no second
    /// derivative.
    pub fn input_gradient(&self, x: &[f32], arrays: CallArrays<'_>, keep: Keep, gradient: &mut [f32]) {
        let CallArrays { tape, scratch } = arrays;
        assert!(self.has_input_gradient(), "a chain of smooth layers from one input to one output");
        let (rows, units, top) = (tape.rows, self.units, tape.layers.len());
        for index in 0..top {
            let (below, rest) = tape.layers.split_at_mut(index);
            let LayerTape { h, slope, curvature, .. } = &mut rest[0];
            let call = LayerCall { mlp: self, index, inputs: &[x], rows, below: below.last() };
            let partial = &mut scratch.hidden[0];
            let curvature = (keep == Keep::Tape).then_some(&mut **curvature);
            call.run(partial, |offset| Silu { offset, units, h, slope: Some(slope), curvature });
        }
        let epilogue = tape.layers[top - 1].chain(units, keep);
        Arch::new().dispatch(EveryRow { row: self.head().1.backward.row(), rows, epilogue });
        for index in (1..top).rev() {
            let (below, rest) = tape.layers.split_at_mut(index);
            self.pull_back(index, &rest[0].e, below[index - 1].chain(units, keep));
        }
        gradient.fill(0.0);
        self.add_pulled_back(&self.layers[0].inputs[0], &tape.layers[0].e, &mut scratch.narrow, gradient);
    }

    /// The backward pass of [`Mlp::input_gradient`] with [`Keep::Tape`], whose activations it uses up: adds
    /// to
    /// `gradients`, writes the cotangent `v_x` of the input; `[x, v_gradient]` are `[features, rows]` each.
    ///
    /// # Panics
    /// If lengths do not fit.
    pub fn input_gradient_vjp(
        &self,
        [x, v_gradient]: [&[f32]; 2],
        arrays: CallArrays<'_>,
        gradients: &mut MlpGradients,
        v_x: &mut [f32],
    ) {
        let CallArrays { tape, scratch } = arrays;
        self.up_the_gradient(v_gradient, tape, &mut scratch.hidden, gradients);
        // The output itself is not part of the result: nothing comes down through the last layer.
        let (layers, units) = (&mut tape.layers, self.units);
        for index in (0..layers.len()).rev() {
            let (below, rest) = layers.split_at_mut(index);
            let v_z = &rest[0].curvature;
            let own = &mut gradients.layers[index];
            own.add_bias(v_z);
            match below.last_mut() {
                None => own.add_input(0, x, v_z),
                Some(LayerTape { h, slope, curvature, .. }) => {
                    own.add_below(v_z, units, h);
                    self.pull_back(index, v_z, AddScaled { slope, v_z: curvature, units });
                }
            }
        }
        v_x.fill(0.0);
        self.add_pulled_back(&self.layers[0].inputs[0], &layers[0].curvature, &mut scratch.narrow, v_x);
    }

    /// Carries the cotangent of `g_0` to that of `g_L`.
    fn up_the_gradient(
        &self,
        v_gradient: &[f32],
        tape: &mut Tape,
        [v_g, v_next]: &mut [Buffer; 2],
        gradients: &mut MlpGradients,
    ) {
        let (rows, units, top) = (tape.rows, self.units, tape.layers.len());
        let used = rows * units;
        for (index, LayerTape { slope, curvature, e, .. }) in tape.layers.iter_mut().enumerate() {
            // Sums are `v_e`: `φ'' ⊙ g` becomes the part of `v_z` that comes through it.
            let epilogue = Scale { slope, curvature: Some(curvature), out: v_next, units };
            let (own, layer) = (&mut gradients.layers[index], &self.layers[index]);
            match &layer.below {
                None => {
                    own.add_input(0, v_gradient, e);
                    let right = layer.inputs[0].forward.right();
                    Product { left: Columns(v_gradient, rows), rows, right, epilogue }.run();
                }
                Some(part) => {
                    own.add_below(e, units, &v_g[..used]);
                    let right = part.forward.right();
                    Product { left: Rows(v_g, units), rows, right, epilogue }.run();
                }
            }
            std::mem::swap(v_g, v_next);
        }
        gradients.layers[top].add_only_output(&v_g[..used]);
    }

    fn has_input_gradient(&self) -> bool {
        let layout = &self.shape.layout;
        let reading = (0..layout.hidden.len()).filter(|&index| layout.reads_inputs(index)).count();
        self.shape.activation == Activation::Silu
            && (self.shape.inputs.len(), reading, layout.head.outputs) == (1, 1, 1)
    }

    /// `Wᵀ v` of a hidden layer for `v: [rows, units]` of the layer below, with the given end.
    fn pull_back<E: Epilogue>(&self, index: usize, v: &[f32], epilogue: E) {
        let Some(Part { backward, .. }) = &self.layers[index].below else { return };
        let rows = v.len() / self.units;
        Product { left: Rows(v, self.units), rows, right: backward.right(), epilogue }.run();
    }
}

impl LayerTape {
    /// The end of a product that gives `g` at this layer.
    fn chain(&mut self, units: usize, keep: Keep) -> Scale<'_> {
        let curvature = (keep == Keep::Tape).then_some(&mut *self.curvature);
        Scale { slope: &self.slope, curvature, out: &mut self.e, units }
    }
}
