//! The vector–Jacobian product of `max(z, 0)` in rows that lie among others.

use burn::backend::TensorMetadata;
use burn::tensor::{DType, Tensor};
use cubecl::prelude::*;
use lgs_tensor::cube::product::{primitive, tensor};
use lgs_tensor::cube::{arguments, empty, units};

/// Columns of a matrix: the first, and how many columns the matrix has.
#[derive(CubeType, CubeLaunch, Clone, Copy)]
pub(super) struct Columns {
    first: u32,
    all: u32,
}

/// The cotangents where outputs are positive, and zero elsewhere.
#[cube(launch)]
fn gate(v: &[f32], outputs: &[f32], out: &mut [f32], of_v: Columns, of_outputs: Columns, width: u32) {
    if ABSOLUTE_POS < out.len() {
        let at = ABSOLUTE_POS as u32;
        let (row, column) = (at / width, at % width);
        let output = outputs[(row * of_outputs.all + of_outputs.first + column) as usize];
        let cotangent = v[(row * of_v.all + of_v.first + column) as usize];
        out[ABSOLUTE_POS] = select(output > 0.0f32, cotangent, 0.0f32);
    }
}

/// The cotangent `[n, width]` of what went into `max(z, 0)`, given a cotangent and the outputs, each with the
/// number of columns that stand before those of the layer.
pub(super) fn relu_vjp(outputs: (&Tensor<2>, usize), v: (&Tensor<2>, usize), width: usize) -> Tensor<2> {
    let columns = |of: (&Tensor<2>, usize)| ColumnsLaunch::new(of.1 as u32, of.0.dims()[1] as u32);
    let [cotangents, values] = [v.0, outputs.0].map(|tensor| primitive(tensor.clone()));
    let n = values.shape()[0];
    let out = empty(&values, [n, width], DType::F32);
    let (count, dim) = units(&out.client, n * width);
    let [from, by, to] = arguments([&cotangents, &values, &out]);
    gate::launch(&out.client, count, dim, from, by, to, columns(v), columns(outputs), width as u32);
    tensor(out)
}
