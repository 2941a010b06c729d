//! What a band of the photometric loss reads from memory and writes to it: squares of sixteen floats of sixteen segments of a row.
//!
//! Sixteen places of a row are more than the processor looks ahead in by itself. What a step will touch is therefore asked for, in order and in pieces,
//! while the step before it computes.

use crate::cells::{Layout, SEGMENTS};
use crate::photometric::Pair;
use crate::prefetch::{PREFETCHED, prefetch};
use crate::simd::{BLOCK, Lanes, V};
use crate::transpose::{Rows, transpose};
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
    /// Floats of the images and of the gradient that have not been asked for yet.
    ahead: [Range<usize>; 2],
}

impl<'a> Memory<'a> {
    pub(crate) fn new(pair: Pair<'a>, rows: Range<usize>, v: &'a mut [f32]) -> Self {
        let (layout, sums) = (Layout::new(pair.row / 3), vec![[0.0; 2]; rows.len()]);
        Self { pair, rows, v, sums, layout, ahead: [0..0, 0..0] }
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

    /// Of `STEP` rows those that lie in the image, at most `margin` rows outside of the band.
    pub(crate) fn needed(&self, first: isize, margin: usize) -> Range<usize> {
        let rows = self.within(margin);
        let [start, end] = [rows.start, rows.end].map(|y| (y - first).clamp(0, STEP as isize) as usize);
        start..end
    }

    /// Of a row, if it is in the band, one of its sums.
    pub(crate) fn set_sum(&mut self, y: isize, which: usize, lanes: &Lanes) {
        if self.needs(y, 0) {
            self.sums[y as usize - self.rows.start][which] = lanes.0.iter().map(|&v| f64::from(v)).sum();
        }
    }

    /// Reads a square of `a + b` and of `a - b`, zero outside of the image, as cells; those beyond the last one may get any value.
    #[inline(always)]
    pub(crate) fn read<S: Simd>(&self, simd: S, y: isize, square: usize, cells: &mut [[Lanes; 2]; BLOCK]) {
        // One after the other, so that each stays in registers.
        self.read_plane::<S, 0>(simd, y, square, cells);
        self.read_plane::<S, 1>(simd, y, square, cells);
    }

    #[inline(always)]
    fn read_plane<S: Simd, const PLANE: usize>(&self, simd: S, y: isize, square: usize, cells: &mut [[Lanes; 2]; BLOCK]) {
        // To the end of the images, so that hardly anything but their last row is cut off.
        let [a, b] = self.pair.from(y as usize);
        let (whole, (start, pitch)) = (self.layout.whole(a.len(), square), self.layout.steps(square));
        let pairs = Pairs::<PLANE> { a, b, start, pitch };
        if whole == SEGMENTS {
            return transpose(simd, &pairs, PLANE, cells);
        }
        let mut floats = [Lanes::ZERO; BLOCK];
        for (segment, lanes) in floats.iter_mut().enumerate() {
            if segment < whole {
                *lanes = pairs.row(simd, segment);
            } else {
                let some = self.layout.some(segment, square);
                let pairs = a[some.clone()].iter().zip(&b[some]);
                lanes.0.iter_mut().zip(pairs).for_each(|(out, (a, b))| *out = if PLANE == 0 { a + b } else { a - b });
            }
        }
        transpose(simd, &floats, PLANE, cells);
    }

    /// Writes a square of the gradient, whose rows are cells; later ones of an image's row first, and later rows later.
    #[inline(always)]
    pub(crate) fn write<S: Simd>(&mut self, simd: S, y: isize, square: usize, cells: &impl Rows) {
        let v = &mut self.v[(y as usize - self.rows.start) * self.pair.row..];
        let (whole, (start, pitch)) = (self.layout.whole(v.len(), square), self.layout.steps(square));
        let mut floats = [[Lanes::ZERO]; BLOCK];
        transpose(simd, cells, 0, &mut floats);
        // What is written beyond a segment, or a row, is overwritten with the next one.
        for (segment, [lanes]) in floats.iter().enumerate().take(whole) {
            *v[start + segment * pitch..].first_chunk_mut().expect("whole squares") = lanes.0;
        }
        for (segment, [lanes]) in floats.iter().enumerate().skip(whole) {
            let v = &mut v[self.layout.some(segment, square)];
            v.copy_from_slice(&lanes.0[..v.len()]);
        }
    }

    /// Next are the `STEP` rows from `first` on.
    pub(crate) fn begin(&mut self, first: isize) {
        let floats = |first: isize, margin: usize, start: usize| match self.needed(first, margin) {
            rows if rows.is_empty() => 0..0,
            Range { start: from, end: to } => {
                let float = |row: usize| ((first + row as isize) as usize - start) * self.pair.row;
                float(from)..float(to)
            }
        };
        let written = first - (STEP + 2 * RADIUS) as isize;
        self.ahead = [floats(first, self.reach(), 0), if self.v.is_empty() { 0..0 } else { floats(written, 0, self.rows.start) }];
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

/// By segment, sixteen floats of both images: their sums, or their differences.
struct Pairs<'a, const PLANE: usize> {
    a: &'a [f32],
    b: &'a [f32],
    /// Where the first segment's begin, and how far those of the next one are.
    start: usize,
    pitch: usize,
}

impl<const PLANE: usize> Rows for Pairs<'_, PLANE> {
    #[inline(always)]
    fn row<S: Simd>(&self, simd: S, segment: usize) -> Lanes {
        let at = self.start + segment * self.pitch;
        let (a, b) = (&self.a[at..at + BLOCK], &self.b[at..at + BLOCK]);
        let (a, b) = (S::as_simd_f32s(a).0, S::as_simd_f32s(b).0);
        let mut out = Lanes::ZERO;
        for index in 0..BLOCK / S::F32_LANES {
            let value = if PLANE == 0 { simd.add_f32s(a[index], b[index]) } else { simd.sub_f32s(a[index], b[index]) };
            out.set(index, V { simd, value });
        }
        out
    }
}
