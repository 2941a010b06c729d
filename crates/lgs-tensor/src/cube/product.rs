//! Products of matrices: those of the tensor library, and on software devices plain ones. The library's
//! kernels there take minutes to compile, since every barrier of theirs splits a program in two.
#![allow(missing_docs, reason = "those of what the language's macro writes beside a kernel")]

use burn::backend::TensorMetadata;
use burn::tensor::{DType, Float, Tensor};
use burn_cubecl::cubecl::{self, prelude::*};

use super::{CubeBackend, CubeTensor, contiguous, empty, is_software, units};

/// `a b`, a unit per entry; `inner` is the number of columns of `a`.
#[cube(launch)]
fn multiply(a: &[f32], b: &[f32], out: &mut [f32], inner: u32, columns: u32) {
    if ABSOLUTE_POS < out.len() {
        let row = ABSOLUTE_POS / columns as usize;
        let column = ABSOLUTE_POS % columns as usize;
        let mut sum = 0.0f32;
        for k in 0..inner as usize {
            sum += a[row * inner as usize + k] * b[k * columns as usize + column];
        }
        out[ABSOLUTE_POS] = sum;
    }
}

/// A tensor of the device behind its primitive.
#[must_use]
pub fn tensor<const D: usize>(primitive: CubeTensor) -> Tensor<D> {
    Tensor::<D, Float>::from_primitive::<CubeBackend>(primitive)
}

/// The contiguous primitive of a tensor of the device.
///
/// # Panics
/// If it is one of another device.
#[must_use]
pub fn primitive<const D: usize>(tensor: Tensor<D>) -> CubeTensor {
    contiguous(tensor.try_into_primitive::<CubeBackend>().expect("a tensor of the device"))
}

/// `a b`.
#[must_use]
pub fn product(a: Tensor<2>, b: Tensor<2>) -> Tensor<2> {
    if !is_software(&a.device()) {
        return a.matmul(b);
    }
    let (a, b) = (primitive(a), primitive(b));
    let ([rows, inner], columns) = ([a.shape()[0], a.shape()[1]], b.shape()[1]);
    let out = empty(&a, [rows, columns], DType::F32);
    let (count, dim) = units(&a.client, rows * columns);
    let client = a.client.clone();
    multiply::launch(
        &client,
        count,
        dim,
        a.into_buffer_arg(),
        b.into_buffer_arg(),
        out.clone().into_buffer_arg(),
        inner as u32,
        columns as u32,
    );
    tensor(out)
}
