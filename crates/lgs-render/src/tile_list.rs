//! The list of one tile, read in batches: what both directions of blending share.
//!
//! A tile is 16 rows of 16 pixels. With `u = f₀ d_x + f₁ d_y` and `w = f₂ d_y` (see `project`), `log2 α =
//! log2 o - w² - u²`; along a row only `f₀ d_x` varies between lanes. A batch is copied out of the scattered
//! Gaussians at once, so that the misses overlap, and the rows of the tile that each ellipse reaches are
//! found for a vector of Gaussians at a time.

use crate::extent::{MARGIN, SLACK};
use crate::projected::Projected;
use crate::simd::{BLOCK, Lanes, V, splat};
use crate::tiles::{Member, TILE};
use pulp::Simd;

/// Pixels of a tile.
const PIXELS: usize = TILE * TILE;
/// Gaussians of a batch.
pub(crate) const BATCH: usize = 64;

/// Offsets of the pixel centres of a row or a column of the tile.
const CENTRES: Lanes =
    Lanes([0.5, 1.5, 2.5, 3.5, 4.5, 5.5, 6.5, 7.5, 8.5, 9.5, 10.5, 11.5, 12.5, 13.5, 14.5, 15.5]);

/// A value per pixel of a tile, row by row.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(crate) struct Plane(pub [f32; PIXELS]);

impl Plane {
    pub(crate) const ZERO: Self = Self([0.0; PIXELS]);

    /// A row of the tile.
    pub(crate) fn row(&self, row: usize) -> &[f32; TILE] {
        &self.0.as_chunks::<TILE>().0[row]
    }

    /// The plane as vectors, `TILE / lanes` to a row.
    #[inline(always)]
    pub(crate) fn vectors<S: Simd>(&mut self) -> &mut [S::f32s] {
        S::as_mut_simd_f32s(&mut self.0).0
    }
}

/// The list of a tile: its Gaussians nearest first, and where it lies in the image.
#[derive(Clone, Copy)]
pub(crate) struct TileList<'a> {
    pub projected: &'a [Projected],
    pub members: &'a [Member],
    /// Top left corner, pixels.
    pub origin: [usize; 2],
    /// Columns and rows inside the image.
    pub size: [usize; 2],
}

/// Some consecutive Gaussians of a list, field by field, relative to the tile.
pub(crate) struct Batch {
    mean: [[Lanes; BATCH / BLOCK]; 2],
    factor: [[Lanes; BATCH / BLOCK]; 3],
    reach: [Lanes; BATCH / BLOCK],
    /// Half width, and that times `rightmost` over the half height.
    half_width: [Lanes; BATCH / BLOCK],
    lowest: [Lanes; BATCH / BLOCK],
    log2_opacity: [f32; BATCH],
    channels: [[f32; 3]; BATCH],
    /// A bit per row of the tile.
    rows: [u32; BATCH],
}

/// A Gaussian as blending sees it.
#[derive(Clone, Copy)]
pub(crate) struct Splat {
    pub mean: [f32; 2],
    pub factor: [f32; 3],
    pub log2_opacity: f32,
    pub channels: [f32; 3],
    /// A bit for each row of the tile that it reaches.
    pub rows: u32,
}

impl Batch {
    pub(crate) fn new() -> Self {
        let zero = [Lanes::ZERO; BATCH / BLOCK];
        Self {
            mean: [zero; 2],
            factor: [zero; 3],
            reach: zero,
            half_width: zero,
            lowest: zero,
            log2_opacity: [0.0; BATCH],
            channels: [[0.0; 3]; BATCH],
            rows: [0; BATCH],
        }
    }

    /// Reads the Gaussians from position `first` on, at most [`BATCH`]; `channels` picks the three values to
    /// be blended.
    #[inline(always)]
    pub(crate) fn load<S: Simd>(
        &mut self,
        simd: S,
        list: &TileList,
        first: usize,
        channels: &impl Fn(&Projected) -> [f32; 3],
    ) -> usize {
        let members = &list.members[first..list.members.len().min(first + BATCH)];
        let origin = [list.origin[0] as f32, list.origin[1] as f32];
        for (j, member) in members.iter().enumerate() {
            let g = &list.projected[member.gaussian as usize];
            let (block, lane) = (j / BLOCK, j % BLOCK);
            self.mean[0][block].0[lane] = g.mean[0] - origin[0];
            self.mean[1][block].0[lane] = g.mean[1] - origin[1];
            for i in 0..3 {
                self.factor[i][block].0[lane] = g.factor[i];
            }
            self.reach[block].0[lane] = g.reach;
            self.half_width[block].0[lane] = g.half[0];
            self.lowest[block].0[lane] = g.rightmost * g.half[0] / g.half[1];
            self.log2_opacity[j] = g.log2_opacity;
            self.channels[j] = channels(g);
        }
        for block in 0..members.len().div_ceil(BLOCK) {
            self.find_rows(simd, block, list.size);
        }
        members.len()
    }

    #[inline(always)]
    pub(crate) fn get(&self, j: usize) -> Splat {
        let (block, lane) = (j / BLOCK, j % BLOCK);
        Splat {
            mean: [self.mean[0][block].0[lane], self.mean[1][block].0[lane]],
            factor: [
                self.factor[0][block].0[lane],
                self.factor[1][block].0[lane],
                self.factor[2][block].0[lane],
            ],
            log2_opacity: self.log2_opacity[j],
            channels: self.channels[j],
            rows: self.rows[j],
        }
    }

    /// The rows that ellipses reach within the columns of the tile: `extent::pixel_columns` with the axes
    /// exchanged.
    #[inline(always)]
    fn find_rows<S: Simd>(&mut self, simd: S, block: usize, [width, height]: [usize; 2]) {
        let (mut first, mut last) = (Lanes::ZERO, Lanes::ZERO);
        for index in 0..BLOCK / S::F32_LANES {
            let mean = [self.mean[0][block].get(simd, index), self.mean[1][block].get(simd, index)];
            let [f0, f1, f2] = [
                self.factor[0][block].get(simd, index),
                self.factor[1][block].get(simd, index),
                self.factor[2][block].get(simd, index),
            ];
            let half = self.half_width[block].get(simd, index) + splat(simd, MARGIN);
            let low = (splat(simd, 0.5) - mean[0]).max(-half);
            let high = (splat(simd, width as f32 - 0.5) - mean[0]).min(half);
            let lowest = self.lowest[block].get(simd, index);
            let (d_bottom, d_top) = (lowest.max(low).min(high), (-lowest).max(low).min(high));
            let k = f1 * f1 + f2 * f2;
            let inverse = splat(simd, 1.0) / k;
            let (slope, reach) =
                (f0 * f1 * inverse, self.reach[block].get(simd, index) * splat(simd, SLACK) * k);
            let bottom = half_chord(reach, f0 * f2 * d_bottom) * inverse - slope * d_bottom;
            let top = -half_chord(reach, f0 * f2 * d_top) * inverse - slope * d_top;
            let slack = splat(simd, MARGIN) + splat(simd, 1e-5) * (bottom - top);
            first.set(index, mean[1] + top - splat(simd, 0.5) - slack);
            last.set(index, mean[1] + bottom + splat(simd, 0.5) + slack);
        }
        for lane in 0..BLOCK {
            // `as` saturates: below zero becomes zero.
            let begin = (first.0[lane].ceil() as u32).min(TILE as u32);
            let end = (last.0[lane] as u32).min(height as u32).max(begin);
            self.rows[block * BLOCK + lane] = (1 << end) - (1 << begin);
        }
    }
}

/// `√(reach - w²)`, or zero.
#[inline(always)]
fn half_chord<S: Simd>(reach: V<S>, w: V<S>) -> V<S> {
    (reach - w * w).max(reach.of(0.0)).sqrt()
}

/// Values of one Gaussian that vary between the rows of a tile.
pub(crate) struct Heights {
    /// `d_y`.
    pub dy: Lanes,
    /// `f₁ d_y`.
    shear: Lanes,
    /// `log2 o - w²`.
    peak: Lanes,
}

impl Heights {
    #[inline(always)]
    pub(crate) fn new<S: Simd>(simd: S, g: &Splat) -> Self {
        let mut out = Self { dy: Lanes::ZERO, shear: Lanes::ZERO, peak: Lanes::ZERO };
        for index in 0..BLOCK / S::F32_LANES {
            let dy = CENTRES.get(simd, index) - splat(simd, g.mean[1]);
            let w = dy * splat(simd, g.factor[2]);
            out.dy.set(index, dy);
            out.shear.set(index, dy * splat(simd, g.factor[1]));
            out.peak.set(index, splat(simd, g.log2_opacity) - w * w);
        }
        out
    }

    /// Base-2 logarithm of opacity times Gaussian on a row, given `f₀ d_x`.
    #[inline(always)]
    pub(crate) fn log2_alpha<S: Simd>(&self, simd: S, along: S::f32s, row: usize) -> S::f32s {
        let u = simd.add_f32s(along, simd.splat_f32s(self.shear.0[row]));
        simd.negate_mul_add_f32s(u, u, simd.splat_f32s(self.peak.0[row]))
    }
}

/// `d_x` of a vector of pixels.
#[inline(always)]
pub(crate) fn offset_x<S: Simd>(simd: S, g: &Splat, column: usize) -> S::f32s {
    (CENTRES.get(simd, column) - splat(simd, g.mean[0])).value
}

/// The number of the lowest bit, which is removed.
#[inline(always)]
pub(crate) fn take_row(rows: &mut u32) -> usize {
    let row = rows.trailing_zeros() as usize % TILE;
    *rows &= *rows - 1;
    row
}
