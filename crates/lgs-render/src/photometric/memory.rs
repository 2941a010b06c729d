//! Reads and writes of a band of the photometric loss.
//!
//! Sixteen rows of each of three images are more than the processor looks ahead in by itself. Memory is
//! therefore asked for what will be touched next.

use super::pair::Pair;
use crate::simd::{BLOCK, Lanes, V};
use crate::transpose::Square;
use crate::window::{RADIUS, STEP};
use lgs_core::prefetch::prefetch;
use pulp::Simd;
use std::ops::Range;

/// Distance, in floats, at which memory is prefetched.
const AHEAD: usize = 2 * BLOCK;

/// The results that a call asks for.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Wanted {
    /// The loss alone.
    Value,
    /// The loss and its gradient.
    Gradient,
}

/// A band of two images and of the gradient.
pub(super) struct Memory<'a> {
    pair: Pair<'a>,
    /// Rows of the band.
    rows: Range<usize>,
    /// Gradient of the rows; empty if not asked for.
    v: &'a mut [f32],
    /// The sums `Σ |a - b|` and `Σ SSIM` of each row.
    pub sums: Vec<[f64; 2]>,
}

impl<'a> Memory<'a> {
    pub(super) fn new(pair: Pair<'a>, rows: Range<usize>, v: &'a mut [f32]) -> Self {
        let sums = vec![[0.0; 2]; rows.len()];
        Self { pair, rows, v, sums }
    }

    /// The gradient if there is an array for it.
    #[inline(always)]
    pub(super) fn wanted(&self) -> Wanted {
        if self.v.is_empty() { Wanted::Value } else { Wanted::Gradient }
    }

    /// Number of rows outside of the band that are needed on each side.
    #[inline(always)]
    pub(super) fn reach(&self) -> usize {
        if self.wanted() == Wanted::Gradient { 2 * RADIUS } else { RADIUS }
    }

    /// The range, among `STEP` rows, of those in the image and at most `margin` rows outside of the band.
    #[inline(always)]
    pub(super) fn needed(&self, first: isize, margin: usize) -> Range<usize> {
        let [start, end] =
            [self.rows.start.saturating_sub(margin), self.pair.height.min(self.rows.end + margin)];
        let [start, end] = [start, end].map(|y| (y as isize - first).clamp(0, STEP as isize) as usize);
        start..end
    }

    /// The needed ones of `STEP` rows of both images; others are empty.
    pub(super) fn images(&self, first: isize) -> [[&'a [f32]; STEP]; 2] {
        let mut rows = [[&[][..]; STEP]; 2];
        for row in self.needed(first, self.reach()) {
            for (rows, image) in rows.iter_mut().zip(self.pair.at((first + row as isize) as usize)) {
                rows[row] = image;
            }
        }
        rows
    }

    /// Sets one of the sums of those of `STEP` rows that are in the band.
    pub(super) fn set_sums(&mut self, first: isize, which: usize, sums: &[f64; STEP]) {
        for row in self.needed(first, 0) {
            self.sums[(first + row as isize) as usize - self.rows.start][which] = sums[row];
        }
    }

    /// Writes sixteen floats, or as many as there are, of those of `STEP` rows of the gradient that are in
    /// the band.
    #[inline(always)]
    pub(super) fn write(&mut self, first: isize, at: usize, square: &Square) {
        for row in self.needed(first, 0) {
            let start = ((first + row as isize) as usize - self.rows.start) * self.pair.row;
            let v = &mut self.v[start + at.min(self.pair.row)..start + self.pair.row];
            match v.first_chunk_mut() {
                Some(v) => *v = square[row].0,
                None => v.copy_from_slice(&square[row].0[..v.len()]),
            }
        }
    }

    /// Asks for what follows sixteen floats of some of `STEP` rows of the gradient.
    #[inline(always)]
    pub(super) fn ask<S: Simd>(&self, simd: S, first: isize, rows: Range<usize>, at: usize) {
        for row in rows {
            let y = first + row as isize - self.rows.start as isize;
            prefetch::<S, f32, true>(
                simd,
                self.v.get((y * self.pair.row as isize + (at + AHEAD) as isize) as usize),
            );
        }
    }
}

/// Sixteen floats of a row, or as many as there are and zeros.
#[inline(always)]
pub(super) fn read<S: Simd>(simd: S, row: &[f32], at: usize, index: usize) -> V<S> {
    match row.get(at..at + BLOCK) {
        Some(floats) => V { simd, value: S::as_simd_f32s(floats).0[index] },
        None => the_rest(row, at).get(simd, index),
    }
}

#[cold]
#[inline(never)]
fn the_rest(row: &[f32], at: usize) -> Lanes {
    let (rest, mut out) = (row.get(at..).unwrap_or_default(), Lanes::ZERO);
    out.0[..rest.len()].copy_from_slice(rest);
    out
}

/// Asks for what follows sixteen floats of some rows.
#[inline(always)]
pub(super) fn ask<S: Simd>(simd: S, [a, b]: &[[&[f32]; STEP]; 2], rows: Range<usize>, at: usize) {
    for row in rows {
        prefetch::<S, f32, false>(simd, a[row].get(at + AHEAD));
        prefetch::<S, f32, false>(simd, b[row].get(at + AHEAD));
    }
}
