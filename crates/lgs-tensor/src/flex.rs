//! Tensors of the CPU backend as slices, and vectors as its tensors.

use burn::backend::ops::{FloatTensorOps, IntTensorOps};
use burn::backend::tensor::{FloatTensor, IntTensor};
use burn::backend::{Flex, TensorMetadata};
use burn::tensor::TensorData;

/// The values of a contiguous tensor, row by row.
///
/// # Panics
/// If the tensor is not contiguous or does not hold 32-bit floats.
#[must_use]
pub fn floats(tensor: &FloatTensor<Flex>) -> &[f32] {
    tensor.as_slice::<f32>().expect("a contiguous f32 tensor")
}

/// The rows of a contiguous tensor whose last dimension is `W`.
///
/// # Panics
/// If the last dimension differs, and as [`floats`] does.
#[must_use]
pub fn rows<const W: usize>(tensor: &FloatTensor<Flex>) -> &[[f32; W]] {
    let shape = tensor.shape();
    let last = shape.num_dims().checked_sub(1).map(|d| shape[d]);
    assert!(last == Some(W), "shape {shape:?} where rows of {W} are expected");
    floats(tensor).as_chunks().0
}

/// A tensor that takes over a vector of values.
#[must_use]
pub fn tensor<const D: usize>(values: Vec<f32>, shape: [usize; D]) -> FloatTensor<Flex> {
    Flex::float_from_data(TensorData::new(values, shape), &Default::default())
}

/// A tensor `[n, W]` that takes over `n` rows.
#[must_use]
pub fn tensor_of_rows<const W: usize>(rows: Vec<[f32; W]>) -> FloatTensor<Flex> {
    let n = rows.len();
    tensor(rows.into_flattened(), [n, W])
}

/// A tensor `[n]` of integers.
#[must_use]
pub fn integers(values: Vec<i32>) -> IntTensor<Flex> {
    let n = values.len();
    Flex::int_from_data(TensorData::new(values, [n]), &Default::default())
}
