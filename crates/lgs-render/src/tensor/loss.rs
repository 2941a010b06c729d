//! The photometric loss as a backend extension. On an autodiff device value and gradient come from one pass
//! over the images; the backward pass only scales the gradient.

use super::ops::{floats, tensor};
use crate::photometric::{photometric, photometric_vjp};
use burn::backend::autodiff::checkpoint::{base::Checkpointer, strategy::CheckpointStrategy};
use burn::backend::autodiff::grads::Gradients;
use burn::backend::autodiff::ops::{Backward, Ops, OpsKind, unary};
use burn::backend::tensor::FloatTensor;
use burn::backend::{Autodiff, Backend, Flex, TensorMetadata, backend_extension};

/// Backends that can compare images.
#[backend_extension(Autodiff, Flex)]
pub trait PhotometricOps: Backend {
    /// The loss `[1]` of an image `[H, W, 3]` against a target, which is a constant.
    fn photometric_loss(
        image: FloatTensor<Self>,
        target: FloatTensor<Self>,
        lambda: f32,
    ) -> FloatTensor<Self>;
}

/// Backends that give the loss together with its gradient.
pub trait PhotometricKernels: PhotometricOps {
    /// The loss `[1]` and its gradient by the image `[H, W, 3]`.
    fn photometric_loss_and_gradient(
        image: FloatTensor<Self>,
        target: FloatTensor<Self>,
        lambda: f32,
    ) -> (FloatTensor<Self>, FloatTensor<Self>);
}

impl PhotometricOps for Flex {
    fn photometric_loss(
        image: FloatTensor<Self>,
        target: FloatTensor<Self>,
        lambda: f32,
    ) -> FloatTensor<Self> {
        let _span = tracing::trace_span!("photometric loss").entered();
        let (image, target) = (image.to_contiguous(), target.to_contiguous());
        let shape = image.shape();
        let loss = photometric(
            floats(&image).as_chunks().0,
            floats(&target).as_chunks().0,
            shape[1],
            shape[0],
            lambda,
        );
        tensor(vec![loss], [1])
    }
}

impl PhotometricKernels for Flex {
    fn photometric_loss_and_gradient(
        image: FloatTensor<Self>,
        target: FloatTensor<Self>,
        lambda: f32,
    ) -> (FloatTensor<Self>, FloatTensor<Self>) {
        let _span = tracing::trace_span!("photometric loss and gradient").entered();
        let (image, target) = (image.to_contiguous(), target.to_contiguous());
        let shape = image.shape();
        let (loss, v) = photometric_vjp(
            floats(&image).as_chunks().0,
            floats(&target).as_chunks().0,
            shape[1],
            shape[0],
            lambda,
        );
        (tensor(vec![loss], [1]), tensor(v.into_flattened(), [shape[0], shape[1], 3]))
    }
}

#[derive(Debug)]
struct Photometric;

impl<B: PhotometricKernels> Backward<B, 1> for Photometric {
    /// Gradient by the image.
    type State = FloatTensor<B>;

    fn backward(self, ops: Ops<Self::State, 1>, grads: &mut Gradients, _checkpointer: &mut Checkpointer) {
        let gradient = ops.state;
        unary::<B, _>(ops.parents, ops.node, grads, |v_loss| {
            let scale = B::float_reshape(v_loss, [1, 1, 1].into());
            B::float_mul(gradient, scale)
        });
    }
}

impl<B: PhotometricKernels, C: CheckpointStrategy> PhotometricOps for Autodiff<B, C> {
    fn photometric_loss(
        image: FloatTensor<Self>,
        target: FloatTensor<Self>,
        lambda: f32,
    ) -> FloatTensor<Self> {
        let node = image.node();
        let (image, target) = (image.into_primitive(), target.into_primitive());
        match Photometric.prepare::<C>([node]).compute_bound().stateful() {
            OpsKind::Tracked(prep) => {
                let (loss, gradient) = B::photometric_loss_and_gradient(image, target, lambda);
                prep.finish(gradient, loss)
            }
            OpsKind::UnTracked(prep) => prep.finish(B::photometric_loss(image, target, lambda)),
        }
    }
}
