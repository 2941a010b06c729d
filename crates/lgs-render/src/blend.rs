//! Front-to-back blending of one tile: the hot loop of the renderer.
//!
//! For each Gaussian, nearest first, the rows it reaches are visited as vectors of pixels. A pixel is closed,
//! by raising the alpha it asks for to infinity, when a Gaussian would bring its transmittance below the
//! threshold; the position of that Gaussian is kept, so that the backward pass makes exactly the decisions of
//! the forward pass. Rows, and then the tile, are left when all their pixels are closed.

use crate::exponential::exp2;
use crate::projected::{ALPHA_MAX, ALPHA_MIN, Projected, TRANSMITTANCE_STOP};
use crate::simd::{fma, none};
use crate::tile_list::{BATCH, Batch, Heights, Plane, Splat, TileList, offset_x, take_row};
use crate::tiles::TILE;
use pulp::{Simd, WithSimd};

/// State of the forward pass that the backward pass needs, per pixel of a tile.
#[derive(Clone, Debug)]
pub(crate) struct TileState {
    /// Final transmittance.
    pub transmittance: Plane,
    /// Position in the list of the Gaussian that closed the pixel, infinite if none did; -1 outside of the
    /// image.
    pub stop: Plane,
    /// Length of the part of the list that was looked at.
    pub processed: usize,
}

impl TileState {
    /// A bit for each row that has pixels which no Gaussian before this position closed.
    fn open_rows(&self, position: usize) -> u32 {
        let is_open = |row: &usize| self.stop.row(*row).iter().any(|&stop| stop >= position as f32);
        (0..TILE).filter(is_open).map(|row| 1 << row).sum()
    }
}

/// A blended tile.
pub(crate) struct TileImage {
    /// Colour without background, one plane per channel.
    pub color: [Plane; 3],
    pub state: TileState,
}

impl TileImage {
    fn empty(width: usize) -> Self {
        let mut stop = Plane::ZERO;
        for row in stop.0.as_chunks_mut::<TILE>().0 {
            row[..width].fill(f32::INFINITY);
            row[width..].fill(-1.0);
        }
        let state = TileState { transmittance: Plane([1.0; TILE * TILE]), stop, processed: 0 };
        Self { color: [Plane::ZERO; 3], state }
    }

    /// Composites a row over the background.
    pub(crate) fn write_row(
        &self,
        y: usize,
        background: [f32; 3],
        image: &mut [[f32; 3]],
        transmittance: &mut [f32],
    ) {
        let [red, green, blue] = [self.color[0].row(y), self.color[1].row(y), self.color[2].row(y)];
        let left = self.state.transmittance.row(y);
        for (x, (pixel, out)) in image.iter_mut().zip(transmittance).enumerate().take(TILE) {
            let t = left[x];
            *out = t;
            *pixel = [red[x] + t * background[0], green[x] + t * background[1], blue[x] + t * background[2]];
        }
    }
}

/// Blends a tile. `channels` picks the three values to be blended, usually the colour.
pub(crate) struct Blend<'a, F> {
    pub list: TileList<'a>,
    pub channels: F,
}

impl<F: Fn(&Projected) -> [f32; 3]> WithSimd for Blend<'_, F> {
    type Output = TileImage;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> TileImage {
        let mut image = TileImage::empty(self.list.size[0]);
        let mut limit = limits(self.list.size[0]);
        let mut batch = Batch::new();
        let [red, green, blue] = &mut image.color;
        let state = &mut image.state;
        let mut pixels = Pixels::<S> {
            color: [red.vectors::<S>(), green.vectors::<S>(), blue.vectors::<S>()],
            transmittance: state.transmittance.vectors::<S>(),
            stop: state.stop.vectors::<S>(),
            limit: limit.vectors::<S>(),
            open_rows: (1 << self.list.size[1]) - 1,
        };
        for first in (0..self.list.members.len()).step_by(BATCH) {
            for j in 0..batch.load(simd, &self.list, first, &self.channels) {
                state.processed = first + j + 1;
                let g = batch.get(j);
                pixels.add(simd, &g, (first + j) as f32);
            }
            if pixels.open_rows == 0 {
                break;
            }
        }
        image
    }
}

/// Counts the pixels of the rows that [`Blend`] visited, over all Gaussians of a tile.
pub(crate) struct CountPairs<'a> {
    pub list: TileList<'a>,
    pub state: &'a TileState,
}

impl WithSimd for CountPairs<'_> {
    type Output = u64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> u64 {
        let (mut batch, mut rows) = (Batch::new(), 0);
        for first in (0..self.state.processed).step_by(BATCH) {
            batch.load(simd, &self.list, first, &|g| g.color);
            for position in first..self.state.processed.min(first + BATCH) {
                rows += u64::from(
                    (batch.get(position - first).rows & self.state.open_rows(position)).count_ones(),
                );
            }
        }
        rows * self.list.size[0] as u64
    }
}

/// The base-2 logarithm of the least alpha each pixel accepts.
fn limits(width: usize) -> Plane {
    let mut limit = Plane([ALPHA_MIN.log2(); TILE * TILE]);
    for row in limit.0.as_chunks_mut::<TILE>().0 {
        row[width..].fill(f32::INFINITY);
    }
    limit
}

/// The pixels of a tile while it is blended.
struct Pixels<'a, S: Simd> {
    color: [&'a mut [S::f32s]; 3],
    transmittance: &'a mut [S::f32s],
    stop: &'a mut [S::f32s],
    limit: &'a mut [S::f32s],
    /// A bit per row with pixels that still accept light.
    open_rows: u32,
}

impl<S: Simd> Pixels<'_, S> {
    /// Blends a Gaussian behind what is there.
    #[inline(always)]
    fn add(&mut self, simd: S, g: &Splat, position: f32) {
        if g.rows & self.open_rows == 0 {
            return;
        }
        let per_row = TILE / S::F32_LANES;
        let heights = Heights::new(simd, g);
        let channels =
            [simd.splat_f32s(g.channels[0]), simd.splat_f32s(g.channels[1]), simd.splat_f32s(g.channels[2])];
        for column in 0..per_row {
            let along = simd.mul_f32s(simd.splat_f32s(g.factor[0]), offset_x(simd, g, column));
            let mut rows = g.rows & self.open_rows;
            while rows != 0 {
                let row = take_row(&mut rows);
                let at = row * per_row + column;
                let log2_alpha = heights.log2_alpha(simd, along, row);
                let seen = simd.greater_than_or_equal_f32s(log2_alpha, self.limit[at]);
                let before = self.transmittance[at];
                let weight =
                    simd.mul_f32s(simd.min_f32s(exp2(simd, log2_alpha), simd.splat_f32s(ALPHA_MAX)), before);
                let after = simd.sub_f32s(before, weight);
                let dark = simd.less_than_f32s(after, simd.splat_f32s(TRANSMITTANCE_STOP));
                let hit = simd.and_m32s(seen, simd.not_m32s(dark));
                let weight = simd.select_f32s(hit, weight, simd.splat_f32s(0.0));
                for (plane, &channel) in self.color.iter_mut().zip(&channels) {
                    plane[at] = fma(simd, weight, channel, plane[at]);
                }
                self.transmittance[at] = simd.select_f32s(hit, after, before);
                let closing = simd.and_m32s(seen, dark);
                if !none(simd, closing) {
                    self.close(simd, closing, position, at);
                }
            }
        }
    }

    #[inline(always)]
    fn close(&mut self, simd: S, pixels: S::m32s, position: f32, at: usize) {
        let infinity = simd.splat_f32s(f32::INFINITY);
        self.stop[at] = simd.select_f32s(pixels, simd.splat_f32s(position), self.stop[at]);
        self.limit[at] = simd.select_f32s(pixels, infinity, self.limit[at]);
        let per_row = TILE / S::F32_LANES;
        let row = at / per_row;
        let mut open = false;
        for &limit in &self.limit[row * per_row..(row + 1) * per_row] {
            open |= !none(simd, simd.less_than_f32s(limit, infinity));
        }
        self.open_rows &= !(u32::from(!open) << row);
    }
}
