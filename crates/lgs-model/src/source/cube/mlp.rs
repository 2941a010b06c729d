//! Layers of a network whose parameters are one vector, as operations of the tensor library on the device,
//! and their vector–Jacobian products.

use burn::tensor::Tensor;
use burn::tensor::activation::{relu, sigmoid, silu};
use lgs_nn::{Activation, LinearRange, MlpLayout};
use lgs_tensor::cube::product::product;

/// Gradients of parts of the parameters, by the place of each part's first float.
pub(in crate::source) type Parts = Vec<(usize, Tensor<1>)>;

fn weight(params: &Tensor<1>, l: &LinearRange) -> Tensor<2> {
    params.clone().narrow(0, l.weight, l.inputs * l.outputs).reshape([l.outputs, l.inputs])
}

/// `x Wᵀ + b`.
pub(super) fn linear(params: &Tensor<1>, l: &LinearRange, x: Tensor<2>) -> Tensor<2> {
    let bias: Tensor<2> = params.clone().narrow(0, l.bias, l.outputs).reshape([1, l.outputs]);
    product(x, weight(params, l).transpose()) + bias
}

/// Cotangent of a layer's inputs; those of weight and bias are added to `parts`.
pub(super) fn linear_vjp(
    params: &Tensor<1>,
    l: &LinearRange,
    x: &Tensor<2>,
    v: Tensor<2>,
    parts: &mut Parts,
) -> Tensor<2> {
    let v_weight = product(v.clone().transpose(), x.clone()).reshape([l.inputs * l.outputs]);
    let v_bias = v.clone().sum_dim(0).reshape([l.outputs]);
    parts.push((l.weight, v_weight));
    parts.push((l.bias, v_bias));
    product(v, weight(params, l))
}

/// The cotangent where an output of `max(z, 0)` is positive, and zero elsewhere.
pub(super) fn relu_vjp(out: &Tensor<2>, v: Tensor<2>) -> Tensor<2> {
    v.mask_fill(out.clone().lower_equal_elem(0.0), 0.0)
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
        let before = linear(params, l, hidden);
        hidden = match activation {
            Activation::Relu => relu(before),
            Activation::Silu => {
                taped.before.push(before.clone());
                silu(before)
            }
        };
        taped.inputs.push(hidden.clone());
    }
    (linear(params, &layout.head, hidden), taped)
}

impl Taped {
    /// The cotangent of what layer `i`, of so many outputs, gave to the activation.
    fn activation_vjp(&self, i: usize, outputs: usize, v: Tensor<2>) -> Tensor<2> {
        if let Some(before) = self.before.get(i) {
            let gate = sigmoid(before.clone());
            let slope = gate.clone() * (before.clone() * (gate.neg() + 1.0) + 1.0);
            return v * slope;
        }
        // What a later layer read of this one's output lies behind the network's inputs.
        let next = &self.inputs[i + 1];
        let skipped = next.dims()[1] - outputs;
        let out = if skipped > 0 { next.clone().narrow(1, skipped, outputs) } else { next.clone() };
        relu_vjp(&out, v)
    }
}

/// Cotangent of a network's input; those of its parameters are added to `parts`.
pub(in crate::source) fn mlp_vjp(
    params: &Tensor<1>,
    layout: &MlpLayout,
    taped: &Taped,
    v: Tensor<2>,
    parts: &mut Parts,
) -> Tensor<2> {
    let inputs = layout.hidden[0].inputs;
    let depth = layout.hidden.len();
    let mut v = linear_vjp(params, &layout.head, &taped.inputs[depth], v, parts);
    let mut v_input: Option<Tensor<2>> = None;
    for (i, l) in layout.hidden.iter().enumerate().rev() {
        let v_before = taped.activation_vjp(i, l.outputs, v);
        v = linear_vjp(params, l, &taped.inputs[i], v_before, parts);
        if i > 0 && layout.reads_inputs(i) {
            let below = v.dims()[1] - inputs;
            let again = v.clone().narrow(1, 0, inputs);
            v_input = Some(v_input.map_or(again.clone(), |sum| sum + again));
            v = v.narrow(1, inputs, below);
        }
    }
    v_input.map_or(v.clone(), |sum| sum + v)
}

/// The gradient of all parameters from those of their parts, zero where no part is.
pub(super) fn joined(mut parts: Parts, params: &Tensor<1>) -> Tensor<1> {
    parts.sort_by_key(|(place, _)| *place);
    let (mut all, mut end) = (Vec::new(), 0);
    parts.push((params.dims()[0], Tensor::zeros([0], &params.device())));
    for (place, part) in parts {
        if place > end {
            all.push(Tensor::zeros([place - end], &params.device()));
        }
        end = place + part.dims()[0];
        all.push(part);
    }
    all.retain(|part| part.dims()[0] > 0);
    Tensor::cat(all, 0)
}
