//! The rasterizer as a backend extension: the trait, the CPU implementation, the autodiff node.

use crate::backward::rasterize_vjp;
use crate::rasterize::{Rasterized, rasterize};
use crate::splats::Splats;
use burn::backend::autodiff::checkpoint::{base::Checkpointer, strategy::CheckpointStrategy};
use burn::backend::autodiff::grads::Gradients;
use burn::backend::autodiff::ops::{Backward, Ops, OpsKind};
use burn::backend::ops::FloatTensorOps;
use burn::backend::tensor::FloatTensor;
use burn::backend::{Autodiff, Backend, ExtensionType, Flex, TensorMetadata, backend_extension};
use burn::tensor::TensorData;
use lgs_core::Camera;
use std::sync::Arc;

/// The tensors of [`super::SplatTensors`] as backend primitives; also their cotangents.
#[derive(Clone, Debug, ExtensionType)]
pub struct SplatPrimitives<B: Backend> {
    /// `[n, 3]`
    pub means: FloatTensor<B>,
    /// `[n, 4]`
    pub rotations: FloatTensor<B>,
    /// `[n, 3]`
    pub log_scales: FloatTensor<B>,
    /// `[n]`
    pub raw_opacities: FloatTensor<B>,
    /// `[n, K, 3]`
    pub sh: FloatTensor<B>,
    /// `[n, 2]`
    pub means2d: FloatTensor<B>,
}

/// What a call needs beside tensors.
#[derive(Clone, Copy, Debug)]
pub struct ViewSpec {
    /// The camera.
    pub camera: Camera,
    /// Background colour.
    pub background: [f32; 3],
    /// Spherical-harmonic degree evaluated.
    pub active_degree: usize,
}

/// A rendered image and the state its backward pass needs.
#[derive(Clone, Debug, ExtensionType)]
pub struct Drawn<B: Backend> {
    /// Colour and transmittance `[H, W, 4]`.
    pub packed: FloatTensor<B>,
    /// The forward pass.
    pub forward: Arc<Rasterized>,
}

/// Backends that can draw.
#[backend_extension(Autodiff, Flex)]
pub trait RasterOps: Backend {
    /// Draws Gaussians.
    fn rasterize(#[extension_type] splats: SplatPrimitives<Self>, view: ViewSpec) -> Drawn<Self>;
}

/// Backends that can pull a cotangent back through [`RasterOps`]; apart from it, as only the inner backend of
/// an autodiff one is asked.
pub trait RasterKernels: RasterOps {
    /// Cotangents of every input, given that of the packed output.
    fn rasterize_vjp(
        splats: SplatPrimitives<Self>,
        view: ViewSpec,
        forward: &Rasterized,
        v_packed: FloatTensor<Self>,
    ) -> SplatPrimitives<Self>;
}

/// A contiguous tensor as a slice.
pub(super) fn floats(tensor: &FloatTensor<Flex>) -> &[f32] {
    tensor.as_slice::<f32>().expect("a contiguous f32 tensor")
}

/// A tensor that takes over a vector.
pub(super) fn tensor<const D: usize>(values: Vec<f32>, shape: [usize; D]) -> FloatTensor<Flex> {
    Flex::float_from_data(TensorData::new(values, shape), &Default::default())
}

impl SplatPrimitives<Flex> {
    fn contiguous(&self) -> Self {
        Self {
            means: self.means.to_contiguous(),
            rotations: self.rotations.to_contiguous(),
            log_scales: self.log_scales.to_contiguous(),
            raw_opacities: self.raw_opacities.to_contiguous(),
            sh: self.sh.to_contiguous(),
            means2d: self.means2d.clone(),
        }
    }

    /// Of contiguous tensors.
    fn splats(&self, active_degree: usize) -> Splats<'_> {
        Splats {
            means: floats(&self.means).as_chunks().0,
            rotations: floats(&self.rotations).as_chunks().0,
            log_scales: floats(&self.log_scales).as_chunks().0,
            raw_opacities: floats(&self.raw_opacities),
            sh: floats(&self.sh),
            sh_coefficients: self.sh.shape()[1],
            active_degree,
        }
    }
}

impl RasterOps for Flex {
    fn rasterize(splats: SplatPrimitives<Self>, view: ViewSpec) -> Drawn<Self> {
        let _span = tracing::trace_span!("rasterize").entered();
        let splats = splats.contiguous();
        let forward = rasterize(&splats.splats(view.active_degree), &view.camera, view.background);
        let packed: Vec<[f32; 4]> =
            forward.image.iter().zip(&forward.transmittance).map(|(&[r, g, b], &t)| [r, g, b, t]).collect();
        let shape = [view.camera.height as usize, view.camera.width as usize, 4];
        Drawn { packed: tensor(packed.into_flattened(), shape), forward: Arc::new(forward) }
    }
}

impl RasterKernels for Flex {
    fn rasterize_vjp(
        splats: SplatPrimitives<Self>,
        view: ViewSpec,
        forward: &Rasterized,
        v_packed: FloatTensor<Self>,
    ) -> SplatPrimitives<Self> {
        let _span = tracing::trace_span!("rasterize, backward").entered();
        let (splats, v_packed) = (splats.contiguous(), v_packed.to_contiguous());
        let (v_image, v_transmittance): (Vec<[f32; 3]>, Vec<f32>) =
            floats(&v_packed).as_chunks::<4>().0.iter().map(|&[r, g, b, t]| ([r, g, b], t)).unzip();
        let inputs = splats.splats(view.active_degree);
        let (n, coefficients) = (inputs.len(), inputs.sh_coefficients);
        let v = rasterize_vjp(&inputs, &view.camera, view.background, forward, &v_image, &v_transmittance);
        SplatPrimitives {
            means: tensor(v.means.into_flattened(), [n, 3]),
            rotations: tensor(v.rotations.into_flattened(), [n, 4]),
            log_scales: tensor(v.log_scales.into_flattened(), [n, 3]),
            raw_opacities: tensor(v.raw_opacities, [n]),
            sh: tensor(v.sh, [n, coefficients, 3]),
            means2d: tensor(v.means2d.into_flattened(), [n, 2]),
        }
    }
}

#[derive(Debug)]
struct Rasterize;

impl<B: RasterKernels> Backward<B, 6> for Rasterize {
    type State = (SplatPrimitives<B>, ViewSpec, Arc<Rasterized>);

    fn backward(self, ops: Ops<Self::State, 6>, grads: &mut Gradients, _checkpointer: &mut Checkpointer) {
        let (splats, view, forward) = ops.state;
        let v_packed = grads.consume::<B>(&ops.node);
        let v = B::rasterize_vjp(splats, view, &forward, v_packed);
        let by_parent = [v.means, v.rotations, v.log_scales, v.raw_opacities, v.sh, v.means2d];
        for (parent, v) in ops.parents.into_iter().zip(by_parent) {
            if let Some(parent) = parent {
                grads.register::<B>(parent.id, v);
            }
        }
    }
}

impl<B: RasterKernels, C: CheckpointStrategy> RasterOps for Autodiff<B, C> {
    fn rasterize(splats: SplatPrimitives<Self>, view: ViewSpec) -> Drawn<Self> {
        let SplatPrimitives { means, rotations, log_scales, raw_opacities, sh, means2d } = splats;
        let nodes = [
            means.node(),
            rotations.node(),
            log_scales.node(),
            raw_opacities.node(),
            sh.node(),
            means2d.node(),
        ];
        let inner = SplatPrimitives::<B> {
            means: means.into_primitive(),
            rotations: rotations.into_primitive(),
            log_scales: log_scales.into_primitive(),
            raw_opacities: raw_opacities.into_primitive(),
            sh: sh.into_primitive(),
            means2d: means2d.into_primitive(),
        };
        let drawn = B::rasterize(inner.clone(), view);
        let packed = match Rasterize.prepare::<C>(nodes).compute_bound().stateful() {
            OpsKind::Tracked(prep) => prep.finish((inner, view, Arc::clone(&drawn.forward)), drawn.packed),
            OpsKind::UnTracked(prep) => prep.finish(drawn.packed),
        };
        Drawn { packed, forward: drawn.forward }
    }
}
