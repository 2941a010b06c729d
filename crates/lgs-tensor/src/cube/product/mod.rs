//! Products of matrices on devices, from buffers of which a matrix may be a part.

mod ranges;
mod staging;
mod tiles;

use burn::backend::TensorMetadata;
use burn::tensor::{DType, Float, Tensor};

use super::sums::sums;
use super::{CubeBackend, CubeTensor, arguments, contiguous, cubes, empty, units};
use burn_cubecl::cubecl::CubeDim;
use ranges::add_ranges;
use staging::EDGE;
use tiles::{End, Form, SLICE, SizesLaunch, multiply};

/// Cubes that a device should have to do before sums are left in one piece.
const ENOUGH_CUBES: usize = 256;
/// Summands of a range at the least.
const LEAST_RANGE: usize = 256;

/// A matrix in a buffer.
#[derive(Clone, Debug)]
pub struct Matrix {
    buffer: CubeTensor,
    begin: usize,
    rows: usize,
    columns: usize,
    is_transposed: bool,
}

impl Matrix {
    /// The matrix `[rows, columns]` that begins at a number of a buffer, row by row.
    #[must_use]
    pub fn within(buffer: &CubeTensor, begin: usize, [rows, columns]: [usize; 2]) -> Self {
        Self { buffer: buffer.clone(), begin, rows, columns, is_transposed: false }
    }

    /// A tensor of two dimensions.
    ///
    /// # Panics
    /// If it is one of another device.
    #[must_use]
    pub fn of(tensor: &Tensor<2>) -> Self {
        Self::within(&primitive(tensor.clone()), 0, tensor.dims())
    }

    /// The transposed matrix, in the same place.
    #[must_use]
    pub fn transposed(self) -> Self {
        Self { rows: self.columns, columns: self.rows, is_transposed: !self.is_transposed, ..self }
    }
}

/// Where a layer `x Wᵀ + b` has its weights `[outputs, inputs]` and biases among a network's parameters.
#[derive(Clone, Copy, Debug)]
pub struct Layer {
    /// The first weight.
    pub weight: usize,
    /// The first bias.
    pub bias: usize,
    /// Columns of W.
    pub inputs: usize,
    /// Rows of W.
    pub outputs: usize,
}

impl Layer {
    /// The weights, among parameters.
    #[must_use]
    pub fn weights(&self, params: &CubeTensor) -> Matrix {
        Matrix::within(params, self.weight, [self.outputs, self.inputs])
    }
}

/// A product that is to be launched.
struct Product<'a> {
    left: &'a Matrix,
    right: &'a Matrix,
    form: Form,
    bias: usize,
    /// Summands of a range, a multiple of the slice; all of them where the product is not divided.
    range: usize,
}

impl<'a> Product<'a> {
    fn new(left: &'a Matrix, right: &'a Matrix) -> Self {
        assert_eq!(left.columns, right.rows, "columns of the left factor and rows of the right one");
        let is_along = [!left.is_transposed, right.is_transposed];
        let form = Form { is_along, end: End::Plain, has_sums: false, fours: 2 };
        let range = left.columns.next_multiple_of(SLICE).max(SLICE);
        let mut product = Self { left, right, form, bias: 0, range };
        if product.tiles() < ENOUGH_CUBES || right.columns <= form.tile() / 2 {
            product.form.fours = 1;
        }
        product
    }

    /// Ranges of summands, none of which is empty.
    fn ranges(&self) -> usize {
        self.left.columns.div_ceil(self.range).max(1)
    }

    fn tiles(&self) -> usize {
        let edge = self.form.tile();
        self.left.rows.div_ceil(edge) * self.right.columns.div_ceil(edge)
    }

    /// Divides the summands where there are too few tiles; large ones then.
    fn divided(mut self) -> Self {
        let inner = self.left.columns;
        if inner >= 2 * LEAST_RANGE {
            self.form.fours = if self.right.columns.min(self.left.rows) > EDGE * 4 { 2 } else { 1 };
            let ranges = ENOUGH_CUBES.div_ceil(self.tiles()).min(inner / LEAST_RANGE).max(1);
            self.range = inner.div_ceil(ranges).next_multiple_of(SLICE);
        }
        self
    }

    /// Launches it; the parts of all ranges, each with `extra` numbers.
    fn launch(&self, extra: usize) -> CubeTensor {
        let Self { left, right, form, .. } = self;
        let (rows, columns, inner) = (left.rows, right.columns, left.columns);
        let out = empty(&left.buffer, [self.ranges(), rows * columns + extra], DType::F32);
        if rows * columns == 0 {
            return out;
        }
        let count = self.tiles() * self.ranges();
        let numbers = [rows, columns, inner, self.range, count, left.begin, right.begin, self.bias];
        let [rows, columns, inner, range, all, a, b, bias] = numbers.map(|number| number as u32);
        let sizes = SizesLaunch::new(rows, columns, inner, range, all, a, b, bias);
        let client = &out.client;
        let [from, by, to] = arguments([&left.buffer, &right.buffer, &out]);
        multiply::launch(client, cubes(client, count), CubeDim::new_1d(256), from, by, to, sizes, *form);
        out
    }
}

/// Adds the parts of ranges into a buffer: the first `split` numbers of each from one place on, the others
/// from another.
fn gather(parts: &CubeTensor, out: &CubeTensor, split: usize, [to, then]: [usize; 2]) {
    let [ranges, length] = [parts.shape()[0], parts.shape()[1]];
    let (count, dim) = units(&out.client, length);
    let [from, into] = arguments([parts, out]);
    let [ranges, split, to, then] = [ranges, split, to, then].map(|number| number as u32);
    add_ranges::launch(&out.client, count, dim, from, into, ranges, split, to, then);
}

/// `a b`.
///
/// # Panics
/// If the columns of `a` are not as many as the rows of `b`.
#[must_use]
pub fn product(a: &Matrix, b: &Matrix) -> Tensor<2> {
    let [rows, columns] = [a.rows, b.columns];
    let product = Product::new(a, b).divided();
    let parts = product.launch(0);
    if product.ranges() == 1 {
        return tensor::<2>(parts).reshape([rows, columns]);
    }
    let out = empty(&parts, [rows, columns], DType::F32);
    gather(&parts, &out, rows * columns, [0, 0]);
    tensor(out)
}

/// A layer of a network, with `max(z, 0)` behind it where `is_relu`.
///
/// # Panics
/// If `x` has not the layer's number of columns.
#[must_use]
pub fn affine(x: &Tensor<2>, params: &CubeTensor, layer: &Layer, is_relu: bool) -> Tensor<2> {
    let (x, weights) = (Matrix::of(x), layer.weights(params).transposed());
    let mut product = Product::new(&x, &weights);
    product.form.end = if is_relu { End::Relu } else { End::Bias };
    product.bias = layer.bias;
    tensor::<2>(product.launch(0)).reshape([x.rows, layer.outputs])
}

/// The gradients `vᵀ x` of a layer's weights and `Σ v` of its biases, written to their places in `gradient`.
///
/// # Panics
/// If `v` and `x` have not the layer's numbers of columns.
pub fn affine_gradient(v: &Tensor<2>, x: &Tensor<2>, gradient: &CubeTensor, layer: &Layer) {
    let (v, x) = (Matrix::of(v).transposed(), Matrix::of(x));
    let mut product = Product::new(&v, &x).divided();
    product.form.has_sums = true;
    let parts = product.launch(layer.outputs);
    gather(&parts, gradient, layer.outputs * layer.inputs, [layer.weight, layer.bias]);
}

/// Sums `[1, columns]` over the rows of a matrix.
#[must_use]
pub fn column_sums(x: &Tensor<2>) -> Tensor<2> {
    let [rows, columns] = x.dims();
    tensor(sums(&primitive(x.clone()), [1, rows, columns]))
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
