//! The photometric loss as a backend extension. On an autodiff device value and gradient come from one pass
//! over the images; the backward pass only scales the gradient.

use crate::photometric::{photometric, photometric_vjp};
use burn::backend::autodiff::checkpoint::strategy::CheckpointStrategy;
use burn::backend::ops::FloatTensorOps;
use burn::backend::tensor::FloatTensor;
use burn::backend::{Autodiff, Backend, Flex, TensorMetadata, backend_extension};
use lgs_tensor::flex::{rows, tensor};
use lgs_tensor::{Kernel, fused};

/// The constant that the loss compares an image with.
#[derive(Clone, Debug)]
pub struct PhotometricCall<B: Backend> {
    /// The true image `[H, W, 3]`.
    pub target: FloatTensor<B>,
    /// Weight λ of the structural part.
    pub lambda: f32,
}

/// Backends that can compare images: kernels from an image `[H, W, 3]` to its loss `[1]`.
pub trait PhotometricKernels: Kernel<PhotometricCall<Self>, 1> {}

impl<B: Kernel<PhotometricCall<B>, 1>> PhotometricKernels for B {}

/// The operation on backends with and without gradients.
#[backend_extension(Autodiff, Flex, Cube: cfg(feature = "gpu"))]
pub trait PhotometricOps: Backend {
    /// The loss `[1]` of an image `[H, W, 3]` against a target, which is a constant.
    fn photometric_loss(
        image: FloatTensor<Self>,
        target: FloatTensor<Self>,
        lambda: f32,
    ) -> FloatTensor<Self>;
}

impl Kernel<PhotometricCall<Self>, 1> for Flex {
    /// Gradient by the image.
    type Kept = FloatTensor<Self>;

    fn forward(call: &PhotometricCall<Self>, [image]: [FloatTensor<Self>; 1]) -> FloatTensor<Self> {
        let _span = tracing::trace_span!("photometric loss").entered();
        let (image, target) = (image.to_contiguous(), call.target.to_contiguous());
        let shape = image.shape();
        let loss = photometric(rows(&image), rows(&target), [shape[1], shape[0]], call.lambda);
        tensor(vec![loss], [1])
    }

    fn forward_kept(
        call: &PhotometricCall<Self>,
        [image]: [FloatTensor<Self>; 1],
    ) -> (FloatTensor<Self>, Self::Kept) {
        let _span = tracing::trace_span!("photometric loss and gradient").entered();
        let (image, target) = (image.to_contiguous(), call.target.to_contiguous());
        let shape = image.shape();
        let (loss, v) = photometric_vjp(rows(&image), rows(&target), [shape[1], shape[0]], call.lambda);
        (tensor(vec![loss], [1]), tensor(v.into_flattened(), [shape[0], shape[1], 3]))
    }

    fn vjp(
        _: &PhotometricCall<Self>,
        gradient: Self::Kept,
        v_loss: FloatTensor<Self>,
    ) -> [FloatTensor<Self>; 1] {
        let scale = Self::float_reshape(v_loss, [1, 1, 1].into());
        [Self::float_mul(gradient, scale)]
    }
}

impl PhotometricOps for Flex {
    fn photometric_loss(
        image: FloatTensor<Self>,
        target: FloatTensor<Self>,
        lambda: f32,
    ) -> FloatTensor<Self> {
        Self::forward(&PhotometricCall { target, lambda }, [image])
    }
}

impl<B: PhotometricKernels, C: CheckpointStrategy> PhotometricOps for Autodiff<B, C> {
    fn photometric_loss(
        image: FloatTensor<Self>,
        target: FloatTensor<Self>,
        lambda: f32,
    ) -> FloatTensor<Self> {
        fused::<B, C, _, _>(PhotometricCall::<B> { target: target.into_primitive(), lambda }, [image])
    }
}
