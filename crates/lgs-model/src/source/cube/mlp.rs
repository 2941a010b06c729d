//! Layers of a network whose parameters are one vector on the device, and their vector–Jacobian products.

use burn::backend::TensorMetadata;
use burn::tensor::activation::{sigmoid, silu};
use burn::tensor::{DType, Tensor};
use lgs_nn::{Activation, LinearRange, MlpLayout};
use lgs_tensor::cube::product::{Layer, Matrix, affine, affine_gradient, primitive, product};
use lgs_tensor::cube::{CubeTensor, zeros};

use super::gate::relu_vjp;

/// The gradient of all parameters; layers write their parts of it, each once.
pub(in crate::source) struct Gradient(CubeTensor);

impl Gradient {
    /// None yet.
    pub(in crate::source) fn none(params: &Tensor<1>) -> Self {
        let params = primitive(params.clone());
        Self(zeros(&params, params.shape(), DType::F32))
    }

    /// What the layers have written.
    pub(in crate::source) fn into_inner(self) -> CubeTensor {
        self.0
    }
}

fn layer(l: &LinearRange) -> Layer {
    Layer { weight: l.weight, bias: l.bias, inputs: l.inputs, outputs: l.outputs }
}

/// `x Wᵀ + b`.
pub(super) fn linear(params: &Tensor<1>, l: &LinearRange, x: &Tensor<2>) -> Tensor<2> {
    affine(x, &primitive(params.clone()), &layer(l), false)
}

/// `max(x Wᵀ + b, 0)`.
pub(super) fn linear_relu(params: &Tensor<1>, l: &LinearRange, x: &Tensor<2>) -> Tensor<2> {
    affine(x, &primitive(params.clone()), &layer(l), true)
}

/// Cotangent of a layer's inputs; those of weight and bias are written to the gradient.
pub(super) fn linear_vjp(
    params: &Tensor<1>,
    l: &LinearRange,
    x: &Tensor<2>,
    v: &Tensor<2>,
    gradient: &Gradient,
) -> Tensor<2> {
    affine_gradient(v, x, &gradient.0, &layer(l));
    product(&Matrix::of(v), &layer(l).weights(&primitive(params.clone())))
}

/// Inputs of every layer, the head's last, and what the layers gave to an activation that asks for it.
#[derive(Clone, Debug)]
pub(in crate::source) struct Taped {
    inputs: Vec<Tensor<2>>,
    before: Vec<Tensor<2>>,
}

/// A network with an activation between its layers.
pub(in crate::source) fn mlp(
    params: &Tensor<1>,
    layout: &MlpLayout,
    input: &Tensor<2>,
    activation: Activation,
) -> (Tensor<2>, Taped) {
    let mut taped = Taped { inputs: vec![input.clone()], before: Vec::new() };
    let mut hidden = input.clone();
    for (i, l) in layout.hidden.iter().enumerate() {
        if i > 0 && layout.reads_inputs(i) {
            hidden = Tensor::cat(vec![input.clone(), hidden], 1);
            taped.inputs[i] = hidden.clone();
        }
        hidden = match activation {
            Activation::Relu => linear_relu(params, l, &hidden),
            Activation::Silu => {
                let before = linear(params, l, &hidden);
                taped.before.push(before.clone());
                silu(before)
            }
        };
        taped.inputs.push(hidden.clone());
    }
    (linear(params, &layout.head, &hidden), taped)
}

impl Taped {
    /// The cotangent of what layer `i`, of so many outputs, gave to the activation, given one with so many
    /// columns before those of the layer.
    fn activation_vjp(&self, i: usize, outputs: usize, (v, before): (&Tensor<2>, usize)) -> Tensor<2> {
        if let Some(argument) = self.before.get(i) {
            let gate = sigmoid(argument.clone());
            let slope = gate.clone() * (argument.clone() * (gate.neg() + 1.0) + 1.0);
            return v.clone().narrow(1, before, outputs) * slope;
        }
        // What a later layer read of this one's output lies behind the network's inputs.
        let next = &self.inputs[i + 1];
        relu_vjp((next, next.dims()[1] - outputs), (v, before), outputs)
    }
}

/// Cotangent of a network's input; those of its parameters are written to the gradient.
pub(in crate::source) fn mlp_vjp(
    params: &Tensor<1>,
    layout: &MlpLayout,
    taped: &Taped,
    v: &Tensor<2>,
    gradient: &Gradient,
) -> Tensor<2> {
    let inputs = layout.hidden[0].inputs;
    let depth = layout.hidden.len();
    let mut v = linear_vjp(params, &layout.head, &taped.inputs[depth], v, gradient);
    let (mut v_input, mut before): (Option<Tensor<2>>, usize) = (None, 0);
    for (i, l) in layout.hidden.iter().enumerate().rev() {
        let v_argument = taped.activation_vjp(i, l.outputs, (&v, before));
        v = linear_vjp(params, l, &taped.inputs[i], &v_argument, gradient);
        before = if i > 0 && layout.reads_inputs(i) { inputs } else { 0 };
        if before > 0 {
            let again = v.clone().narrow(1, 0, inputs);
            v_input = Some(v_input.map_or(again.clone(), |sum| sum + again));
        }
    }
    v_input.map_or(v.clone(), |sum| sum + v)
}
