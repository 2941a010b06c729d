//! The driver of the backward pass: blending of every tile back to front, sums over tiles, and back through
//! the projection.

use crate::blend_vjp::{BlendVjp, TileCotangent};
use crate::project_vjp::{CotangentCell, ImageCotangent, ParameterCotangent, project_vjp};
use crate::rasterize::{CHUNK, Rasterized};
use crate::splats::{SplatGradients, Splats};
use crate::tile_list::{Plane, TileList};
use crate::tiles::TILE;
use crate::view::View;
use lgs_core::Camera;
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

/// Cotangents of a rendered image.
#[derive(Clone, Copy, Debug)]
pub struct ImageCotangents<'a> {
    /// Cotangents of the colours, row by row.
    pub image: &'a [[f32; 3]],
    /// Cotangents of the transmittance of each pixel.
    pub transmittance: &'a [f32],
}

/// Pulls cotangents of image and transmittance back to the parameters of the Gaussians.
///
/// `splats` and `camera` must be those of the forward pass. [`RasterizedVjp::update`] does the same in arrays
/// that are there.
///
/// # Panics
/// If a cotangent has another length than the image has pixels.
#[must_use]
pub fn rasterize_vjp(
    splats: &Splats,
    camera: &Camera,
    forward: &Rasterized,
    v: ImageCotangents<'_>,
) -> SplatGradients {
    let mut out = RasterizedVjp::default();
    out.update(splats, camera, forward, v);
    out.gradients
}

/// The gradients of a backward pass, and the arrays it worked in, for the next one.
#[derive(Debug, Default)]
pub struct RasterizedVjp {
    /// Cotangents of every input.
    pub gradients: SplatGradients,
    /// Cotangents of the entries of all tile lists, by number.
    entries: Vec<CotangentCell>,
    /// Cotangents of the pose, chunk by chunk.
    poses: Vec<[f32; 6]>,
    /// Whether nobody asks for the cotangent of the pose.
    leaves_pose_out: bool,
}

impl RasterizedVjp {
    /// A backward pass without the cotangent of the pose, which is zero.
    #[must_use]
    pub fn without_pose() -> Self {
        Self { leaves_pose_out: true, ..Self::default() }
    }

    /// Replaces the gradients by those of [`rasterize_vjp`]; allocates only what has to grow.
    ///
    /// # Panics
    /// If a cotangent has another length than the image has pixels.
    pub fn update(&mut self, splats: &Splats, camera: &Camera, forward: &Rasterized, v: ImageCotangents<'_>) {
        assert_eq!(v.image.len(), forward.image.len(), "pixels of the image's cotangent");
        assert_eq!(v.transmittance.len(), forward.image.len(), "pixels of the transmittance's cotangent");
        self.entries.resize_with(forward.tiling.len(), CotangentCell::default);
        blend_vjp(forward, v, &self.entries);
        self.gradients.resize(splats);
        let (entries, gradients) = (&self.entries, &mut self.gradients);
        let view = View::from(camera);
        if self.leaves_pose_out {
            pull_back::<false>(splats, &view, (forward, entries), gradients, &mut self.poses);
        } else {
            pull_back::<true>(splats, &view, (forward, entries), gradients, &mut self.poses);
        }
        // In the order of chunks, whatever the number of threads.
        gradients.pose =
            std::array::from_fn(|i| self.poses.iter().map(|pose| f64::from(pose[i])).sum::<f64>() as f32);
    }
}

/// Fills the cotangents of the entries of all tile lists.
fn blend_vjp(forward: &Rasterized, v: ImageCotangents<'_>, out: &[CotangentCell]) {
    let arch = Arch::new();
    forward.tiles.par_iter().enumerate().with_max_len(1).for_each(|(tile, state)| {
        let list = forward.tile_list(tile);
        let v = v.of_tile(&list, &state.transmittance, forward);
        arch.dispatch(BlendVjp { list, state, v, out });
    });
}

impl ImageCotangents<'_> {
    fn of_tile(&self, list: &TileList, transmittance: &Plane, forward: &Rasterized) -> TileCotangent {
        let width = forward.width as usize;
        let mut v = TileCotangent { color: [Plane::ZERO; 3], remainder: Plane::ZERO };
        for y in 0..list.size[1] {
            let start = (list.origin[1] + y) * width + list.origin[0];
            for x in 0..list.size[0] {
                let (at, pixel) = (y * TILE + x, self.image[start + x]);
                let mut v_t = self.transmittance[start + x];
                for ((plane, background), value) in v.color.iter_mut().zip(forward.background).zip(pixel) {
                    plane.0[at] = value;
                    v_t += background * value;
                }
                v.remainder.0[at] = v_t * transmittance.0[at];
            }
        }
        v
    }
}

/// The last step: from sums over pixels to parameters. Every element of `out` is replaced but the pose, of
/// which `poses` holds a sum per chunk; zeros unless it is asked for.
fn pull_back<const POSE: bool>(
    splats: &Splats,
    view: &View,
    (forward, entries): (&Rasterized, &[CotangentCell]),
    out: &mut SplatGradients,
    poses: &mut Vec<[f32; 6]>,
) {
    let (arch, stride) = (Arch::new(), 3 * splats.sh_coefficients);
    let shape = out
        .means
        .par_chunks_mut(CHUNK)
        .zip(out.rotations.par_chunks_mut(CHUNK))
        .zip(out.log_scales.par_chunks_mut(CHUNK));
    let shade = out
        .raw_opacities
        .par_chunks_mut(CHUNK)
        .zip(out.sh.par_chunks_mut(CHUNK * stride))
        .zip(out.means2d.par_chunks_mut(CHUNK));
    let chunks = shape.zip(shade).enumerate().map(
        |(chunk, (((means, rotations), log_scales), ((raw_opacities, sh), means2d)))| {
            let out = ChunkGradients { means, rotations, log_scales, raw_opacities, sh, means2d };
            arch.dispatch(PullBackChunk::<POSE> { splats, view, forward, entries, first: chunk * CHUNK, out })
        },
    );
    chunks.collect_into_vec(poses);
}

/// The part of [`SplatGradients`] that belongs to a chunk.
struct ChunkGradients<'a> {
    means: &'a mut [[f32; 3]],
    rotations: &'a mut [[f32; 4]],
    log_scales: &'a mut [[f32; 3]],
    raw_opacities: &'a mut [f32],
    sh: &'a mut [f32],
    means2d: &'a mut [[f32; 2]],
}

struct PullBackChunk<'a, const POSE: bool> {
    splats: &'a Splats<'a>,
    view: &'a View,
    forward: &'a Rasterized,
    entries: &'a [CotangentCell],
    /// Index of the chunk's first Gaussian.
    first: usize,
    out: ChunkGradients<'a>,
}

impl<const POSE: bool> WithSimd for PullBackChunk<'_, POSE> {
    /// Cotangent of the pose.
    type Output = [f32; 6];

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> [f32; 6] {
        let Self { splats, view, forward, entries, first, out } = self;
        let (stride, mut pose) = (3 * splats.sh_coefficients, [0.0; 6]);
        for i in 0..out.means.len() {
            let v_sh = &mut out.sh[i * stride..(i + 1) * stride];
            v_sh.fill(0.0);
            let mut sum = ImageCotangent::default();
            let entries = &entries[forward.tiling.entries(first + i)];
            entries.iter().for_each(|entry| sum.accumulate(&entry.get()));
            let v = match entries {
                [] => ParameterCotangent::default(),
                _ => project_vjp(splats, view, (first + i, &forward.projected[first + i]), &sum, v_sh),
            };
            out.means[i] = v.mean;
            out.rotations[i] = v.rotation;
            out.log_scales[i] = v.log_scale;
            out.raw_opacities[i] = v.raw_opacity;
            out.means2d[i] = v.mean2d;
            // Without it the pose's cotangent is never read, and so not calculated.
            if POSE {
                pose.iter_mut().zip(v.pose).for_each(|(sum, v)| *sum += v);
            }
        }
        pose
    }
}
