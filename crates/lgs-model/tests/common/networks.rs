//! Networks that move Gaussians, run on a device with fixed Gaussians and cotangents.

use burn::tensor::{Device, Tensor, TensorData};
use lgs_core::testing::{assert_gradient_close, assert_values_close};
use lgs_model::source::{DELTAS, InputFrame};

pub(crate) const FRAME: InputFrame = InputFrame { center: [0.1, -0.2, 0.3], scale: 1.3 };

/// Poses, and gradients by parameters, centres and quaternions.
pub(crate) type Run = [Vec<f32>; 4];

fn wave(count: usize, step: f32) -> Vec<f32> {
    (0..count).map(|i| (i as f32 * step).sin()).collect()
}

fn values<const D: usize>(tensor: Tensor<D>) -> Vec<f32> {
    tensor.into_data().try_to_vec::<f32>().expect("f32 values")
}

/// Runs an operation on parameters, centres and quaternions of `n` Gaussians, and pulls cotangents back.
pub(crate) fn run(
    params: &[f32],
    n: usize,
    device: &Device,
    operation: impl Fn(Tensor<1>, Tensor<2>, Tensor<2>) -> Tensor<2>,
) -> Run {
    let rows = |width: usize, step: f32| {
        Tensor::<2>::from_data(TensorData::new(wave(width * n, step), [n, width]), device)
    };
    let params = Tensor::<1>::from_floats(params, device).require_grad();
    let (means, rotations) = (rows(3, 0.7).require_grad(), rows(4, 1.3).require_grad());
    let poses = operation(params.clone(), means.clone(), rotations.clone());
    let grads = (poses.clone() * rows(DELTAS, 0.9)).sum().backward();
    [
        values(poses),
        values(params.grad(&grads).expect("parameters")),
        values(means.grad(&grads).expect("centres")),
        values(rotations.grad(&grads).expect("quaternions")),
    ]
}

/// Asserts that a device gives what the processor does; gradients that are zero there are zero here.
pub(crate) fn assert_close(name: &str, found: &Run, expected: &Run) {
    assert_values_close(name, &found[0], &expected[0], 1e-4, 1e-5);
    for (found, expected) in found.iter().zip(expected).skip(1) {
        if expected.iter().all(|v| *v == 0.0) {
            assert!(found.iter().all(|v| *v == 0.0), "{name}: a gradient of nothing");
        } else {
            assert_gradient_close(name, found, expected);
        }
    }
}
