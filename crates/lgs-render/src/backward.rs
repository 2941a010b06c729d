//! The driver of the backward pass: blending of every tile back to front, sums over tiles, and back through the projection.

use crate::blend_vjp::{BlendVjp, TileCotangent};
use crate::project_vjp::{ImageCotangent, project_vjp};
use crate::rasterize::{CHUNK, Rasterized};
use crate::simd::BLOCK;
use crate::splats::{SplatGradients, Splats};
use crate::tile_list::{Plane, TileList};
use crate::tiles::{TILE, split_lengths};
use crate::view::View;
use lgs_core::Camera;
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

/// Pulls cotangents of image and transmittance back to the parameters of the Gaussians.
///
/// `splats`, `camera` and `background` must be those of the forward pass.
///
/// # Panics
/// If a cotangent has another length than the image has pixels.
#[must_use]
pub fn rasterize_vjp(
    splats: &Splats,
    camera: &Camera,
    background: [f32; 3],
    forward: &Rasterized,
    v_image: &[[f32; 3]],
    v_transmittance: &[f32],
) -> SplatGradients {
    assert_eq!(v_image.len(), forward.image.len(), "pixels of the image's cotangent");
    assert_eq!(v_transmittance.len(), forward.image.len(), "pixels of the transmittance's cotangent");
    let v = PixelCotangents { background, v_image, v_transmittance };
    let entries = blend_vjp(forward, &v);
    pull_back(splats, &View::from(camera), forward, &entries)
}

/// What the caller sends back.
struct PixelCotangents<'a> {
    background: [f32; 3],
    v_image: &'a [[f32; 3]],
    v_transmittance: &'a [f32],
}

/// Cotangents of the entries of all tile lists.
fn blend_vjp(forward: &Rasterized, v: &PixelCotangents) -> Vec<ImageCotangent> {
    let (arch, tiling) = (Arch::new(), &forward.tiling);
    let mut entries = vec![ImageCotangent::default(); tiling.members.len()];
    let lengths = tiling.starts.windows(2).map(|pair| (pair[1] - pair[0]) as usize);
    let parts = split_lengths(&mut entries, lengths);
    parts.into_par_iter().enumerate().with_max_len(1).for_each(|(tile, out)| {
        let list = forward.tile_list(tile);
        let v = v.of_tile(&list, &forward.tiles[tile].transmittance, forward.width as usize);
        arch.dispatch(BlendVjp { list, state: &forward.tiles[tile], v, out });
    });
    entries
}

impl PixelCotangents<'_> {
    fn of_tile(&self, list: &TileList, transmittance: &Plane, width: usize) -> TileCotangent {
        let mut v = TileCotangent { color: [Plane::ZERO; 3], remainder: Plane::ZERO };
        for y in 0..list.size[1] {
            let start = (list.origin[1] + y) * width + list.origin[0];
            for x in 0..list.size[0] {
                let (at, pixel) = (y * TILE + x, self.v_image[start + x]);
                let mut v_t = self.v_transmittance[start + x];
                for ((plane, background), value) in v.color.iter_mut().zip(self.background).zip(pixel) {
                    plane.0[at] = value;
                    v_t += background * value;
                }
                v.remainder.0[at] = v_t * transmittance.0[at];
            }
        }
        v
    }
}

/// The last step: from sums over pixels to parameters.
fn pull_back(splats: &Splats, view: &View, forward: &Rasterized, entries: &[ImageCotangent]) -> SplatGradients {
    let (arch, n, stride) = (Arch::new(), splats.len(), 3 * splats.sh_coefficients);
    let mut ranks = vec![u32::MAX; n];
    for (rank, &index) in (0..).zip(&forward.tiling.order) {
        ranks[index as usize] = rank;
    }
    let mut out = SplatGradients {
        means: vec![[0.0; 3]; n],
        rotations: vec![[0.0; 4]; n],
        log_scales: vec![[0.0; 3]; n],
        raw_opacities: vec![0.0; n],
        sh: vec![0.0; splats.sh.len()],
        means2d: vec![[0.0; 2]; n],
    };
    let shape = out.means.par_chunks_mut(CHUNK).zip(out.rotations.par_chunks_mut(CHUNK)).zip(out.log_scales.par_chunks_mut(CHUNK));
    let shade = out.raw_opacities.par_chunks_mut(CHUNK).zip(out.sh.par_chunks_mut(CHUNK * stride)).zip(out.means2d.par_chunks_mut(CHUNK));
    shape.zip(shade).enumerate().for_each(|(chunk, (((means, rotations), log_scales), ((raw_opacities, sh), means2d)))| {
        let first = chunk * CHUNK;
        let out = ChunkGradients { means, rotations, log_scales, raw_opacities, sh, means2d };
        arch.dispatch(PullBackChunk { splats, view, forward, entries, ranks: &ranks[first..], first, out });
    });
    out
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

struct PullBackChunk<'a> {
    splats: &'a Splats<'a>,
    view: &'a View,
    forward: &'a Rasterized,
    entries: &'a [ImageCotangent],
    /// Places in the depth order, from the chunk's first Gaussian on.
    ranks: &'a [u32],
    first: usize,
    out: ChunkGradients<'a>,
}

impl WithSimd for PullBackChunk<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { splats, view, forward, entries, ranks, first, out } = self;
        let stride = 3 * splats.sh_coefficients;
        let mut sums = [ImageCotangent::default(); BLOCK];
        for block in (0..out.means.len()).step_by(BLOCK) {
            let count = BLOCK.min(out.means.len() - block);
            // All sums first, so that their cache misses overlap.
            for (sum, &rank) in sums.iter_mut().zip(&ranks[block..block + count]) {
                *sum = ImageCotangent::default();
                if rank != u32::MAX {
                    forward.tiling.entries(rank as usize).iter().for_each(|&slot| sum.accumulate(&entries[slot as usize]));
                }
            }
            for i in (block..block + count).filter(|&i| ranks[i] != u32::MAX) {
                let v_sh = &mut out.sh[i * stride..(i + 1) * stride];
                let v = project_vjp(splats, view, (first + i, &forward.projected[first + i]), &sums[i - block], v_sh);
                out.means[i] = v.mean;
                out.rotations[i] = v.rotation;
                out.log_scales[i] = v.log_scale;
                out.raw_opacities[i] = v.raw_opacity;
                out.means2d[i] = v.mean2d;
            }
        }
    }
}
