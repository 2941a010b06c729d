//! Which Gaussians touch which tile, in depth order: a counting sort on (tile, depth).
//!
//! 1. The visible Gaussians are ordered by depth (`depth_order`).
//! 2. Chunks of that order, in parallel, find the exact span of tiles of each Gaussian in each row of tiles (`extent`) and count the tiles.
//! 3. The counts are summed over chunks, which gives every chunk its place in every list.
//! 4. The chunks, in parallel, write their Gaussians into the lists.
//!
//! The number of chunks depends on the number of Gaussians only. The entries of all lists are numbered Gaussian by Gaussian, in the order of
//! their indices: the backward pass leaves under this number what a tile sends to an entry, so that the sums over the tiles of each Gaussian
//! read memory from its beginning to its end, and in a fixed order. All arrays are kept from call to call.

use crate::depth_order::{DepthOrder, Pair};
use crate::extent::{pixel_box, pixel_columns};
use crate::project::Projected;
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;
use std::ops::Range;
use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

/// Edge of a square tile in pixels.
pub(crate) const TILE: usize = 16;
/// Gaussians read at a time.
const NEAR: usize = 32;
/// Fewest Gaussians of a chunk, and most chunks.
const MIN_CHUNK: usize = 512;
const MAX_CHUNKS: usize = 16;

/// All tile lists of an image.
#[derive(Debug, Default)]
pub(crate) struct Tiling {
    pub columns: usize,
    /// `members[starts[t]..starts[t + 1]]` are the entries of tile `t`, nearest first.
    starts: Vec<u32>,
    /// Index of the Gaussian and number of the entry.
    members: Vec<Pair>,
    /// The entries of Gaussian `i` have the numbers `first[i]..first[i + 1]`.
    first: Vec<AtomicU32>,
    order: DepthOrder,
    chunks: Vec<Spans>,
}

impl Tiling {
    /// The entries of a tile, nearest first: index of the Gaussian and number of the entry.
    pub(crate) fn tile(&self, tile: usize) -> &[Pair] {
        &self.members[self.starts[tile] as usize..self.starts[tile + 1] as usize]
    }

    /// Numbers of the entries of a Gaussian.
    #[inline(always)]
    pub(crate) fn entries(&self, index: usize) -> Range<usize> {
        self.first[index].load(Relaxed) as usize..self.first[index + 1].load(Relaxed) as usize
    }

    /// Number of entries of all lists.
    pub(crate) fn len(&self) -> usize {
        self.members.len()
    }

    /// Builds the tile lists; `projected[i].reach` is 0 for what is invisible.
    pub(crate) fn update(&mut self, projected: &[Projected], [width, height]: [usize; 2]) {
        let (columns, rows) = (width.div_ceil(TILE), height.div_ceil(TILE));
        let Self { starts, members, first, order, chunks, .. } = self;
        self.columns = columns;
        order.update(projected);
        let order = order.pairs();
        first.clear();
        first.resize_with(projected.len() + 1, AtomicU32::default);

        let size = MIN_CHUNK.max(order.len().div_ceil(MAX_CHUNKS));
        chunks.resize_with(order.len().div_ceil(size), Spans::default);
        let arch = Arch::new();
        chunks.par_iter_mut().zip(order.par_chunks(size)).with_max_len(1).for_each(|(out, order)| {
            arch.dispatch(FindSpans { projected, order, size: [width, height], first, out });
        });
        number_entries(first);
        place(chunks, columns * rows, starts);
        members.resize_with(starts[columns * rows] as usize, Pair::default);
        let dealt = chunks.par_iter_mut().zip(order.par_chunks(size)).with_max_len(1);
        dealt.for_each(|(chunk, order)| chunk.deal(order, columns, first, members));
    }
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
    /// By Gaussian: number of spans.
    lengths: Vec<u16>,
    /// By tile: number of Gaussians, and then where the chunk's part of the list goes on.
    next: Vec<u32>,
}

struct FindSpans<'a> {
    projected: &'a [Projected],
    order: &'a [Pair],
    size: [usize; 2],
    /// Receives the number of tiles of each Gaussian.
    first: &'a [AtomicU32],
    out: &'a mut Spans,
}

impl WithSimd for FindSpans<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { projected, order, size: [width, height], first, out } = self;
        let columns = width.div_ceil(TILE);
        out.spans.clear();
        out.lengths.clear();
        out.next.clear();
        out.next.resize(columns * height.div_ceil(TILE), 0);
        let mut near = [Projected::default(); NEAR];
        for order in order.chunks(NEAR) {
            // Copied first, so that the cache misses of neighbours in depth overlap.
            for (near, pair) in near.iter_mut().zip(order) {
                *near = projected[pair.low() as usize];
            }
            for (g, pair) in near.iter().zip(order) {
                let before = out.spans.len();
                push_spans(g, self.size, &mut out.spans);
                first[pair.low() as usize].store(out.close(before, columns), Relaxed);
            }
        }
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
    /// Ends a Gaussian, whose spans begin at `before`; gives the number of its tiles.
    #[inline(always)]
    fn close(&mut self, before: usize, columns: usize) -> u32 {
        let mut tiles = 0;
        for span in &self.spans[before..] {
            let row = usize::from(span.row) * columns;
            for count in &mut self.next[row + usize::from(span.first)..row + usize::from(span.end)] {
                *count += 1;
            }
            tiles += u32::from(span.end - span.first);
        }
        self.lengths.push((self.spans.len() - before) as u16);
        tiles
    }

    /// Writes the chunk's Gaussians into the lists.
    fn deal(&mut self, order: &[Pair], columns: usize, first: &[AtomicU32], members: &[Pair]) {
        let mut spans = self.spans.iter();
        for (pair, &count) in order.iter().zip(&self.lengths) {
            let index = pair.low();
            let mut number = first[index as usize].load(Relaxed);
            for span in spans.by_ref().take(usize::from(count)) {
                let row = usize::from(span.row) * columns;
                for next in &mut self.next[row + usize::from(span.first)..row + usize::from(span.end)] {
                    members[*next as usize].set([index, number]);
                    number += 1;
                    *next += 1;
                }
            }
        }
    }
}

/// From the number of entries of each Gaussian to that of its first one.
fn number_entries(first: &mut [AtomicU32]) {
    let mut total = 0;
    for first in first {
        total += std::mem::replace(first.get_mut(), total);
    }
}

/// From counts to where each tile's list starts, and where each chunk's part of it does.
fn place(chunks: &mut [Spans], tiles: usize, starts: &mut Vec<u32>) {
    starts.clear();
    let mut total = 0;
    for tile in 0..tiles {
        starts.push(total);
        for chunk in &mut *chunks {
            total += std::mem::replace(&mut chunk.next[tile], total);
        }
    }
    starts.push(total);
}
