//! The rasterizer as a backend extension: the kernel's call, the CPU implementation, the operation.

use crate::backward::{ImageCotangents, rasterize_vjp};
use crate::rasterize::{Rasterized, rasterize};
use crate::splats::Splats;
use burn::backend::autodiff::checkpoint::strategy::CheckpointStrategy;
use burn::backend::tensor::{FloatTensor, IntTensor};
use burn::backend::{Autodiff, Backend, ExtensionType, Flex, TensorMetadata, backend_extension};
use lgs_core::Camera;
use lgs_tensor::flex::{floats, integers, rows, tensor, tensor_of_rows};
use lgs_tensor::{Kernel, forward_kept, fused_kept};
use std::sync::Arc;

/// The tensors of [`super::SplatTensors`] as backend primitives.
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
    /// `[6]`, a motion of the scene in camera axes.
    pub pose: FloatTensor<B>,
}

impl<B: Backend> SplatPrimitives<B> {
    /// The tensors in the order of the fields.
    pub(super) fn into_array(self) -> [FloatTensor<B>; 7] {
        let Self { means, rotations, log_scales, raw_opacities, sh, means2d, pose } = self;
        [means, rotations, log_scales, raw_opacities, sh, means2d, pose]
    }
}

/// The constants of a call.
#[derive(Clone, Copy, Debug)]
pub struct ViewSpec {
    /// The camera.
    pub camera: Camera,
    /// Background colour.
    pub background: [f32; 3],
    /// Spherical-harmonic degree evaluated.
    pub active_degree: usize,
}

lgs_tensor::calls! { ViewSpec: "rasterize"; }

/// A rendered image, and which Gaussians it shows.
#[derive(Clone, Debug, ExtensionType)]
pub struct Drawn<B: Backend> {
    /// Colour and transmittance `[H, W, 4]`.
    pub packed: FloatTensor<B>,
    /// Three standard deviations of each Gaussian, rounded up to pixels `[n]`; 0 where it cannot touch the
    /// image.
    pub radii: IntTensor<B>,
}

/// Backends that can draw: kernels from the tensors of [`SplatPrimitives`] to the packed image.
pub trait RasterKernels: Kernel<ViewSpec, 7> {
    /// [`Drawn::radii`] of a forward pass.
    fn radii(kept: &Self::Kept) -> IntTensor<Self>;
}

/// The operation on backends with and without gradients.
#[backend_extension(Autodiff, Flex, Cube: cfg(feature = "gpu"))]
pub trait RasterOps: Backend {
    /// Draws Gaussians.
    fn rasterize(#[extension_type] splats: SplatPrimitives<Self>, view: ViewSpec) -> Drawn<Self>;
}

/// The state that a forward pass on the CPU keeps.
#[derive(Clone, Debug)]
pub struct RasterKept {
    inputs: [FloatTensor<Flex>; 7],
    /// The camera, moved by the pose.
    camera: Camera,
    forward: Arc<Rasterized>,
}

/// The camera of a view under a motion `[6]`.
fn camera(view: &ViewSpec, pose: &FloatTensor<Flex>) -> Camera {
    let motion: [f32; 6] = floats(pose).try_into().expect("six numbers of a motion");
    if motion == [0.0; 6] { view.camera } else { view.camera.seeing_moved(motion) }
}

/// Contiguous tensors as slices.
fn splats(inputs: &[FloatTensor<Flex>; 7], active_degree: usize) -> Splats<'_> {
    let [means, rotations, log_scales, raw_opacities, sh, _, _] = inputs;
    Splats {
        means: rows(means),
        rotations: rows(rotations),
        log_scales: rows(log_scales),
        raw_opacities: floats(raw_opacities),
        sh: floats(sh),
        sh_coefficients: sh.shape()[1],
        active_degree,
    }
}

impl Kernel<ViewSpec, 7> for Flex {
    type Kept = RasterKept;

    fn forward_kept(view: &ViewSpec, inputs: [FloatTensor<Self>; 7]) -> (FloatTensor<Self>, RasterKept) {
        let inputs = inputs.map(|input| input.to_contiguous());
        let camera = camera(view, &inputs[6]);
        let forward = rasterize(&splats(&inputs, view.active_degree), &camera, view.background);
        let packed: Vec<[f32; 4]> =
            forward.image.iter().zip(&forward.transmittance).map(|(&[r, g, b], &t)| [r, g, b, t]).collect();
        let shape = [view.camera.height as usize, view.camera.width as usize, 4];
        (tensor(packed.into_flattened(), shape), RasterKept { inputs, camera, forward: Arc::new(forward) })
    }

    fn vjp(view: &ViewSpec, kept: RasterKept, v_packed: FloatTensor<Self>) -> [FloatTensor<Self>; 7] {
        let v_packed = v_packed.to_contiguous();
        let (v_image, v_transmittance): (Vec<[f32; 3]>, Vec<f32>) =
            rows(&v_packed).iter().map(|&[r, g, b, t]| ([r, g, b], t)).unzip();
        let inputs = splats(&kept.inputs, view.active_degree);
        let (n, coefficients) = (inputs.len(), inputs.sh_coefficients);
        let forward = &kept.forward;
        let v = ImageCotangents { image: &v_image, transmittance: &v_transmittance };
        let v = rasterize_vjp(&inputs, &kept.camera, forward, v);
        [
            tensor_of_rows(v.means),
            tensor_of_rows(v.rotations),
            tensor_of_rows(v.log_scales),
            tensor(v.raw_opacities, [n]),
            tensor(v.sh, [n, coefficients, 3]),
            tensor_of_rows(v.means2d),
            tensor(v.pose.to_vec(), [6]),
        ]
    }
}

impl RasterKernels for Flex {
    fn radii(kept: &RasterKept) -> IntTensor<Self> {
        integers(kept.forward.radii.iter().map(|&radius| i32::try_from(radius).unwrap_or(i32::MAX)).collect())
    }
}

impl RasterOps for Flex {
    fn rasterize(splats: SplatPrimitives<Self>, view: ViewSpec) -> Drawn<Self> {
        let (packed, kept) = forward_kept::<Self, _, _>(&view, splats.into_array());
        Drawn { packed, radii: Self::radii(&kept) }
    }
}

impl<B: RasterKernels, C: CheckpointStrategy> RasterOps for Autodiff<B, C> {
    fn rasterize(splats: SplatPrimitives<Self>, view: ViewSpec) -> Drawn<Self> {
        let (packed, kept) = fused_kept::<B, C, _, _>(view, splats.into_array());
        Drawn { packed, radii: B::radii(&kept) }
    }
}
