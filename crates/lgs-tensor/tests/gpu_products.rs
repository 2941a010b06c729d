//! Products of matrices on a device against sums on the processor, in double precision.
#![cfg(feature = "gpu")]

use burn::tensor::{Device, Tensor, TensorData};
use lgs_tensor::cube::device_for_tests;
use lgs_tensor::cube::product::{
    Layer, Matrix, affine, affine_gradient, column_sums, primitive, product, tensor,
};

/// Numbers between -1 and 1 that look random.
fn numbers(count: usize, seed: u32) -> Vec<f32> {
    let mut state = seed.wrapping_mul(2_654_435_761).wrapping_add(1);
    let mut next = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as f32 / 8_388_608.0 - 1.0
    };
    (0..count).map(|_| next()).collect()
}

fn matrix(values: &[f32], shape: [usize; 2], device: &Device) -> Tensor<2> {
    Tensor::from_data(TensorData::new(values.to_vec(), shape), device)
}

/// `a b` with `at(i, k)` and `bt(k, j)`.
fn expected(
    [rows, inner, columns]: [usize; 3],
    a: impl Fn(usize, usize) -> f32,
    b: impl Fn(usize, usize) -> f32,
) -> Vec<f64> {
    let sum = |i: usize, j: usize| (0..inner).map(|k| f64::from(a(i, k)) * f64::from(b(k, j))).sum();
    (0..rows).flat_map(|i| (0..columns).map(move |j| (i, j))).map(|(i, j)| sum(i, j)).collect()
}

fn assert_close(name: &str, found: Tensor<2>, expected: &[f64], inner: usize) {
    let found = found.into_data().try_to_vec::<f32>().expect("numbers");
    assert_eq!(found.len(), expected.len(), "{name}");
    // The rounding of a sum of products of numbers below 1.
    let tolerance = 1e-6 * (inner as f64).sqrt().max(1.0);
    for (i, (found, expected)) in found.iter().zip(expected).enumerate() {
        assert!((f64::from(*found) - expected).abs() < tolerance, "{name}, {i}: {found}, not {expected}");
    }
}

/// Sizes below, at and above the tiles' and slices', and sums that are divided.
const SIZES: [[usize; 3]; 7] =
    [[1, 1, 1], [3, 17, 10], [64, 16, 64], [130, 33, 65], [10, 1500, 70], [200, 700, 129], [2100, 20, 1100]];

#[test]
fn products_are_sums_of_products_however_factors_are_stored() {
    let Some(device) = device_for_tests() else { return };
    for size @ [rows, inner, columns] in SIZES {
        let (a, b) = (numbers(rows * inner, 1), numbers(inner * columns, 2));
        for stored in [[false, false], [false, true], [true, false], [true, true]] {
            let shape = |is_transposed: bool, [m, n]: [usize; 2]| if is_transposed { [n, m] } else { [m, n] };
            let of = |values: &[f32], is_transposed: bool, dims: [usize; 2]| {
                let found = Matrix::of(&matrix(values, shape(is_transposed, dims), &device));
                if is_transposed { found.transposed() } else { found }
            };
            let left = |i: usize, k: usize| a[if stored[0] { k * rows + i } else { i * inner + k }];
            let right = |k: usize, j: usize| b[if stored[1] { j * inner + k } else { k * columns + j }];
            let found = product(&of(&a, stored[0], [rows, inner]), &of(&b, stored[1], [inner, columns]));
            assert_close(&format!("{size:?} {stored:?}"), found, &expected(size, left, right), inner);
        }
    }
}

#[test]
fn layers_and_their_gradients_lie_among_the_parameters() {
    let Some(device) = device_for_tests() else { return };
    for [n, inputs, outputs] in [[5, 3, 4], [700, 65, 130], [1100, 93, 10]] {
        let layer = Layer { weight: 7, bias: 7 + inputs * outputs + 2, inputs, outputs };
        let count = layer.bias + outputs + 3;
        let (params, x, v) = (numbers(count, 3), numbers(n * inputs, 4), numbers(n * outputs, 5));
        let on_device = primitive(Tensor::<1>::from_floats(params.as_slice(), &device));
        let (rows, cotangents) = (matrix(&x, [n, inputs], &device), matrix(&v, [n, outputs], &device));
        let weight = |k: usize, j: usize| params[layer.weight + j * inputs + k];
        let mut out = expected([n, inputs, outputs], |i, k| x[i * inputs + k], weight);
        out.iter_mut().enumerate().for_each(|(at, z)| *z += f64::from(params[layer.bias + at % outputs]));
        assert_close("affine", affine(&rows, &on_device, &layer, false), &out, inputs);
        out.iter_mut().for_each(|z| *z = z.max(0.0));
        assert_close("relu", affine(&rows, &on_device, &layer, true), &out, inputs);

        let gradient = primitive(Tensor::<1>::zeros([count], &device));
        affine_gradient(&cotangents, &rows, &gradient, &layer);
        let of_weights = expected([outputs, n, inputs], |j, i| v[i * outputs + j], |i, k| x[i * inputs + k]);
        let of_biases = expected([1, n, outputs], |_, _| 1.0, |i, j| v[i * outputs + j]);
        let mut all = vec![0.0; count];
        all[layer.weight..layer.weight + inputs * outputs].copy_from_slice(&of_weights);
        all[layer.bias..layer.bias + outputs].copy_from_slice(&of_biases);
        assert_close("gradient", tensor::<1>(gradient).reshape([1, count]), &all, n);
        assert_close("sums", column_sums(&cotangents), &of_biases, n);
    }
}
