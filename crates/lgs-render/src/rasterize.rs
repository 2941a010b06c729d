//! The driver of the forward pass: project → tile → blend. It owns parallelism and memory; the stages are
//! pure functions.
//!
//! Deterministic for any number of threads: every parallel task writes its own output, and sums run in a
//! fixed order.

use crate::blend::{Blend, CountPairs, TileState};
use crate::extent::pixel_box;
use crate::image_part::ImagePart;
use crate::project::ProjectChunk;
use crate::projected::Projected;
use crate::splats::Splats;
use crate::tile_list::TileList;
use crate::tiles::{TILE, Tiling};
use crate::view::View;
use lgs_core::{Camera, Image};
use pulp::Arch;
use rayon::prelude::*;
use std::ops::Range;

/// Gaussians handed to a thread at a time.
pub(crate) const CHUNK: usize = 256;

/// A rendered image, and what the backward pass needs of the forward one.
#[derive(Debug, Default)]
pub struct Rasterized {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Colour over the background, row by row; not clamped.
    pub image: Vec<[f32; 3]>,
    /// Transmittance left for the background in each pixel, in [0, 1].
    pub transmittance: Vec<f32>,
    /// Projected centres, pixels; zero for Gaussians behind the near plane.
    pub means2d: Vec<[f32; 2]>,
    /// Three standard deviations, rounded up to pixels; 0 for a Gaussian that cannot touch the image.
    pub radii: Vec<u32>,
    pub(crate) background: [f32; 3],
    pub(crate) projected: Vec<Projected>,
    pub(crate) tiling: Tiling,
    pub(crate) tiles: Vec<TileState>,
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

    /// Pairs of pixel and Gaussian of the scene: for each pixel the Gaussians whose ellipse of alpha 1/255
    /// reaches its tile of 16×16 pixels, up to the one that stops the pixel. A rasterizer by tiles without
    /// further tests evaluates all of them.
    #[must_use]
    pub fn listed_pairs(&self) -> u64 {
        let of_tile = |(tile, state): (usize, &TileState)| {
            let list = self.tile_list(tile);
            let length = list.members.len() as f32;
            let rows = (0..list.size[1]).map(|y| {
                state.stop.row(y)[..list.size[0]]
                    .iter()
                    .map(|stop| (stop + 1.0).min(length) as u64)
                    .sum::<u64>()
            });
            rows.sum::<u64>()
        };
        self.tiles.par_iter().enumerate().map(of_tile).sum()
    }

    /// Pairs of pixel and Gaussian whose alpha the forward pass evaluates: of every tile that a Gaussian's
    /// ellipse of alpha 1/255 reaches, the rows of pixels that it reaches and that still accept light.
    #[must_use]
    pub fn evaluated_pairs(&self) -> u64 {
        let arch = Arch::new();
        let of_tile = |(tile, state)| arch.dispatch(CountPairs { list: self.tile_list(tile), state });
        self.tiles.par_iter().enumerate().map(of_tile).sum()
    }

    /// The least rectangle around the pixels that some Gaussians reach with an alpha of at least 1/255,
    /// occlusion aside; empty if they reach none.
    ///
    /// # Panics
    /// If `members` are not all among the Gaussians.
    #[must_use]
    pub fn part_reached_by(&self, members: Range<usize>) -> ImagePart {
        members.map(|index| self.box_of(index)).fold(ImagePart::default(), ImagePart::around)
    }

    /// The Gaussians that reach some pixel of a part, by the boxes around their ellipses; ascending.
    #[must_use]
    pub fn gaussians_in(&self, part: &ImagePart) -> Vec<usize> {
        (0..self.radii.len()).filter(|&index| self.box_of(index).meets(part)).collect()
    }

    fn box_of(&self, index: usize) -> ImagePart {
        let size = [self.width as usize, self.height as usize];
        let reached = self.is_visible(index).then(|| pixel_box(&self.projected[index], size)).flatten();
        reached.map_or_else(ImagePart::default, |[columns, rows]| ImagePart {
            columns: columns.0..columns.1 + 1,
            rows: rows.0..rows.1 + 1,
        })
    }

    /// Replaces everything by what [`rasterize`] gives; allocates only what has to grow.
    ///
    /// # Panics
    /// If the arrays of `splats` have unequal lengths, or the active degree asks for more coefficients than
    /// are stored.
    pub fn update(&mut self, splats: &Splats, camera: &Camera, background: [f32; 3]) {
        self.draw(splats, &View::from(camera), background);
    }

    /// Replaces everything by what a view shows.
    pub(crate) fn draw(&mut self, splats: &Splats, view: &View, background: [f32; 3]) {
        splats.assert_consistent();
        [self.width, self.height] = view.size.map(|edge| edge as u32);
        self.project(splats, view);
        self.tiling.update(&self.projected, view.size);
        self.background = background;
        self.blend();
    }

    /// Projects every Gaussian.
    fn project(&mut self, splats: &Splats, view: &View) {
        let Self { projected, means2d, radii, .. } = self;
        projected.resize(splats.len(), Projected::default());
        means2d.resize(splats.len(), [0.0; 2]);
        radii.resize(splats.len(), 0);
        let arch = Arch::new();
        let chunks = projected
            .par_chunks_mut(CHUNK)
            .zip(means2d.par_chunks_mut(CHUNK))
            .zip(radii.par_chunks_mut(CHUNK))
            .enumerate();
        chunks.for_each(|(chunk, ((out, means2d), radii))| {
            arch.dispatch(ProjectChunk { splats, view, first: chunk * CHUNK, out, means2d, radii });
        });
    }

    /// Blends every tile, each into its own part of the image.
    fn blend(&mut self) {
        let (arch, size, background) = (Arch::new(), self.size(), self.background);
        let Self { image, transmittance, projected, tiling, tiles, .. } = self;
        image.resize(size[0] * size[1], [0.0; 3]);
        transmittance.resize(size[0] * size[1], 0.0);
        split_by_tile(image, size)
            .into_par_iter()
            .zip(split_by_tile(transmittance, size))
            .enumerate()
            .with_max_len(1)
            .map(|(tile, (image, transmittance))| {
                let blended = arch.dispatch(Blend {
                    list: tile_list(projected, tiling, size, tile),
                    channels: |g: &Projected| g.color,
                });
                for (y, (image, transmittance)) in image.into_iter().zip(transmittance).enumerate() {
                    blended.write_row(y, background, image, transmittance);
                }
                blended.state
            })
            .collect_into_vec(tiles);
    }

    pub(crate) fn tile_list(&self, tile: usize) -> TileList<'_> {
        tile_list(&self.projected, &self.tiling, self.size(), tile)
    }

    fn size(&self) -> [usize; 2] {
        [self.width as usize, self.height as usize]
    }
}

/// Draws Gaussians over a background. [`Rasterized::update`] does the same in arrays that are there.
///
/// # Panics
/// If the arrays of `splats` have unequal lengths, or the active degree asks for more coefficients than are
/// stored.
#[must_use]
pub fn rasterize(splats: &Splats, camera: &Camera, background: [f32; 3]) -> Rasterized {
    let mut out = Rasterized::default();
    out.update(splats, camera, background);
    out
}

/// Draws a part of an image: what [`rasterize`] draws there, up to rounding, in an image of the part's
/// size.
///
/// # Panics
/// As [`rasterize`].
#[must_use]
pub fn rasterize_part(
    splats: &Splats,
    camera: &Camera,
    background: [f32; 3],
    part: &ImagePart,
) -> Rasterized {
    let mut out = Rasterized::default();
    if part.pixels() > 0 {
        out.draw(splats, &View::from(camera).of_part(part), background);
    }
    out
}

fn tile_list<'a>(
    projected: &'a [Projected],
    tiling: &'a Tiling,
    [width, height]: [usize; 2],
    tile: usize,
) -> TileList<'a> {
    let origin = [tile % tiling.columns * TILE, tile / tiling.columns * TILE];
    let size = [TILE.min(width - origin[0]), TILE.min(height - origin[1])];
    TileList { projected, members: tiling.tile(tile), origin, size }
}

/// The rows of every tile, tile by tile.
fn split_by_tile<T>(image: &mut [T], [width, height]: [usize; 2]) -> Vec<Vec<&mut [T]>> {
    let columns = width.div_ceil(TILE);
    let mut tiles: Vec<Vec<&mut [T]>> =
        (0..columns * height.div_ceil(TILE)).map(|_| Vec::with_capacity(TILE)).collect();
    for (y, row) in image.chunks_mut(width.max(1)).enumerate() {
        for (column, part) in row.chunks_mut(TILE).enumerate() {
            tiles[(y / TILE) * columns + column].push(part);
        }
    }
    tiles
}
