//! What kernels are told of a call: sizes as scalars, the camera and the Gaussians' parameters as one buffer.

use crate::view::View;
use cubecl::prelude::*;
use lgs_core::PixelFilter;

use super::super::ops::ViewSpec;

/// Edge of a tile in pixels, and pixels of a tile.
pub(super) const TILE: u32 = 16;
pub(super) const PIXELS: u32 = TILE * TILE;

/// Floats before the first Gaussian in the buffer of parameters: the camera.
pub(super) const HEADER: usize = 32;
/// Parameters of a Gaussian, without harmonics: centre, quaternion, log scales, opacity logit.
pub(super) const PARAMETERS: usize = 11;
/// Floats of a projected Gaussian: centre (0), factors (2), log2 of the opacity (5), colour (6), depth (9),
/// reach (10), half width and height (11), rightmost (13), radius (14).
pub(super) const PROJECTED: usize = 16;

/// Sizes of a call.
#[derive(CubeType, CubeLaunch, Clone, Copy)]
pub(super) struct Frame {
    /// Number of Gaussians.
    pub(super) gaussians: u32,
    /// Coefficients stored per Gaussian and channel.
    pub(super) coefficients: u32,
    /// Width of the image, pixels.
    pub(super) width: u32,
    /// Height of the image, pixels.
    pub(super) height: u32,
}

/// Sizes of a call on the processor.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sizes {
    pub(super) gaussians: usize,
    pub(super) coefficients: usize,
    pub(super) width: usize,
    pub(super) height: usize,
}

impl Sizes {
    /// Number of tiles.
    pub(super) fn tiles(&self) -> usize {
        self.width.div_ceil(TILE as usize) * self.height.div_ceil(TILE as usize)
    }

    /// The sizes as an argument.
    pub(super) fn frame(&self) -> FrameLaunch {
        let of = |size: usize| size as u32;
        FrameLaunch::new(of(self.gaussians), of(self.coefficients), of(self.width), of(self.height))
    }
}

/// Columns of tiles.
#[cube]
pub(super) fn columns(frame: &Frame) -> u32 {
    (frame.width + TILE - 1u32) / TILE
}

/// The camera as the first [`HEADER`] floats of the parameters: rotation rows (0), translation (9), focal
/// lengths (12), principal point (14), limits of the tangents (16), centre (18), near plane (21), blur (22),
/// 1 for the Mip filter (23), background (24).
pub(super) fn header(spec: &ViewSpec) -> Vec<f32> {
    let view = View::from(&spec.camera);
    let mut out: Vec<f32> = view.rotation.as_flattened().to_vec();
    out.extend(view.translation);
    out.extend(view.focal);
    out.extend(view.principal);
    out.extend(view.tangent_limit);
    out.extend(view.center);
    out.extend([view.near, view.blur]);
    out.push(if view.filter == PixelFilter::Mip { 1.0 } else { 0.0 });
    out.extend(spec.background);
    out.resize(HEADER, 0.0);
    out
}
