//! What a band of the photometric loss reads from memory and writes to it: squares of sixteen floats of sixteen segments of a row.
//!
//! Sixteen places of a row are more than the processor looks ahead in by itself. What a step will touch is therefore asked for, in order and in pieces,
//! while the step before it computes.

use crate::cells::{Layout, SEGMENTS};
use crate::photometric::Pair;
use crate::simd::{BLOCK, Lanes, PREFETCHED, V, prefetch};
use crate::transpose::{Square, transpose};
use crate::window::{RADIUS, STEP};
use pulp::Simd;
use std::ops::Range;

/// A band of two images and of the gradient.
pub(crate) struct Memory<'a> {
    pair: Pair<'a>,
    /// Rows of the band.
    rows: Range<usize>,
    /// Gradient of the rows; empty if not asked for.
    v: &'a mut [f32],
    /// By row, `Σ |a - b|` and `Σ SSIM`.
    pub sums: Vec<[f64; 2]>,
    layout: Layout,
    /// On their way to or from cells.
    squares: [Square; 2],
    /// Floats of the images and of the gradient that have not been asked for yet.
    ahead: [Range<usize>; 2],
}

impl<'a> Memory<'a> {
    pub(crate) fn new(pair: Pair<'a>, rows: Range<usize>, v: &'a mut [f32]) -> Self {
        let (layout, sums) = (Layout::new(pair.row / 3), vec![[0.0; 2]; rows.len()]);
        Self { pair, rows, v, sums, layout, squares: [[Lanes::ZERO; BLOCK]; 2], ahead: [0..0, 0..0] }
    }

    /// How far outside of the band rows are needed.
    #[inline(always)]
    pub(crate) fn reach(&self) -> usize {
        if self.v.is_empty() { RADIUS } else { 2 * RADIUS }
    }

    /// Rows in the image, at most `margin` rows outside of the band.
    #[inline(always)]
    fn within(&self, margin: usize) -> Range<isize> {
        self.rows.start.saturating_sub(margin) as isize..self.pair.height.min(self.rows.end + margin) as isize
    }

    /// Whether a row lies in the image, at most `margin` rows outside of the band.
    #[inline(always)]
    pub(crate) fn needs(&self, y: isize, margin: usize) -> bool {
        self.within(margin).contains(&y)
    }

    /// Of a row, if it is in the band, one of its sums.
    pub(crate) fn set_sum(&mut self, y: isize, which: usize, lanes: &Lanes) {
        if self.needs(y, 0) {
            self.sums[y as usize - self.rows.start][which] = lanes.0.iter().map(|&v| f64::from(v)).sum();
        }
    }

    /// Reads a square of `a + b` and of `a - b`, zero outside of the image, as cells; those beyond the last one may get any value.
    #[inline(always)]
    pub(crate) fn read<S: Simd>(&mut self, simd: S, y: isize, square: usize, cells: &mut [[Lanes; 2]; BLOCK]) {
        let [a, b] = self.pair.row(y as usize);
        let [sums, differences] = &mut self.squares;
        let (pitch, whole) = (self.layout.cells(), self.layout.whole(square));
        for segment in 0..whole {
            let start = BLOCK * square + segment * pitch;
            let (a, b) = (S::as_simd_f32s(&a[start..start + BLOCK]).0, S::as_simd_f32s(&b[start..start + BLOCK]).0);
            for index in 0..BLOCK / S::F32_LANES {
                sums[segment].set(index, V { simd, value: simd.add_f32s(a[index], b[index]) });
                differences[segment].set(index, V { simd, value: simd.sub_f32s(a[index], b[index]) });
            }
        }
        for segment in whole..SEGMENTS {
            let [a, b] = [a, b].map(|row| self.layout.read_some(row, segment, square));
            sums[segment].0 = std::array::from_fn(|i| a[i] + b[i]);
            differences[segment].0 = std::array::from_fn(|i| a[i] - b[i]);
        }
        transpose(simd, sums, 0, cells);
        transpose(simd, differences, 1, cells);
    }

    /// Writes a square of the gradient; later ones of the row first. Lanes are cells.
    #[inline(always)]
    pub(crate) fn write<S: Simd>(&mut self, simd: S, y: isize, square: usize, cells: &Square) {
        let start = (y as usize - self.rows.start) * self.pair.row;
        let row = &mut self.v[start..start + self.pair.row];
        let floats: &mut [[Lanes; 1]; BLOCK] = self.squares[0].as_chunks_mut().0.first_chunk_mut().expect("a square");
        transpose(simd, cells, 0, floats);
        // In this order: what is written beyond a segment is overwritten with the next one.
        let (pitch, whole) = (self.layout.cells(), self.layout.whole(square));
        for segment in 0..whole {
            let start = BLOCK * square + segment * pitch;
            row[start..start + BLOCK].copy_from_slice(&floats[segment][0].0);
        }
        for segment in whole..SEGMENTS {
            self.layout.write_some(row, segment, square, &floats[segment][0]);
        }
    }

    /// Next are the `STEP` rows from `first` on.
    pub(crate) fn begin(&mut self, first: isize) {
        let floats = |rows: Range<isize>, first: isize, start: usize| {
            let [from, to] = [first, first + STEP as isize].map(|y| y.clamp(rows.start, rows.end.max(rows.start)) as usize - start);
            from * self.pair.row..to * self.pair.row
        };
        self.ahead = [
            floats(self.within(self.reach()), first, 0),
            if self.v.is_empty() { 0..0 } else { floats(self.within(0), first - (STEP + 2 * RADIUS) as isize, self.rows.start) },
        ];
    }

    /// Asks for a piece of them, and for a piece of the gradient that will be written before.
    #[inline(always)]
    pub(crate) fn advance<S: Simd>(&mut self, simd: S) {
        let [read, written] = &mut self.ahead;
        for image in self.pair.images() {
            prefetch::<S, false>(simd, &image[read.clone()]);
        }
        prefetch::<S, true>(simd, &self.v[written.clone()]);
        for ahead in [read, written] {
            ahead.start = ahead.end.min(ahead.start + PREFETCHED);
        }
    }
}
