//! The photometric loss on devices of CubeCL: value and gradient from the kernels of [`super::ssim`].

use super::super::loss::{PhotometricCall, scaled};
use burn::backend::TensorMetadata;
use burn::backend::ops::FloatTensorOps;
use burn::backend::tensor::FloatTensor;
use burn::tensor::{DType, TensorData};
use cubecl::prelude::*;
use lgs_tensor::Kernel;
use lgs_tensor::cube::sums::sums;
use lgs_tensor::cube::{CubeBackend, CubeTensor, arguments, contiguous, cubes, empty, units};

use crate::window::weights;

use super::ssim::{EDGE, SizeLaunch, compare, gradient};

/// Images `[H, W, 3]` that are compared, and what weighs their differences.
struct Comparison {
    image: CubeTensor,
    target: CubeTensor,
    /// The window, and the weights of absolute differences and of SSIM over the number of values.
    weights: CubeTensor,
    height: usize,
    width: usize,
}

impl Comparison {
    fn new(call: &PhotometricCall<CubeBackend>, image: CubeTensor) -> Self {
        let shape = image.shape();
        let values = shape.num_elements().max(1) as f32;
        let mut numbers = weights().to_vec();
        numbers.extend([(1.0 - call.lambda) / values, -call.lambda / values]);
        let count = numbers.len();
        let weights = CubeBackend::float_from_data(TensorData::new(numbers, [count]), &image.device);
        let (image, target) = (contiguous(image), contiguous(call.target.clone()));
        Self { image, target, weights, height: shape[0], width: shape[1] }
    }

    fn cubes(&self) -> (CubeCount, CubeDim) {
        let squares = self.width.div_ceil(EDGE) * self.height.div_ceil(EDGE);
        (cubes(&self.image.client, 3 * squares), CubeDim::new_1d((EDGE * EDGE) as u32))
    }

    /// The arguments that both kernels begin with.
    fn inputs(&self) -> [BufferArg; 3] {
        arguments([&self.image, &self.target, &self.weights])
    }

    fn size(&self) -> SizeLaunch {
        SizeLaunch::new(self.width as u32, self.height as u32)
    }

    /// SSIM and absolute differences `[2, H W 3]`, and slopes `[3, H W 3]`.
    fn compared(&self) -> [CubeTensor; 2] {
        let values = 3 * self.width * self.height;
        let out = [2, 3].map(|maps| empty(&self.image, [maps, values], DType::F32));
        let ((cubes, dim), [image, target, weights]) = (self.cubes(), self.inputs());
        let [values, slopes] = out.clone().map(CubeTensor::into_buffer_arg);
        let client = &self.image.client;
        compare::launch(client, cubes, dim, image, target, weights, values, slopes, self.size());
        out
    }

    /// Gradient `[H, W, 3]` by the image, given the slopes.
    fn gradient(&self, slopes: CubeTensor) -> CubeTensor {
        let out = empty(&self.image, [self.height, self.width, 3], DType::F32);
        let ((cubes, dim), [image, target, weights]) = (self.cubes(), self.inputs());
        let [slopes, by_image] = [slopes, out.clone()].map(CubeTensor::into_buffer_arg);
        let client = &self.image.client;
        gradient::launch(client, cubes, dim, image, target, weights, slopes, by_image, self.size());
        out
    }
}

/// `(1 - λ) mean|a - b| + λ (1 - mean SSIM)`, given SSIM and absolute differences `[2, n]`.
fn loss(values: &CubeTensor, lambda: f32) -> CubeTensor {
    let count = values.shape()[1];
    let sums = sums(values, [2, count, 1]);
    let out = empty(values, [1], DType::F32);
    let (cubes, dim) = units(&out.client, 1);
    let [from, to] = arguments([&sums, &out]);
    weigh::launch(&out.client, cubes, dim, from, to, lambda, count.max(1) as f32);
    out
}

/// The loss from the sums of SSIM and of absolute differences of so many values.
#[cube(launch)]
fn weigh(sums: &[f32], loss: &mut [f32], lambda: f32, count: f32) {
    if ABSOLUTE_POS == 0usize {
        loss[0usize] = lambda * (1.0f32 - sums[0usize] / count) + (1.0f32 - lambda) * sums[1usize] / count;
    }
}

impl Kernel<PhotometricCall<Self>, 1> for CubeBackend {
    /// Gradient by the image.
    type Kept = FloatTensor<Self>;

    fn forward(call: &PhotometricCall<Self>, [image]: [FloatTensor<Self>; 1]) -> FloatTensor<Self> {
        let [values, _] = Comparison::new(call, image).compared();
        loss(&values, call.lambda)
    }

    fn forward_kept(
        call: &PhotometricCall<Self>,
        [image]: [FloatTensor<Self>; 1],
    ) -> (FloatTensor<Self>, Self::Kept) {
        let comparison = Comparison::new(call, image);
        let [values, slopes] = comparison.compared();
        (loss(&values, call.lambda), comparison.gradient(slopes))
    }

    fn vjp(_: &PhotometricCall<Self>, gradient: Self::Kept, v: FloatTensor<Self>) -> [FloatTensor<Self>; 1] {
        [scaled::<Self>(gradient, v)]
    }
}
