//! The drivers: project → tile → blend, and back. They own parallelism and memory; the stages are pure functions.
//!
//! Deterministic for any number of threads: every parallel task writes its own output, and sums run over tiles within a band, then over
//! the bands of a Gaussian, in order.

use crate::blend::{Blend, BlendVjp, Plane, TileCotangent, TileList, TileState};
use crate::project::{ImageCotangent, Projected, View, pixel, project, project_vjp, radius};
use crate::splats::{SplatGradients, Splats};
use crate::tiles::{TILE, Tiling, tile};
use lgs_core::{Camera, Image};
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

/// Gaussians handed to a thread at a time.
const CHUNK: usize = 256;

/// A rendered image, and what the backward pass needs of the forward one.
#[derive(Clone, Debug)]
pub struct Rasterized {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Colour over the background, row by row; not clamped.
    pub image: Vec<[f32; 3]>,
    /// What is left of the background in each pixel, in [0, 1].
    pub transmittance: Vec<f32>,
    /// Projected centres, pixels; zero for Gaussians behind the near plane.
    pub means2d: Vec<[f32; 2]>,
    /// Three standard deviations, rounded up to pixels; 0 for a Gaussian that cannot touch the image.
    pub radii: Vec<u32>,
    projected: Vec<Projected>,
    tiling: Tiling,
    tiles: Vec<TileState>,
}

impl Rasterized {
    /// Whether a Gaussian reaches some pixel with an alpha of at least 1/255, occlusion aside.
    #[must_use]
    pub fn is_visible(&self, index: usize) -> bool {
        self.radii[index] > 0
    }

    /// A copy of the colours as an image.
    #[must_use]
    pub fn to_image(&self) -> Image {
        Image { width: self.width, height: self.height, pixels: self.image.clone() }
    }

    /// Expected depth `Σ α T z` of each pixel, world units, not divided by the accumulated opacity.
    #[must_use]
    pub fn expected_depth(&self) -> Vec<f32> {
        let arch = Arch::new();
        let mut depth = vec![0.0; self.image.len()];
        split_by_tile(&mut depth, self.size()).into_par_iter().enumerate().for_each(|(tile, rows)| {
            let list = tile_list(&self.projected, &self.tiling, self.size(), tile);
            let blended = arch.dispatch(Blend { list, channels: |g: &Projected| [g.depth, 0.0, 0.0] });
            for (y, row) in rows.into_iter().enumerate() {
                row.copy_from_slice(&blended.color[0].row(y)[..row.len()]);
            }
        });
        depth
    }

    fn size(&self) -> [usize; 2] {
        [self.width as usize, self.height as usize]
    }
}

/// Draws Gaussians over a background.
///
/// # Panics
/// If the arrays of `splats` have unequal lengths, or the active degree asks for more coefficients than are stored.
#[must_use]
pub fn rasterize(splats: &Splats, camera: &Camera, background: [f32; 3]) -> Rasterized {
    splats.assert_consistent();
    let (view, size) = (View::from(camera), [camera.width as usize, camera.height as usize]);
    let n = splats.len();
    let projected = project_all(splats, &view);
    let tiling = tile(&projected, size[0], size[1]);
    let (image, transmittance, tiles) = blend_image(&projected, &tiling, size, background);
    let means2d = (0..n).into_par_iter().with_min_len(CHUNK).map(|i| match &projected[i] {
        g if g.reach > 0.0 => g.mean,
        _ => pixel(splats, &view, i),
    });
    let radii = projected.par_iter().zip(&tiling.entries).with_min_len(CHUNK).map(|(g, e)| if e.count > 0 { radius(g).max(1) } else { 0 });
    Rasterized {
        width: camera.width,
        height: camera.height,
        image,
        transmittance,
        means2d: means2d.collect(),
        radii: radii.collect(),
        projected,
        tiling,
        tiles,
    }
}

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
    let bands = blend_vjp(forward, background, v_image, v_transmittance);
    pull_back(splats, &View::from(camera), forward, &bands)
}

/// Projects every Gaussian; what is invisible is zero.
fn project_all(splats: &Splats, view: &View) -> Vec<Projected> {
    let arch = Arch::new();
    let mut projected = vec![Projected::default(); splats.len()];
    projected
        .par_chunks_mut(CHUNK)
        .enumerate()
        .for_each(|(chunk, out)| arch.dispatch(ProjectChunk { splats, view, first: chunk * CHUNK, out }));
    projected
}

/// Some Gaussians to project. A struct rather than a closure, so that the body is compiled with the processor's features.
struct ProjectChunk<'a> {
    splats: &'a Splats<'a>,
    view: &'a View,
    first: usize,
    out: &'a mut [Projected],
}

impl WithSimd for ProjectChunk<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        for (i, out) in self.out.iter_mut().enumerate() {
            *out = project(self.splats, self.view, self.first + i).unwrap_or_default();
        }
    }
}

/// The last step of the backward pass: from sums over pixels to parameters.
fn pull_back(splats: &Splats, view: &View, forward: &Rasterized, bands: &[Vec<ImageCotangent>]) -> SplatGradients {
    let (arch, n, stride) = (Arch::new(), splats.len(), 3 * splats.sh_coefficients);
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
        arch.dispatch(PullBackChunk {
            splats,
            view,
            forward,
            bands,
            first: chunk * CHUNK,
            out: ChunkGradients { means, rotations, log_scales, raw_opacities, sh, means2d },
        });
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
    bands: &'a [Vec<ImageCotangent>],
    first: usize,
    out: ChunkGradients<'a>,
}

impl WithSimd for PullBackChunk<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let (out, stride) = (self.out, 3 * self.splats.sh_coefficients);
        for i in 0..out.means.len() {
            let index = self.first + i;
            let Some(v) = gather(&self.forward.tiling, self.bands, index) else { continue };
            let v_sh = &mut out.sh[i * stride..(i + 1) * stride];
            let v = project_vjp(self.splats, self.view, (index, &self.forward.projected[index]), &v, v_sh);
            out.means[i] = v.mean;
            out.rotations[i] = v.rotation;
            out.log_scales[i] = v.log_scale;
            out.raw_opacities[i] = v.raw_opacity;
            out.means2d[i] = v.mean2d;
        }
    }
}

fn tile_list<'a>(projected: &'a [Projected], tiling: &'a Tiling, [width, height]: [usize; 2], tile: usize) -> TileList<'a> {
    let (row, column) = (tile / tiling.columns, tile % tiling.columns);
    let band = &tiling.bands[row];
    let origin = [column * TILE, row * TILE];
    TileList {
        projected,
        items: &band.items,
        members: band.tile(column),
        origin,
        size: [TILE.min(width - origin[0]), TILE.min(height - origin[1])],
    }
}

/// Blends every tile, each into its own part of the image.
fn blend_image(
    projected: &[Projected],
    tiling: &Tiling,
    size: [usize; 2],
    background: [f32; 3],
) -> (Vec<[f32; 3]>, Vec<f32>, Vec<TileState>) {
    let (arch, pixels) = (Arch::new(), size[0] * size[1]);
    let (mut image, mut transmittance) = (vec![[0.0; 3]; pixels], vec![0.0; pixels]);
    let tiles = split_by_tile(&mut image, size)
        .into_par_iter()
        .zip(split_by_tile(&mut transmittance, size))
        .enumerate()
        .with_max_len(1)
        .map(|(tile, (image, transmittance))| {
            let blended = arch.dispatch(Blend { list: tile_list(projected, tiling, size, tile), channels: |g: &Projected| g.color });
            for (y, (image, transmittance)) in image.into_iter().zip(transmittance).enumerate() {
                blended.write_row(y, background, image, transmittance);
            }
            blended.state
        })
        .collect();
    (image, transmittance, tiles)
}

/// The rows of every tile, tile by tile.
fn split_by_tile<T>(image: &mut [T], [width, height]: [usize; 2]) -> Vec<Vec<&mut [T]>> {
    let columns = width.div_ceil(TILE);
    let mut tiles: Vec<Vec<&mut [T]>> = (0..columns * height.div_ceil(TILE)).map(|_| Vec::with_capacity(TILE)).collect();
    for (y, row) in image.chunks_mut(width.max(1)).enumerate() {
        for (column, part) in row.chunks_mut(TILE).enumerate() {
            tiles[(y / TILE) * columns + column].push(part);
        }
    }
    tiles
}

/// Cotangents of each band's items.
fn blend_vjp(forward: &Rasterized, background: [f32; 3], v_image: &[[f32; 3]], v_transmittance: &[f32]) -> Vec<Vec<ImageCotangent>> {
    let (arch, size, columns) = (Arch::new(), forward.size(), forward.tiling.columns);
    let by_tile: Vec<Vec<ImageCotangent>> = (0..forward.tiles.len())
        .into_par_iter()
        .with_max_len(1)
        .map(|tile| {
            let (list, state) = (tile_list(&forward.projected, &forward.tiling, size, tile), &forward.tiles[tile]);
            let v = tile_cotangent(&list, state, size[0], background, v_image, v_transmittance);
            arch.dispatch(BlendVjp { list, state, v })
        })
        .collect();
    let sum_band = |(row, tiles): (usize, &[Vec<ImageCotangent>])| {
        let band = &forward.tiling.bands[row];
        let mut sums = vec![ImageCotangent::default(); band.items.len()];
        for (column, entries) in tiles.iter().enumerate() {
            for (&position, entry) in band.tile(column).iter().zip(entries) {
                sums[position as usize].accumulate(entry);
            }
        }
        sums
    };
    by_tile.par_chunks(columns.max(1)).enumerate().map(sum_band).collect()
}

fn tile_cotangent(
    list: &TileList,
    state: &TileState,
    width: usize,
    background: [f32; 3],
    v_image: &[[f32; 3]],
    v_transmittance: &[f32],
) -> TileCotangent {
    let mut v = TileCotangent { color: [Plane::ZERO; 3], remainder: Plane::ZERO };
    for y in 0..list.size[1] {
        let start = (list.origin[1] + y) * width + list.origin[0];
        for x in 0..list.size[0] {
            let (at, pixel) = (y * TILE + x, v_image[start + x]);
            let mut v_t = v_transmittance[start + x];
            for channel in 0..3 {
                v.color[channel].0[at] = pixel[channel];
                v_t += background[channel] * pixel[channel];
            }
            v.remainder.0[at] = v_t * state.transmittance.0[at].abs();
        }
    }
    v
}

/// Sum over the bands of a Gaussian; `None` if it was not drawn.
#[inline(always)]
fn gather(tiling: &Tiling, bands: &[Vec<ImageCotangent>], index: usize) -> Option<ImageCotangent> {
    let entries = tiling.entries[index];
    if entries.count == 0 {
        return None;
    }
    let mut sum = ImageCotangent::default();
    for e in 0..usize::from(entries.count) {
        let position = tiling.positions[entries.first as usize + e];
        sum.accumulate(&bands[usize::from(entries.band) + e][position as usize]);
    }
    Some(sum)
}
