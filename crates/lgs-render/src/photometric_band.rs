//! A band of rows of the photometric loss, streamed `STEP` rows at a time through the windows of SSIM.
//!
//! Two passes over the blocks of columns make a step. The first windows the entering rows of a, b, a² + b² and ab horizontally, then windows
//! the rows `RADIUS` behind vertically and turns these means into SSIM and its slopes. The second does the same two windows to the slopes
//! and writes the gradient of the rows another `RADIUS` behind.

use crate::photometric::Pair;
use crate::simd::{BLOCK, Lanes, V, reciprocal, splat};
use crate::window::{Columns, Padded, RADIUS, Reach, SIZE, SPAN, STEP, Taps, advance, horizontal, shifted, taps, vertical, weights};
use pulp::{Simd, WithSimd};
use std::cell::RefCell;
use std::ops::Range;

/// `(0.01 L)²` for a dynamic range of 1.
const C1: f32 = 1e-4;
/// `(0.03 L)²` for a dynamic range of 1.
const C2: f32 = 9e-4;

/// Some rows of a pair of images; dispatching it gives `[Σ |a - b|, Σ SSIM]` of each row.
pub(crate) struct Band<'a> {
    pub pair: Pair<'a>,
    pub rows: Range<usize>,
    /// Of the two terms in the gradient, per value.
    pub weights: [f32; 2],
    /// Gradient of the rows; empty if not asked for.
    pub v: &'a mut [f32],
}

/// Buffers of a band, kept by each thread from call to call: about 1.8 MB for a width of 800.
#[derive(Default)]
struct Scratch {
    /// Entering rows of a, b.
    images: [Padded; 2],
    /// Rows of the slopes of SSIM by the windowed a, a² + b² and ab.
    slopes: [Padded; 3],
    /// By block: horizontally windowed a, b, a² + b², ab.
    means: Vec<Columns<4>>,
    /// By block: horizontally windowed slopes.
    windowed: Vec<Columns<3>>,
}

thread_local! {
    static SCRATCH: RefCell<Scratch> = RefCell::default();
}

impl Scratch {
    fn resize(&mut self, blocks: usize) {
        self.images.iter_mut().chain(&mut self.slopes).for_each(|rows| rows.resize(blocks));
        self.means.resize(blocks, [[Lanes::ZERO; SPAN]; 4]);
        self.windowed.resize(blocks, [[Lanes::ZERO; SPAN]; 3]);
    }
}

impl WithSimd for Band<'_> {
    type Output = Vec<[f64; 2]>;

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) -> Vec<[f64; 2]> {
        // Not `with`: its closure would be compiled without the vector features.
        let mut scratch = SCRATCH.take();
        scratch.resize(self.pair.row.div_ceil(BLOCK));
        let mut sums = vec![[0.0; 2]; self.rows.len()];
        let with_gradient = !self.v.is_empty();
        let behind = if with_gradient { 2 * RADIUS } else { RADIUS };
        // The rows of a step are `entering..entering + STEP`, possibly above or below the image.
        let mut entering = self.rows.start as isize - 2 * STEP as isize;
        while entering - (behind as isize) < self.rows.end as isize {
            self.similarity(simd, &mut scratch, entering, &mut sums);
            if with_gradient {
                self.gradient(simd, &mut scratch, entering);
            }
            entering += STEP as isize;
        }
        SCRATCH.set(scratch);
        sums
    }
}

impl Band<'_> {
    /// Whether a row lies in the image, at most `margin` rows outside of the band.
    #[inline(always)]
    fn needs(&self, y: isize, margin: usize) -> bool {
        let first = self.rows.start.saturating_sub(margin) as isize;
        (first..self.pair.height.min(self.rows.end + margin) as isize).contains(&y)
    }

    /// The first pass of a step.
    #[inline(always)]
    fn similarity<S: Simd>(&self, simd: S, scratch: &mut Scratch, entering: isize, sums: &mut [[f64; 2]]) {
        let taps = taps(simd, &weights());
        let margin = if self.v.is_empty() { 0 } else { RADIUS };
        let (mut enters, mut leaves) = ([false; STEP], [false; STEP]);
        for row in 0..STEP {
            let y = entering + row as isize;
            enters[row] = self.needs(y, margin + RADIUS);
            leaves[row] = self.needs(y - RADIUS as isize, margin);
            let [a, b] = if enters[row] { self.pair.rows(y as usize).map(Some) } else { [None; 2] };
            scratch.images[0].set_row(row, a);
            scratch.images[1].set_row(row, b);
        }
        let (mut absolute, mut ssim) = ([Lanes::ZERO; STEP], [Lanes::ZERO; STEP]);
        for block in 0..scratch.means.len() {
            let columns = &mut scratch.means[block];
            advance(simd, columns);
            let inside = inside(self.pair.row, block);
            for row in 0..STEP {
                if enters[row] {
                    let reach = [scratch.images[0].reach(row, block), scratch.images[1].reach(row, block)];
                    enter(simd, &taps, reach, columns, row, &mut absolute[row]);
                } else {
                    columns.iter_mut().for_each(|plane| plane[2 * RADIUS + row] = Lanes::ZERO);
                }
            }
            for row in 0..STEP {
                let mut slopes = [Lanes::ZERO; 3];
                if leaves[row] {
                    compare(simd, &taps, columns, row, &inside, &mut slopes, &mut ssim[row]);
                }
                for (rows, slope) in scratch.slopes.iter_mut().zip(&slopes) {
                    rows.set_block(row, block, slope);
                }
            }
        }
        for row in 0..STEP {
            let y = entering + row as isize;
            if self.needs(y, 0) {
                sums[y as usize - self.rows.start][0] = total(&absolute[row]);
            }
            if self.needs(y - RADIUS as isize, 0) {
                sums[y as usize - RADIUS - self.rows.start][1] = total(&ssim[row]);
            }
        }
    }

    /// The second pass of a step.
    #[inline(always)]
    fn gradient<S: Simd>(&mut self, simd: S, scratch: &mut Scratch, entering: isize) {
        let taps = taps(simd, &weights());
        for block in 0..scratch.windowed.len() {
            let columns = &mut scratch.windowed[block];
            advance(simd, columns);
            for row in 0..STEP {
                for (plane, rows) in columns.iter_mut().zip(&scratch.slopes) {
                    let reach = rows.reach(row, block);
                    for index in 0..BLOCK / S::F32_LANES {
                        plane[2 * RADIUS + row].set(index, horizontal(simd, &taps, reach, index));
                    }
                }
            }
            for row in 0..STEP {
                let y = entering + row as isize - 2 * RADIUS as isize;
                if !self.needs(y, 0) {
                    continue;
                }
                let [a, b] = self.pair.rows(y as usize);
                let start = (y as usize - self.rows.start) * self.pair.row;
                let v = &mut self.v[start..start + self.pair.row];
                for index in 0..BLOCK / S::F32_LANES {
                    let first = block * BLOCK + index * S::F32_LANES;
                    let range = first.min(a.len())..a.len().min(first + S::F32_LANES);
                    let pixels = [load(simd, &a[range.clone()]), load(simd, &b[range.clone()])];
                    let means = [
                        vertical(simd, &taps, &columns[0], row, index),
                        vertical(simd, &taps, &columns[1], row, index),
                        vertical(simd, &taps, &columns[2], row, index),
                    ];
                    store(simd, &mut v[range], slope(simd, pixels, means, self.weights));
                }
            }
        }
    }
}

/// A vector, or the end of a row: calls that the whole vectors are spared.
#[inline(always)]
fn load<S: Simd>(simd: S, values: &[f32]) -> V<S> {
    V { simd, value: if let [value] = S::as_simd_f32s(values).0 { *value } else { simd.partial_load_f32s(values) } }
}

#[inline(always)]
fn store<S: Simd>(simd: S, out: &mut [f32], values: V<S>) {
    if out.len() == S::F32_LANES {
        S::as_mut_simd_f32s(out).0[0] = values.value;
    } else {
        simd.partial_store_f32s(out, values.value);
    }
}

/// One for the floats of a block that belong to the row, zero for the rest.
#[inline(always)]
fn inside(row: usize, block: usize) -> Lanes {
    let mut out = Lanes([1.0; BLOCK]);
    if row < (block + 1) * BLOCK {
        out.0[row - block * BLOCK..].fill(0.0);
    }
    out
}

/// Windows an entering row of a block horizontally, and adds `|a - b|`.
#[inline(always)]
fn enter<S: Simd>(simd: S, taps: &Taps<S>, [a, b]: [&Reach; 2], columns: &mut Columns<4>, row: usize, absolute: &mut Lanes) {
    for index in 0..BLOCK / S::F32_LANES {
        let (a0, b0) = (shifted(simd, a, RADIUS, index), shifted(simd, b, RADIUS, index));
        let centre = taps[RADIUS];
        let (mut mean_a, mut mean_b) = (centre * a0, centre * b0);
        let (mut squares, mut products) = (centre * a0.mul_add(a0, b0 * b0), centre * (a0 * b0));
        for (t, &tap) in taps[..RADIUS].iter().enumerate() {
            let (a1, a2) = (shifted(simd, a, t, index), shifted(simd, a, SIZE - 1 - t, index));
            let (b1, b2) = (shifted(simd, b, t, index), shifted(simd, b, SIZE - 1 - t, index));
            mean_a = tap.mul_add(a1 + a2, mean_a);
            mean_b = tap.mul_add(b1 + b2, mean_b);
            squares = tap.mul_add(a1.mul_add(a1, a2.mul_add(a2, b1.mul_add(b1, b2 * b2))), squares);
            products = tap.mul_add(a1.mul_add(b1, a2 * b2), products);
        }
        for (plane, value) in columns.iter_mut().zip([mean_a, mean_b, squares, products]) {
            plane[2 * RADIUS + row].set(index, value);
        }
        let difference = V { simd, value: simd.abs_f32s((a0 - b0).value) };
        absolute.set(index, absolute.get(simd, index) + difference);
    }
}

/// Turns the windowed means of a, b, a² + b², ab into SSIM, which is summed, and its slopes by the means of a, a² + b² and ab.
#[inline(always)]
fn compare<S: Simd>(simd: S, taps: &Taps<S>, columns: &Columns<4>, row: usize, inside: &Lanes, slopes: &mut [Lanes; 3], ssim: &mut Lanes) {
    for index in 0..BLOCK / S::F32_LANES {
        let (a, b) = (vertical(simd, taps, &columns[0], row, index), vertical(simd, taps, &columns[1], row, index));
        let (squares, products) = (vertical(simd, taps, &columns[2], row, index), vertical(simd, taps, &columns[3], row, index));
        let (two, c1, c2) = (splat(simd, 2.0), splat(simd, C1), splat(simd, C2));
        let (aa_bb, ab) = (a.mul_add(a, b * b), a * b);
        let (n1, n2) = (two.mul_add(ab, c1), two.mul_add(products - ab, c2));
        let (d1, d2) = (aa_bb + c1, squares - aa_bb + c2);
        // Zero outside of the row, where all of the following are factors of it.
        let inverse = V { simd, value: reciprocal(simd, (d1 * d2).value) } * inside.get(simd, index);
        let s = n1 * n2 * inverse;
        // s / d1 and s / d2 without two more divisions.
        let (by_d1, by_d2) = (s * d2 * inverse, s * d1 * inverse);
        let by_mean = b.mul_add(inverse * (n2 - n1), a * (by_d2 - by_d1));
        slopes[0].set(index, by_mean + by_mean);
        slopes[1].set(index, -by_d2);
        slopes[2].set(index, (n1 + n1) * inverse);
        ssim.set(index, ssim.get(simd, index) + s);
    }
}

/// The gradient from the windowed slopes.
#[inline(always)]
fn slope<S: Simd>(simd: S, [a, b]: [V<S>; 2], [mean, square, product]: [V<S>; 3], weights: [f32; 2]) -> V<S> {
    let (absolute, zero) = (splat(simd, weights[0]), splat(simd, 0.0));
    let above = absolute.where_set(simd.greater_than_f32s(a.value, b.value), zero);
    let sign = (-absolute).where_set(simd.less_than_f32s(a.value, b.value), above);
    let structure = (a + a).mul_add(square, b.mul_add(product, mean));
    splat(simd, weights[1]).mul_add(structure, sign)
}

fn total(lanes: &Lanes) -> f64 {
    lanes.0.iter().map(|&v| f64::from(v)).sum()
}
