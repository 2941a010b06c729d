//! Which Gaussians touch which tile, in depth order: a counting sort on (tile, depth).
//!
//! 1. A stable radix sort orders the visible Gaussians by depth (ties by index).
//! 2. Chunks of that order, in parallel, find the exact span of tiles of each Gaussian in each row of tiles (`extent`) and count the tiles.
//! 3. The counts are summed over chunks, which gives every chunk its place in every list.
//! 4. The chunks, in parallel, write their Gaussians into the lists.
//!
//! The number of chunks depends on the number of Gaussians only. A Gaussian keeps the places of its entries, so that the backward pass can
//! sum them in a fixed order.

use crate::extent::{pixel_box, pixel_columns};
use crate::project::Projected;
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;
use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

/// Edge of a square tile in pixels.
pub(crate) const TILE: usize = 16;
/// Gaussians read at a time.
const NEAR: usize = 32;
/// Fewest Gaussians of a chunk, and most chunks.
const MIN_CHUNK: usize = 512;
const MAX_CHUNKS: usize = 16;

/// All tile lists of an image.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tiling {
    pub columns: usize,
    /// `members[starts[t]..starts[t + 1]]` are the Gaussians of tile `t`, nearest first.
    pub starts: Vec<u32>,
    pub members: Vec<u32>,
    /// Visible Gaussians, nearest first.
    pub order: Vec<u32>,
    /// `slots[first[rank]..first[rank + 1]]` are the places in `members` of the Gaussian `order[rank]`.
    pub first: Vec<u32>,
    pub slots: Vec<u32>,
}

impl Tiling {
    /// The Gaussians of a tile, nearest first.
    pub(crate) fn tile(&self, tile: usize) -> &[u32] {
        &self.members[self.starts[tile] as usize..self.starts[tile + 1] as usize]
    }

    /// Places in `members` of the Gaussian at a place in the depth order.
    #[inline(always)]
    pub(crate) fn entries(&self, rank: usize) -> &[u32] {
        &self.slots[self.first[rank] as usize..self.first[rank + 1] as usize]
    }
}

/// Builds the tile lists; `projected[i].reach` is 0 for what is invisible.
pub(crate) fn tile(projected: &[Projected], [width, height]: [usize; 2]) -> Tiling {
    let (columns, rows) = (width.div_ceil(TILE), height.div_ceil(TILE));
    let order = by_depth(projected);
    let size = MIN_CHUNK.max(order.len().div_ceil(MAX_CHUNKS));
    let arch = Arch::new();
    let chunks: Vec<Spans> =
        order.par_chunks(size).map(|order| arch.dispatch(FindSpans { projected, order, size: [width, height] })).collect();
    let (starts, mut next) = place(&chunks, columns * rows);

    let total = starts[columns * rows] as usize;
    let members: Vec<AtomicU32> = (0..total).map(|_| AtomicU32::new(0)).collect();
    let mut slots = vec![0; total];
    let parts = split_lengths(&mut slots, chunks.iter().map(|chunk| chunk.total()));
    let work = parts.into_par_iter().zip(&chunks).zip(&mut next).zip(order.par_chunks(size)).with_max_len(1);
    work.for_each(|(((slots, chunk), next), order)| chunk.deal(order, columns, next, &members, slots));
    let first = first_entries(&chunks, order.len());
    Tiling { columns, starts, members: members.into_iter().map(AtomicU32::into_inner).collect(), order, first, slots }
}

/// Indices of the visible Gaussians, nearest first: least-significant-digit radix sort on the bits of the (positive) depth.
fn by_depth(projected: &[Projected]) -> Vec<u32> {
    const BITS: usize = 11;
    let mut keys: Vec<(u32, u32)> = Vec::with_capacity(projected.len());
    keys.extend(projected.iter().zip(0..).filter(|(g, _)| g.reach > 0.0).map(|(g, i)| (g.depth.to_bits(), i)));
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

/// Tiles of a row of tiles: columns `first..end` of row `row`.
#[derive(Clone, Copy, Debug)]
struct Span {
    row: u16,
    first: u16,
    end: u16,
}

/// The spans of a chunk of Gaussians.
#[derive(Debug, Default)]
struct Spans {
    spans: Vec<Span>,
    /// By Gaussian: number of spans, and of tiles.
    lengths: Vec<(u16, u32)>,
    /// Gaussians by tile.
    counts: Vec<u32>,
}

struct FindSpans<'a> {
    projected: &'a [Projected],
    order: &'a [u32],
    size: [usize; 2],
}

impl WithSimd for FindSpans<'_> {
    type Output = Spans;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Spans {
        let [width, height] = self.size;
        let columns = width.div_ceil(TILE);
        let mut out = Spans {
            spans: Vec::with_capacity(3 * self.order.len()),
            lengths: Vec::with_capacity(self.order.len()),
            counts: vec![0; columns * height.div_ceil(TILE)],
        };
        let mut near = [Projected::default(); NEAR];
        for order in self.order.chunks(NEAR) {
            // Copied first, so that the cache misses of neighbours in depth overlap.
            for (near, &index) in near.iter_mut().zip(order) {
                *near = self.projected[index as usize];
            }
            for g in &near[..order.len()] {
                let before = out.spans.len();
                push_spans(g, self.size, &mut out.spans);
                out.close(before, columns);
            }
        }
        out
    }
}

#[inline(always)]
fn push_spans(g: &Projected, size: [usize; 2], out: &mut Vec<Span>) {
    let Some([(left, right), (top, bottom)]) = pixel_box(g, size) else { return };
    let whole = (left / TILE, right / TILE + 1);
    for row in top / TILE..=bottom / TILE {
        let (first_row, last_row) = ((row * TILE).max(top), (row * TILE + TILE - 1).min(bottom));
        // Within one column of tiles or one row of tiles the box is exact.
        let (first, end) = if whole.1 - whole.0 == 1 || (first_row, last_row) == (top, bottom) {
            whole
        } else {
            match pixel_columns(g, first_row as f32 + 0.5, last_row as f32 + 0.5, size[0]) {
                Some((first, last)) => (first / TILE, last / TILE + 1),
                None => continue,
            }
        };
        out.push(Span { row: row as u16, first: first as u16, end: end as u16 });
    }
}

impl Spans {
    /// Ends a Gaussian, whose spans begin at `before`.
    #[inline(always)]
    fn close(&mut self, before: usize, columns: usize) {
        let mut tiles = 0;
        for span in &self.spans[before..] {
            let row = usize::from(span.row) * columns;
            for count in &mut self.counts[row + usize::from(span.first)..row + usize::from(span.end)] {
                *count += 1;
            }
            tiles += u32::from(span.end - span.first);
        }
        self.lengths.push(((self.spans.len() - before) as u16, tiles));
    }

    fn total(&self) -> usize {
        self.lengths.iter().map(|&(_, tiles)| tiles as usize).sum()
    }

    /// Writes the chunk's Gaussians into the lists; `next` is where its part of each list begins.
    fn deal(&self, order: &[u32], columns: usize, next: &mut [u32], members: &[AtomicU32], slots: &mut [u32]) {
        let (mut spans, mut slots) = (self.spans.iter(), slots.iter_mut());
        for (&index, &(count, _)) in order.iter().zip(&self.lengths) {
            for span in spans.by_ref().take(usize::from(count)) {
                let row = usize::from(span.row) * columns;
                for (next, slot) in next[row + usize::from(span.first)..row + usize::from(span.end)].iter_mut().zip(slots.by_ref()) {
                    members[*next as usize].store(index, Relaxed);
                    *slot = *next;
                    *next += 1;
                }
            }
        }
    }
}

/// Where each tile's list starts, and where each chunk's part of it does.
fn place(chunks: &[Spans], tiles: usize) -> (Vec<u32>, Vec<Vec<u32>>) {
    let mut starts = vec![0; tiles + 1];
    let mut next: Vec<Vec<u32>> = chunks.iter().map(|_| vec![0; tiles]).collect();
    let mut total = 0;
    for tile in 0..tiles {
        starts[tile] = total;
        for (chunk, next) in chunks.iter().zip(&mut next) {
            next[tile] = total;
            total += chunk.counts[tile];
        }
    }
    starts[tiles] = total;
    (starts, next)
}

fn first_entries(chunks: &[Spans], count: usize) -> Vec<u32> {
    let mut first = Vec::with_capacity(count + 1);
    let mut total = 0;
    first.push(0);
    for &(_, tiles) in chunks.iter().flat_map(|chunk| &chunk.lengths) {
        total += tiles;
        first.push(total);
    }
    first
}

/// Consecutive parts of the given lengths.
pub(crate) fn split_lengths<T>(mut rest: &mut [T], lengths: impl Iterator<Item = usize>) -> Vec<&mut [T]> {
    let mut parts = Vec::new();
    for length in lengths {
        let (part, tail) = rest.split_at_mut(length);
        parts.push(part);
        rest = tail;
    }
    parts
}
