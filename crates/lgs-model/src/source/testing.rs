//! Helpers of the tests of fused networks: Gaussians, cotangents, and the comparison of an operation with its
//! twin.

use burn::tensor::{Device, Tensor, TensorData};
use lgs_core::testing::{assert_gradient_close, assert_values_close};
use lgs_nn::ParamRange;

use super::config::DELTAS;
use super::input::InputFrame;

/// A frame that is not the identity.
pub(super) const FRAME: InputFrame = InputFrame { center: [0.1, -0.2, 0.3], scale: 1.3 };

/// Asserts that named parameters follow each other without gaps and fill a vector.
pub(super) fn assert_tiles(params: &[ParamRange], len: usize) {
    let mut end = 0;
    for param in params {
        assert_eq!(param.range.start, end, "{}", param.name);
        assert_eq!(param.range.len(), param.shape.iter().product::<usize>());
        end = param.range.end;
    }
    assert_eq!(end, len);
}

/// Centres and quaternions, which are not of unit length.
pub(super) fn gaussians(n: usize) -> (Vec<[f32; 3]>, Vec<[f32; 4]>) {
    let wave = |i: usize, f: f32| (i as f32 * f).sin();
    let means = (0..n).map(|i| [wave(i, 0.37), wave(i + 9, 0.11), wave(i, 0.23) * 0.5]);
    let rotations = (0..n).map(|i| [1.0 + wave(i, 0.5), wave(i, 0.7), wave(i, 1.1), wave(i, 0.2)]);
    (means.collect(), rotations.collect())
}

/// Cotangents of pose rows.
pub(super) fn weights(n: usize) -> Vec<f32> {
    (0..n * DELTAS).map(|i| ((i * 29 % 17) as f32 - 8.0) * 0.1).collect()
}

/// Asserts that two operations on parameters, centres and quaternions of `n` Gaussians have the same values
/// and gradients.
pub(super) fn compare_twins<F, P>(params: &[f32], n: usize, fused: F, plain: P)
where
    F: FnOnce(Tensor<1>, Tensor<2>, Tensor<2>) -> Tensor<2>,
    P: FnOnce(Tensor<1>, Tensor<2>, Tensor<2>) -> Tensor<2>,
{
    let (found, expected) = (values_and_gradients(params, n, fused), values_and_gradients(params, n, plain));
    assert_values_close("poses", &found[0], &expected[0], 1e-5, 1e-5);
    for (i, name) in ["parameters", "means", "rotations"].into_iter().enumerate() {
        assert_gradient_close(name, &found[i + 1], &expected[i + 1]);
    }
}

fn values_and_gradients<F>(params: &[f32], n: usize, operation: F) -> [Vec<f32>; 4]
where
    F: FnOnce(Tensor<1>, Tensor<2>, Tensor<2>) -> Tensor<2>,
{
    let device = Device::flex().autodiff();
    let rows = |values: &[f32], width: usize| {
        Tensor::<2>::from_data(TensorData::new(values.to_vec(), [n, width]), &device)
    };
    let (means, rotations) = gaussians(n);
    let params = Tensor::<1>::from_floats(params, &device).require_grad();
    let (means, rotations) =
        (rows(means.as_flattened(), 3).require_grad(), rows(rotations.as_flattened(), 4).require_grad());
    let out = operation(params.clone(), means.clone(), rotations.clone());
    let gradients = (out.clone() * rows(&weights(n), DELTAS)).sum().backward();
    let values = |data: TensorData| data.try_to_vec::<f32>().expect("f32");
    [
        values(out.into_data()),
        values(params.grad(&gradients).expect("parameters").into_data()),
        values(means.grad(&gradients).expect("means").into_data()),
        values(rotations.grad(&gradients).expect("rotations").into_data()),
    ]
}
