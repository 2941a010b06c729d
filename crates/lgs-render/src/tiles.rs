//! Lists of the Gaussians that touch each tile, nearest first.
//!
//! 1. Chunks of the Gaussians, in parallel, find the exact span of tiles of each Gaussian in each row of
//!    tiles (`extent`) and count the tiles.
//! 2. The counts are summed over chunks, which gives every chunk its place in every list.
//! 3. The chunks, in parallel, write depths and numbers of entries into the lists.
//! 4. Every list, in parallel, is sorted by depth, ties by index, while it lies in the first-level cache.
//!
//! The result depends on neither the number of chunks nor that of threads. The entries of all lists are
//! numbered Gaussian by Gaussian, in the order of their indices: the backward pass leaves under this number
//! what a tile sends to an entry, so that the sums over the tiles of each Gaussian read memory from its
//! beginning to its end, and in a fixed order. All arrays are kept from call to call.

use crate::extent::{pixel_box, pixel_columns};
use crate::projected::Projected;
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;
use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

/// Edge of a square tile in pixels.
pub(crate) const TILE: usize = 16;
/// Fewest Gaussians of a chunk, and most chunks.
const MIN_CHUNK: usize = 512;
const MAX_CHUNKS: usize = 16;
/// Most lists that one task sorts.
const LISTS: usize = 16;

/// An entry of a tile's list.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Member {
    /// Index of the Gaussian.
    pub gaussian: u32,
    /// Number of the entry among those of all lists.
    pub entry: u32,
}

/// All tile lists of an image.
#[derive(Debug, Default)]
pub(crate) struct Tiling {
    pub columns: usize,
    /// `members[starts[t]..starts[t + 1]]` are the entries of tile `t`, nearest first.
    starts: Vec<u32>,
    members: Vec<Member>,
    /// The entries of Gaussian `i` have the numbers `first[i]..first[i + 1]`.
    first: Vec<u32>,
    /// The Gaussian of every entry, by number.
    gaussians: Vec<u32>,
    /// The lists before they are sorted: bits of the (positive) depth, then the number of the entry. Any
    /// thread may write anywhere, but none where another does.
    unsorted: Vec<AtomicU64>,
    chunks: Vec<Spans>,
}

impl Tiling {
    /// The entries of a tile, nearest first.
    pub(crate) fn tile(&self, tile: usize) -> &[Member] {
        &self.members[self.starts[tile] as usize..self.starts[tile + 1] as usize]
    }

    /// Numbers of the entries of a Gaussian.
    #[inline(always)]
    pub(crate) fn entries(&self, index: usize) -> Range<usize> {
        self.first[index] as usize..self.first[index + 1] as usize
    }

    /// Number of entries of all lists.
    pub(crate) fn len(&self) -> usize {
        self.members.len()
    }

    /// Builds the tile lists; `projected[i].reach` is 0 for what is invisible.
    pub(crate) fn update(&mut self, projected: &[Projected], [width, height]: [usize; 2]) {
        self.columns = width.div_ceil(TILE);
        let (arch, tiles) = (Arch::new(), self.columns * height.div_ceil(TILE));
        let chunk = MIN_CHUNK.max(projected.len().div_ceil(MAX_CHUNKS));
        self.chunks.resize_with(projected.len().div_ceil(chunk), Spans::default);
        self.chunks.par_iter_mut().zip(projected.par_chunks(chunk)).with_max_len(1).for_each(
            |(out, projected)| {
                arch.dispatch(FindSpans { projected, size: [width, height], out });
            },
        );
        place(&mut self.chunks, tiles, &mut self.starts);
        self.deal(projected, chunk);
        self.sort();
    }

    /// Writes the lists, chunk by chunk.
    fn deal(&mut self, projected: &[Projected], chunk: usize) {
        let Self { columns, starts, first, gaussians, unsorted, chunks, .. } = self;
        let total = starts.last().map_or(0, |&total| total as usize);
        unsorted.resize_with(total, AtomicU64::default);
        gaussians.resize(total, 0);
        first.resize(projected.len() + 1, 0);
        first[projected.len()] = total as u32;
        let mut rest = &mut gaussians[..];
        let gaussians: Vec<&mut [u32]> = chunks
            .iter()
            .map(|chunk| rest.split_off_mut(..chunk.entries as usize).unwrap_or_default())
            .collect();
        let numbered = first[..projected.len()].par_chunks_mut(chunk).zip(gaussians).enumerate();
        let dealt = chunks.par_iter_mut().zip(projected.par_chunks(chunk)).zip(numbered).with_max_len(1);
        dealt.for_each(|((spans, projected), (number, (first, gaussians)))| {
            let numbered = NumberedChunk { projected, index: (number * chunk) as u32, first, gaussians };
            spans.deal(numbered, *columns, unsorted);
        });
    }

    /// Puts every list in order.
    fn sort(&mut self) {
        let Self { starts, members, gaussians, unsorted, .. } = self;
        members.resize(unsorted.len(), Member::default());
        let mut rest = (&mut members[..], &unsorted[..]);
        let lists = starts.array_windows().map(|&[start, end]| {
            let length = (end - start) as usize;
            (
                rest.0.split_off_mut(..length).unwrap_or_default(),
                rest.1.split_off(..length).unwrap_or_default(),
            )
        });
        let lists: Vec<(&mut [Member], &[AtomicU64])> = lists.collect();
        // Lists of a task share the memory of the keys.
        lists.into_par_iter().with_max_len(LISTS).for_each_init(Vec::new, |keys, (members, unsorted)| {
            keys.clear();
            keys.extend(unsorted.iter().map(|key| key.load(Relaxed)));
            keys.sort_unstable();
            for (member, &key) in members.iter_mut().zip(&*keys) {
                let entry = key as u32;
                *member = Member { gaussian: gaussians[entry as usize], entry };
            }
        });
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
    /// Number of spans of each Gaussian.
    lengths: Vec<u16>,
    /// Number of Gaussians of each tile, and later the place at which the chunk's part of the list goes on.
    next: Vec<u32>,
    /// Number of entries, and that of the first one.
    entries: u32,
    first: u32,
}

struct FindSpans<'a> {
    projected: &'a [Projected],
    size: [usize; 2],
    out: &'a mut Spans,
}

impl WithSimd for FindSpans<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { projected, size: [width, height], out } = self;
        let columns = width.div_ceil(TILE);
        out.spans.clear();
        out.lengths.clear();
        out.next.clear();
        out.next.resize(columns * height.div_ceil(TILE), 0);
        out.entries = 0;
        for g in projected {
            let before = out.spans.len();
            if g.reach > 0.0 {
                push_spans(g, self.size, &mut out.spans);
            }
            out.close(before, columns);
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

/// A chunk of Gaussians whose entries are being numbered.
struct NumberedChunk<'a> {
    projected: &'a [Projected],
    /// Index of the first Gaussian.
    index: u32,
    /// Receives the number of each Gaussian's first entry.
    first: &'a mut [u32],
    /// Receives the Gaussian of each entry.
    gaussians: &'a mut [u32],
}

impl Spans {
    /// Ends a Gaussian, whose spans begin at `before`.
    #[inline(always)]
    fn close(&mut self, before: usize, columns: usize) {
        for span in &self.spans[before..] {
            for count in &mut self.next[span.tiles(columns)] {
                *count += 1;
            }
            self.entries += u32::from(span.end - span.first);
        }
        self.lengths.push((self.spans.len() - before) as u16);
    }

    /// Writes the chunk's Gaussians into the lists, and numbers their entries.
    fn deal(&mut self, chunk: NumberedChunk<'_>, columns: usize, lists: &[AtomicU64]) {
        let NumberedChunk { projected, index, first, gaussians } = chunk;
        let (mut spans, mut gaussians) = (self.spans.iter(), gaussians.iter_mut());
        let mut entry = self.first;
        for (((g, &count), first), index) in projected.iter().zip(&self.lengths).zip(first).zip(index..) {
            *first = entry;
            let depth = u64::from(g.depth.to_bits()) << 32;
            for span in spans.by_ref().take(usize::from(count)) {
                for (next, gaussian) in self.next[span.tiles(columns)].iter_mut().zip(&mut gaussians) {
                    lists[*next as usize].store(depth | u64::from(entry), Relaxed);
                    *gaussian = index;
                    *next += 1;
                    entry += 1;
                }
            }
        }
    }
}

impl Span {
    /// Numbers of the tiles.
    #[inline(always)]
    fn tiles(self, columns: usize) -> Range<usize> {
        let row = usize::from(self.row) * columns;
        row + usize::from(self.first)..row + usize::from(self.end)
    }
}

/// From counts to where each tile's list starts, where each chunk's part of it does, and which numbers its
/// entries have.
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
    let mut first = 0;
    for chunk in chunks {
        chunk.first = first;
        first += chunk.entries;
    }
}

#[cfg(test)]
mod tests;
