//! The photometric loss on devices of CubeCL: value and gradient from the kernels of [`super::ssim`].

use super::super::loss::{PhotometricCall, scaled};
use burn::backend::TensorMetadata;
use burn::backend::ops::FloatTensorOps;
use burn::backend::tensor::FloatTensor;
use burn::tensor::{DType, TensorData};
use cubecl::prelude::*;
use lgs_tensor::Kernel;
use lgs_tensor::cube::{CubeBackend, CubeTensor, arguments, contiguous, cubes, empty};

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
fn loss(values: CubeTensor, lambda: f32) -> CubeTensor {
    let means = CubeBackend::float_mean_dim(values, 1);
    let part = |row: usize, weight: f32| {
        let mean = CubeBackend::float_slice(means.clone(), &[(row..row + 1).into(), (0..1).into()]);
        CubeBackend::float_mul_scalar(CubeBackend::float_reshape(mean, [1].into()), weight.into())
    };
    CubeBackend::float_add_scalar(
        CubeBackend::float_add(part(0, -lambda), part(1, 1.0 - lambda)),
        lambda.into(),
    )
}

impl Kernel<PhotometricCall<Self>, 1> for CubeBackend {
    /// Gradient by the image.
    type Kept = FloatTensor<Self>;

    fn forward(call: &PhotometricCall<Self>, [image]: [FloatTensor<Self>; 1]) -> FloatTensor<Self> {
        let [values, _] = Comparison::new(call, image).compared();
        loss(values, call.lambda)
    }

    fn forward_kept(
        call: &PhotometricCall<Self>,
        [image]: [FloatTensor<Self>; 1],
    ) -> (FloatTensor<Self>, Self::Kept) {
        let comparison = Comparison::new(call, image);
        let [values, slopes] = comparison.compared();
        (loss(values, call.lambda), comparison.gradient(slopes))
    }

    fn vjp(_: &PhotometricCall<Self>, gradient: Self::Kept, v: FloatTensor<Self>) -> [FloatTensor<Self>; 1] {
        [scaled::<Self>(gradient, v)]
    }
}
