//! Operations on tensors of a device: values and gradients.

use std::sync::Arc;

use burn::tensor::{Device, Tensor, TensorData};
use lgs_core::testing::{assert_gradient_close, assert_values_close};
use lgs_dynamics::tensor::{self, RolloutCall};
use lgs_dynamics::{Edit, Supports, System};

/// What an operation gives, and its gradients.
pub(crate) type Run = Vec<Vec<f32>>;

/// `[n, 3]` of a device that keeps gradients.
fn matrix(points: &[[f32; 3]], device: &Device) -> Tensor<2> {
    let data = TensorData::new(points.as_flattened().to_vec(), [points.len(), 3]);
    Tensor::from_data(data, &device.clone().autodiff()).require_grad()
}

fn vector(values: &[f32], device: &Device) -> Tensor<1> {
    let data = TensorData::new(values.to_vec(), [values.len()]);
    Tensor::from_data(data, &device.clone().autodiff()).require_grad()
}

fn values<const D: usize>(tensor: Tensor<D>) -> Vec<f32> {
    tensor.into_data().try_to_vec::<f32>().expect("f32 values")
}

/// The sum of an operation's results times weights.
fn weighed<const D: usize>(out: Tensor<D>, weight: &[f32]) -> Tensor<1> {
    let weight = Tensor::from_data(TensorData::new(weight.to_vec(), out.dims()), &out.device());
    (out * weight).sum()
}

/// States of a rollout, and gradients by parameters, positions and velocities.
pub(crate) fn rolled(
    system: &System,
    [q, v]: [&[[f32; 3]]; 2],
    call: &RolloutCall,
    weight: &[f32],
    device: &Device,
) -> Run {
    let (params, q, v) = (vector(&system.params, device), matrix(q, device), matrix(v, device));
    let states = tensor::rollout(params.clone(), q.clone(), v.clone(), call.clone());
    let grads = weighed(states.clone(), weight).backward();
    let of = |x: &Tensor<2>| values(x.grad(&grads).expect("a gradient"));
    vec![values(states), values(params.grad(&grads).expect("a gradient")), of(&q), of(&v)]
}

/// Accelerations, and gradients by parameters, positions and velocities.
pub(crate) fn accelerated(
    system: &System,
    [q, v]: [&[[f32; 3]]; 2],
    edit: Edit,
    weight: &[f32],
    device: &Device,
) -> Run {
    let (params, q, v) = (vector(&system.params, device), matrix(q, device), matrix(v, device));
    let a = tensor::acceleration(system.config, edit, params.clone(), q.clone(), v.clone());
    let grads = weighed(a.clone(), weight).backward();
    let of = |x: &Tensor<2>| values(x.grad(&grads).expect("a gradient"));
    vec![values(a), values(params.grad(&grads).expect("a gradient")), of(&q), of(&v)]
}

/// Aligned positions, rotations, and gradients by positions and candidates.
pub(crate) fn aligned(
    [position, candidate]: [&[[f32; 3]]; 2],
    supports: &Arc<Supports>,
    [weight, rotation_weight]: [&[f32]; 2],
    device: &Device,
) -> Run {
    let (position, candidate) = (matrix(position, device), matrix(candidate, device));
    let (aligned, rotations) = tensor::align(position.clone(), candidate.clone(), supports.clone());
    let loss = weighed(aligned.clone(), weight) + weighed(rotations.clone(), rotation_weight);
    let grads = loss.backward();
    let of = |x: &Tensor<2>| values(x.grad(&grads).expect("a gradient"));
    vec![values(aligned), values(rotations), of(&position), of(&candidate)]
}

/// Asserts that results and gradients are those of the processor; gradients that are zero there are zero
/// here.
pub(crate) fn assert_close(name: &str, found: &Run, expected: &Run, results: usize) {
    for (i, (found, expected)) in found.iter().zip(expected).enumerate() {
        let name = format!("{name}, result {i}");
        if i < results {
            assert_values_close(&name, found, expected, 2e-4, 1e-5);
        } else if expected.iter().all(|v| *v == 0.0) {
            assert!(found.iter().all(|v| *v == 0.0), "{name}: a gradient of nothing");
        } else {
            assert_gradient_close(&name, found, expected);
        }
    }
}
