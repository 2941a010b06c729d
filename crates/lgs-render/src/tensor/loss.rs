//! The photometric loss as a backend extension. On an autodiff device value and gradient come from one pass
//! over the images; the backward pass only scales the gradient.

use crate::photometric::{photometric, photometric_vjp};
use burn::backend::autodiff::checkpoint::strategy::CheckpointStrategy;
use burn::backend::tensor::FloatTensor;
use burn::backend::{Autodiff, Backend, Flex, TensorMetadata, backend_extension};
use lgs_tensor::flex::{rows, tensor};
use lgs_tensor::{Call, Kernel, Pass, forward, fused};
use tracing::{Span, trace_span};

/// The constant that the loss compares an image with.
#[derive(Clone, Debug)]
pub struct PhotometricCall<B: Backend> {
    /// The true image `[H, W, 3]`.
    pub target: FloatTensor<B>,
    /// Weight λ of the structural part.
    pub lambda: f32,
}

impl<B: Backend> Call for PhotometricCall<B> {
    fn span(pass: Pass) -> Span {
        match pass {
            Pass::Forward => trace_span!("photometric loss"),
            Pass::ForwardKept => trace_span!("photometric loss and gradient"),
            Pass::Backward => Span::none(),
        }
    }
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
        let (image, target) = (image.to_contiguous(), call.target.to_contiguous());
        let shape = image.shape();
        let loss = photometric(rows(&image), rows(&target), [shape[1], shape[0]], call.lambda);
        tensor(vec![loss], [1])
    }

    fn forward_kept(
        call: &PhotometricCall<Self>,
        [image]: [FloatTensor<Self>; 1],
    ) -> (FloatTensor<Self>, Self::Kept) {
        let (image, target) = (image.to_contiguous(), call.target.to_contiguous());
        let shape = image.shape();
        let (loss, v) = photometric_vjp(rows(&image), rows(&target), [shape[1], shape[0]], call.lambda);
        (tensor(vec![loss], [1]), tensor(v.into_flattened(), [shape[0], shape[1], 3]))
    }

    fn vjp(_: &PhotometricCall<Self>, gradient: Self::Kept, v: FloatTensor<Self>) -> [FloatTensor<Self>; 1] {
        [scaled::<Self>(gradient, v)]
    }
}

/// The gradient `[H, W, 3]` by the image times the cotangent `[1]` of the loss.
pub(super) fn scaled<B: Backend>(gradient: FloatTensor<B>, v_loss: FloatTensor<B>) -> FloatTensor<B> {
    B::float_mul(gradient, B::float_reshape(v_loss, [1, 1, 1].into()))
}

/// The operation on a backend that runs its kernels directly.
macro_rules! without_gradients {
    ($backend:ty) => {
        impl PhotometricOps for $backend {
            fn photometric_loss(
                image: FloatTensor<Self>,
                target: FloatTensor<Self>,
                lambda: f32,
            ) -> FloatTensor<Self> {
                forward::<Self, _, _>(&PhotometricCall { target, lambda }, [image])
            }
        }
    };
}

without_gradients!(Flex);
#[cfg(feature = "gpu")]
without_gradients!(lgs_tensor::cube::CubeBackend);

impl<B: PhotometricKernels, C: CheckpointStrategy> PhotometricOps for Autodiff<B, C> {
    fn photometric_loss(
        image: FloatTensor<Self>,
        target: FloatTensor<Self>,
        lambda: f32,
    ) -> FloatTensor<Self> {
        fused::<B, C, _, _>(PhotometricCall::<B> { target: target.into_primitive(), lambda }, [image])
    }
}
