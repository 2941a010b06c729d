//! The rasterizer on devices of CubeCL: buffers, launches, and the kernel's `impl`.
//!
//! Project, list, blend; back, blend entry by entry, sum each Gaussian's entries and pull them back through
//! the projection. Everything stays on the device.

use super::super::ops::{Drawn, RasterKernels, RasterOps, SplatPrimitives, ViewSpec};
use burn::backend::TensorMetadata;
use burn::backend::ops::FloatTensorOps;
use burn::backend::tensor::{FloatTensor, IntTensor};
use burn::tensor::{DType, Shape, TensorData};
use cubecl::client::Client;
use cubecl::ir::features::Plane;
use cubecl::prelude::*;
use lgs_tensor::cube::{CubeBackend, CubeTensor, arguments, contiguous, cubes, empty, units, zeros};
use lgs_tensor::{Kernel, forward_kept};

use super::blend::{STATE, blend};
use super::blend_vjp::{COTANGENTS, blend_vjp};
use super::frame::{PIXELS, PROJECTED, Sizes};
use super::lists::{GROUP, Lists, lists};
use super::pack::{cotangents, cut, packed};
use super::pose::{MOTION, summed};
use super::project::{count_tiles, project};
use super::pull_back::{pull_back, sum_entries};

/// What a forward pass leaves on the device.
#[derive(Clone, Debug)]
pub struct CubeRasterKept {
    sizes: Sizes,
    /// Camera and parameters, and the harmonics.
    packed: CubeTensor,
    sh: CubeTensor,
    radii: CubeTensor,
    /// What was drawn; none where there is nothing to draw.
    drawn: Option<DrawnKept>,
}

#[derive(Clone, Debug)]
struct DrawnKept {
    projected: CubeTensor,
    lists: Lists,
    /// Where pixels are closed, and the states of tiles before groups.
    states: CubeTensor,
    /// Image and transmittance `[H, W, 4]`.
    image: CubeTensor,
}

fn sizes(view: &ViewSpec, inputs: &[CubeTensor; 7]) -> Sizes {
    let shape = inputs[4].shape();
    Sizes {
        gaussians: shape[0],
        coefficients: shape[1],
        width: view.camera.width as usize,
        height: view.camera.height as usize,
    }
}

/// The background alone.
fn empty_image(view: &ViewSpec, like: &CubeTensor) -> CubeTensor {
    let [r, g, b] = view.background;
    let shape = [view.camera.height as usize, view.camera.width as usize, 4];
    let values = [r, g, b, 1.0].repeat(shape[0] * shape[1]);
    CubeBackend::float_from_data(TensorData::new(values, shape), &like.device)
}

/// Projected Gaussians, numbers of tiles that each touches, and radii.
fn projected(kept: &CubeRasterKept, degree: usize) -> (CubeTensor, CubeTensor) {
    let (packed, n) = (&kept.packed, kept.sizes.gaussians);
    let projected = empty(packed, [n, PROJECTED], DType::F32);
    let counts = empty(packed, [n], DType::U32);
    let (count, dim) = units(&packed.client, n);
    project::launch(
        &packed.client,
        count.clone(),
        dim,
        packed.clone().into_buffer_arg(),
        kept.sh.clone().into_buffer_arg(),
        projected.clone().into_buffer_arg(),
        kept.sizes.frame(),
        degree as u32,
    );
    count_tiles::launch(
        &packed.client,
        count,
        dim,
        projected.clone().into_buffer_arg(),
        counts.clone().into_buffer_arg(),
        kept.radii.clone().into_buffer_arg(),
        kept.sizes.frame(),
    );
    (projected, counts)
}

/// Blends the lists.
fn blended(kept: &CubeRasterKept, projected: CubeTensor, lists: Lists) -> DrawnKept {
    let (sizes, packed) = (kept.sizes, &kept.packed);
    let states = empty(packed, [sizes.height * sizes.width + lists.groups * STATE], DType::F32);
    let image = empty(packed, [sizes.height, sizes.width, 4], DType::F32);
    blend::launch(
        &packed.client,
        cubes(&packed.client, sizes.tiles()),
        CubeDim::new_1d(PIXELS),
        projected.clone().into_buffer_arg(),
        lists.members.clone().into_buffer_arg(),
        lists.ranges.clone().into_buffer_arg(),
        lists.places.clone().into_buffer_arg(),
        packed.clone().into_buffer_arg(),
        states.clone().into_buffer_arg(),
        image.clone().into_buffer_arg(),
        lists.entries as u32,
        sizes.frame(),
    );
    DrawnKept { projected, lists, states, image }
}

/// Whether the planes of a device are as wide as a group of entries.
fn has_planes(client: &Client) -> bool {
    let properties = client.properties();
    let hardware = &properties.hardware;
    let widths = [hardware.plane_size_min, hardware.plane_size_max];
    properties.features.plane.contains(Plane::Ops) && widths == [GROUP as u32; 2]
}

/// Cotangents `[entries, COTANGENTS]` of the lists' entries.
fn v_entries(kept: &CubeRasterKept, drawn: &DrawnKept, v_image: CubeTensor) -> CubeTensor {
    let client = &kept.packed.client;
    let out = empty(&kept.packed, [drawn.lists.entries, COTANGENTS], DType::F32);
    blend_vjp::launch(
        client,
        cubes(client, drawn.lists.groups),
        CubeDim::new_1d(GROUP as u32),
        drawn.projected.clone().into_buffer_arg(),
        drawn.lists.members.clone().into_buffer_arg(),
        drawn.lists.ranges.clone().into_buffer_arg(),
        drawn.states.clone().into_buffer_arg(),
        drawn.image.clone().into_buffer_arg(),
        contiguous(v_image).into_buffer_arg(),
        out.clone().into_buffer_arg(),
        kept.sizes.frame(),
        has_planes(client),
    );
    out
}

/// The sums `[n, COTANGENTS]` of the cotangents of each Gaussian's entries.
fn summed_entries(kept: &CubeRasterKept, drawn: &DrawnKept, v_image: CubeTensor) -> CubeTensor {
    let n = kept.sizes.gaussians;
    let out = empty(&kept.packed, [n, COTANGENTS], DType::F32);
    let (count, dim) = units(&out.client, n * COTANGENTS);
    let [spans, from, to] = arguments([&drawn.lists.spans, &v_entries(kept, drawn, v_image), &out]);
    sum_entries::launch(&out.client, count, dim, spans, from, to);
    out
}

/// Cotangents of all inputs.
fn pulled_back(kept: &CubeRasterKept, degree: usize, v_image: CubeTensor) -> [CubeTensor; 7] {
    let (sizes, packed) = (kept.sizes, &kept.packed);
    let Some(drawn) = &kept.drawn else { return no_cotangents(kept) };
    let v_sh = empty(packed, [sizes.gaussians, sizes.coefficients, 3], DType::F32);
    let out = empty(packed, [cotangents(sizes.gaussians)], DType::F32);
    let (count, dim) = units(&packed.client, sizes.gaussians);
    pull_back::launch(
        &packed.client,
        count,
        dim,
        packed.clone().into_buffer_arg(),
        kept.sh.clone().into_buffer_arg(),
        drawn.projected.clone().into_buffer_arg(),
        drawn.lists.spans.clone().into_buffer_arg(),
        summed_entries(kept, drawn, v_image).into_buffer_arg(),
        out.clone().into_buffer_arg(),
        v_sh.clone().into_buffer_arg(),
        sizes.frame(),
        degree as u32,
    );
    let [means, rotations, log_scales, opacities, means2d, pose] = cut(&out, sizes.gaussians);
    [means, rotations, log_scales, opacities, v_sh, means2d, summed(&pose)]
}

/// Cotangents where nothing is drawn.
fn no_cotangents(kept: &CubeRasterKept) -> [CubeTensor; 7] {
    let n = kept.sizes.gaussians;
    let of = |shape: &[usize]| zeros(&kept.packed, Shape::from(shape.to_vec()), DType::F32);
    let sh = [n, kept.sizes.coefficients, 3];
    [of(&[n, 3]), of(&[n, 4]), of(&[n, 3]), of(&[n]), of(&sh), of(&[n, 2]), of(&[MOTION])]
}

impl Kernel<ViewSpec, 7> for CubeBackend {
    type Kept = CubeRasterKept;

    fn forward_kept(view: &ViewSpec, inputs: [FloatTensor<Self>; 7]) -> (FloatTensor<Self>, CubeRasterKept) {
        let sizes = sizes(view, &inputs);
        let is_drawn = sizes.gaussians > 0 && sizes.tiles() > 0;
        let radii = if is_drawn { empty } else { zeros }(&inputs[0], [sizes.gaussians], DType::I32);
        let (packed, sh) = (packed(view, &inputs), contiguous(inputs[4].clone()));
        let mut kept = CubeRasterKept { sizes, packed, sh, radii, drawn: None };
        if is_drawn {
            let (projected, counts) = projected(&kept, view.active_degree);
            let lists = lists(&projected, &counts, &sizes);
            kept.drawn = Some(blended(&kept, projected, lists));
        }
        let image = kept.drawn.as_ref().map(|drawn| drawn.image.clone());
        (image.unwrap_or_else(|| empty_image(view, &kept.packed)), kept)
    }

    fn vjp(view: &ViewSpec, kept: CubeRasterKept, v_packed: FloatTensor<Self>) -> [FloatTensor<Self>; 7] {
        pulled_back(&kept, view.active_degree, v_packed)
    }
}

impl RasterKernels for CubeBackend {
    fn radii(kept: &CubeRasterKept) -> IntTensor<Self> {
        kept.radii.clone()
    }
}

impl RasterOps for CubeBackend {
    fn rasterize(splats: SplatPrimitives<Self>, view: ViewSpec) -> Drawn<Self> {
        let (packed, kept) = forward_kept::<Self, _, _>(&view, splats.into_array());
        Drawn { packed, radii: Self::radii(&kept) }
    }
}
