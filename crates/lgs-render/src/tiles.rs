//! Which Gaussians touch which tile, in depth order.
//!
//! 1. A stable radix sort orders the visible Gaussians by depth (ties by index).
//! 2. They are dealt out to bands, rows of tiles, by the exact vertical extent of the ellipse on which alpha is 1/255.
//! 3. Each band, in parallel, finds for each of its Gaussians the exact horizontal extent of the ellipse *within the band* (the
//!    ellipse and the band are convex, so that this is also the exact set of tiles) and deals it out to its tiles.
//!
//! Every list is in depth order because dealing out is stable. A gradient goes the way back: tiles add to the entry of their band, and a
//! Gaussian sums its entries over the bands, both in fixed order.

use crate::project::Projected;
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

/// Edge of a square tile in pixels.
pub(crate) const TILE: usize = 16;

/// Widening of extents, pixels: keeps rounding from dropping a pixel that the blending test would accept.
const MARGIN: f32 = 1e-2;

/// A row of tiles.
#[derive(Clone, Debug, Default)]
pub(crate) struct Band {
    /// Gaussians that reach the band, nearest first.
    pub items: Vec<u32>,
    /// `members[starts[t]..starts[t + 1]]` are the positions in `items` of what touches tile `t`.
    pub starts: Vec<u32>,
    pub members: Vec<u32>,
}

impl Band {
    /// Positions in `items` of the Gaussians of a tile, nearest first.
    pub(crate) fn tile(&self, column: usize) -> &[u32] {
        &self.members[self.starts[column] as usize..self.starts[column + 1] as usize]
    }
}

/// Where the entries of a Gaussian are: entry `e` is at `positions[first + e]` in band `band + e`.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Entries {
    pub first: u32,
    pub band: u16,
    pub count: u16,
}

/// All tile lists of an image.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tiling {
    pub columns: usize,
    pub bands: Vec<Band>,
    /// By Gaussian.
    pub entries: Vec<Entries>,
    pub positions: Vec<u32>,
}

/// Builds the tile lists; `projected[i].reach` is 0 for what is invisible.
pub(crate) fn tile(projected: &[Projected], width: usize, height: usize) -> Tiling {
    let (columns, rows) = (width.div_ceil(TILE), height.div_ceil(TILE));
    let mut entries: Vec<Entries> = all_vertical_entries(projected, width, height);
    let order = by_depth(projected, &entries);

    let mut items: Vec<Vec<u32>> = vec![Vec::with_capacity(order.len() / rows.max(1) + 16); rows];
    let mut positions = Vec::with_capacity(2 * order.len());
    for &index in &order {
        let own = &mut entries[index as usize];
        own.first = positions.len() as u32;
        for band in &mut items[usize::from(own.band)..usize::from(own.band + own.count)] {
            positions.push(band.len() as u32);
            band.push(index);
        }
    }
    let bands = items.into_par_iter().enumerate().map(|(row, items)| deal_to_tiles(projected, items, row, width, height)).collect();
    Tiling { columns, bands, entries, positions }
}

/// First and last pixel whose centre lies in `[low, high]`, within `0..size`.
#[inline(always)]
fn pixel_range(low: f32, high: f32, size: usize) -> Option<(usize, usize)> {
    let first = (low - 0.5 - MARGIN).ceil().max(0.0);
    let last = (high - 0.5 + MARGIN).floor().min(size as f32 - 1.0);
    (first <= last).then_some((first as usize, last as usize))
}

/// Half height of the ellipse, pixels.
#[inline(always)]
pub(crate) fn half_height(g: &Projected) -> f32 {
    (g.reach * g.covariance[2]).sqrt() * (1.0 + 1e-5)
}

/// First and last row of pixels the ellipse reaches.
#[inline(always)]
fn pixel_rows(g: &Projected, height: usize) -> Option<(usize, usize)> {
    let half = half_height(g);
    pixel_range(g.mean[1] - half, g.mean[1] + half, height)
}

/// The bands of every Gaussian, in parallel chunks.
fn all_vertical_entries(projected: &[Projected], width: usize, height: usize) -> Vec<Entries> {
    const CHUNK: usize = 1024;
    let arch = Arch::new();
    let mut entries = vec![Entries::default(); projected.len()];
    entries.par_chunks_mut(CHUNK).zip(projected.par_chunks(CHUNK)).for_each(|(out, projected)| {
        arch.dispatch(VerticalEntries { projected, out, size: [width, height] });
    });
    entries
}

struct VerticalEntries<'a> {
    projected: &'a [Projected],
    out: &'a mut [Entries],
    size: [usize; 2],
}

impl WithSimd for VerticalEntries<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        for (out, g) in self.out.iter_mut().zip(self.projected) {
            *out = vertical_entries(g, self.size[0], self.size[1]);
        }
    }
}

#[inline(always)]
fn vertical_entries(g: &Projected, width: usize, height: usize) -> Entries {
    if g.reach <= 0.0 {
        return Entries::default();
    }
    let half_width = (g.reach * g.covariance[0]).sqrt();
    let columns = pixel_range(g.mean[0] - half_width, g.mean[0] + half_width, width);
    match (columns, pixel_rows(g, height)) {
        (Some(_), Some((top, bottom))) => {
            let (first, last) = (top / TILE, bottom / TILE);
            Entries { first: 0, band: first as u16, count: (last - first + 1) as u16 }
        }
        _ => Entries::default(),
    }
}

/// Indices of the Gaussians with entries, nearest first: least-significant-digit radix sort on the bits of the (positive) depth.
fn by_depth(projected: &[Projected], entries: &[Entries]) -> Vec<u32> {
    const BITS: usize = 11;
    let mut keys: Vec<(u32, u32)> = (0..projected.len() as u32)
        .filter(|&i| entries[i as usize].count > 0)
        .map(|i| (projected[i as usize].depth.to_bits(), i))
        .collect();
    let mut other = vec![(0, 0); keys.len()];
    for pass in 0..3 {
        let digit = |key: u32| (key >> (pass * BITS)) as usize & ((1 << BITS) - 1);
        let mut next = [0_u32; 1 << BITS];
        for &(key, _) in &keys {
            next[digit(key)] += 1;
        }
        let mut total = 0;
        for count in &mut next {
            total += std::mem::replace(count, total);
        }
        for &(key, index) in &keys {
            let slot = &mut next[digit(key)];
            other[*slot as usize] = (key, index);
            *slot += 1;
        }
        std::mem::swap(&mut keys, &mut other);
    }
    keys.into_iter().map(|(_, index)| index).collect()
}

/// First and last pixel column that the ellipse reaches on the rows `top..=bottom`.
#[inline(always)]
fn pixel_columns(g: &Projected, top: f32, bottom: f32, width: usize) -> Option<(usize, usize)> {
    let [a, b, c] = g.covariance;
    let half = half_height(g) + MARGIN;
    let (low, high) = ((top - g.mean[1]).max(-half), (bottom - g.mean[1]).min(half));
    // At height d the ellipse spans (b/c) d ± √((reach - d²/c) det/c); the right end is highest where d = b √(reach/a).
    let extreme = b * (g.reach / a).sqrt();
    let half_width = |d: f32| ((g.reach - d * d / c).max(0.0) * g.determinant / c).sqrt();
    let (d_right, d_left) = (extreme.max(low).min(high), (-extreme).max(low).min(high));
    let right = b / c * d_right + half_width(d_right);
    let left = b / c * d_left - half_width(d_left);
    // Relative slack for ellipses much larger than the image.
    let slack = 1e-5 * (right - left).abs();
    pixel_range(g.mean[0] + left - slack, g.mean[0] + right + slack, width)
}

/// Tiles of one band that each of its items reaches, as a range of columns.
struct Spans<'a> {
    projected: &'a [Projected],
    items: &'a [u32],
    row: usize,
    size: [usize; 2],
}

impl WithSimd for Spans<'_> {
    type Output = Vec<(u32, u32)>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Self::Output {
        let [width, height] = self.size;
        let (top, bottom) = ((self.row * TILE) as f32 + 0.5, ((self.row + 1) * TILE).min(height) as f32 - 0.5);
        let mut spans = Vec::with_capacity(self.items.len());
        for &i in self.items {
            spans.push(match pixel_columns(&self.projected[i as usize], top, bottom, width) {
                Some((first, last)) => ((first / TILE) as u32, (last / TILE) as u32 + 1),
                None => (0, 0),
            });
        }
        spans
    }
}

fn deal_to_tiles(projected: &[Projected], items: Vec<u32>, row: usize, width: usize, height: usize) -> Band {
    let spans = Arch::new().dispatch(Spans { projected, items: &items, row, size: [width, height] });
    let columns = width.div_ceil(TILE);
    let mut starts = vec![0; columns + 1];
    for &(first, end) in &spans {
        for count in &mut starts[first as usize + 1..end.max(first) as usize + 1] {
            *count += 1;
        }
    }
    for column in 0..columns {
        starts[column + 1] += starts[column];
    }
    let mut next = starts.clone();
    let mut members = vec![0; starts[columns] as usize];
    for (position, &(first, end)) in spans.iter().enumerate() {
        for slot in &mut next[first as usize..end as usize] {
            members[*slot as usize] = position as u32;
            *slot += 1;
        }
    }
    Band { items, starts, members }
}
