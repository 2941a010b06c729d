//! A band of rows of the photometric loss, streamed `STEP` rows at a time through the windows of SSIM.
//!
//! Rows of both images enter as cells (`cells`) of `p = a + b` and `m = a - b`. `RADIUS` rows behind, p, m, p² and m² are windowed along columns
//! and then along rows; the means become SSIM and its three slopes, which are windowed along rows at once. Another `RADIUS` rows behind, the slopes are windowed
//! along columns and become the gradient. A cell keeps its rows of earlier steps side by side, so that columns are read from one place.

use crate::cells::{Layout, Row, fill_margins, read_row, write_row};
use crate::photometric::Pair;
use crate::simd::{BLOCK, Lanes, V, splat};
use crate::ssim::{compare_cells, slope, window_row};
use crate::window::{RADIUS, SPAN, STEP, Taps, taps, windowed};
use pulp::{Simd, WithSimd};
use std::cell::RefCell;
use std::ops::Range;

/// Rows that the windows of the next step reach back to.
const KEPT: usize = SPAN - STEP;

/// Floats of a row whose differences are summed between two steps along a row: more than the cells of a step hold.
const PIECE: usize = STEP * BLOCK;

/// Some rows of a pair of images; dispatching it gives `[Σ |a - b|, Σ SSIM]` of each row.
pub(crate) struct Band<'a> {
    pub pair: Pair<'a>,
    pub rows: Range<usize>,
    /// Of the two terms in the gradient, per value.
    pub weights: [f32; 2],
    /// Gradient of the rows; empty if not asked for.
    pub v: &'a mut [f32],
}

/// Buffers of a band, kept by each thread from call to call: about 1.4 MB for a width of 800.
#[derive(Default)]
struct Scratch {
    layout: Layout,
    /// Rows of p and m that enter; the gradient takes the place of p.
    entering: [Row<2>; STEP],
    /// By cell, rows of p and m of earlier steps.
    images: Vec<[[Lanes; KEPT]; 2]>,
    /// Rows of p, m, p² and m², windowed along columns.
    means: [Row<4>; STEP],
    /// A row of the slopes of SSIM, as `ssim` gives them.
    slopes: Row<3>,
    /// Rows of slopes, windowed along rows.
    windowed: [Row<3>; STEP],
    /// By cell, such rows of earlier steps.
    earlier: Vec<[[Lanes; KEPT]; 3]>,
    /// By cell: one for what is in the image.
    inside: Vec<Lanes>,
}

thread_local! {
    static SCRATCH: RefCell<Scratch> = RefCell::default();
}

impl Scratch {
    fn resize(&mut self, layout: Layout) {
        if self.layout == layout {
            return;
        }
        let cells = layout.pitch() - 2 * RADIUS;
        *self = Self { layout, ..Self::default() };
        self.entering.iter_mut().for_each(|row| row.resize(cells, [Lanes::ZERO; 2]));
        self.images.resize(layout.cells, [[Lanes::ZERO; KEPT]; 2]);
        self.means.iter_mut().for_each(|row| row.resize(layout.pitch(), [Lanes::ZERO; 4]));
        self.slopes.resize(layout.pitch(), [Lanes::ZERO; 3]);
        self.windowed.iter_mut().for_each(|row| row.resize(cells, [Lanes::ZERO; 3]));
        self.earlier.resize(layout.cells, [[Lanes::ZERO; KEPT]; 3]);
        self.inside.extend((0..cells).map(|cell| layout.inside(cell)));
    }
}

impl WithSimd for Band<'_> {
    type Output = Vec<[f64; 2]>;

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) -> Vec<[f64; 2]> {
        let layout = Layout::new(self.pair.row / 3);
        // Not `with`: its closure would be compiled without the vector features.
        let mut scratch = SCRATCH.take();
        scratch.resize(layout);
        let mut sums = vec![[0.0; 2]; self.rows.len()];
        let with_gradient = !self.v.is_empty();
        let behind = if with_gradient { 2 * RADIUS } else { RADIUS };
        let taps = taps(simd, 1.0);
        // The rows of a step are `entering..entering + STEP`, possibly above or below the image.
        let mut step = Step { entering: self.rows.start as isize - 2 * STEP as isize };
        while step.entering - (behind as isize) < self.rows.end as isize {
            self.enter(simd, &mut scratch, &step);
            let fills = step.entering < self.rows.start as isize;
            let next = Step { entering: step.entering + STEP as isize };
            if fills {
                (0..STEP).for_each(|row| self.absolute(simd, &next, row, &mut sums));
            } else {
                means(simd, &taps, &mut scratch);
                self.similarity(simd, &taps, &mut scratch, [&step, &next], &mut sums);
            }
            if fills || !with_gradient {
                scratch.images.iter_mut().enumerate().for_each(|(cell, images)| keep(images, &scratch.entering, cell));
            } else {
                self.gradient(simd, &mut scratch, &step);
            }
            step = next;
        }
        SCRATCH.set(scratch);
        sums
    }
}

/// Where a band has got to.
struct Step {
    /// The first row that enters.
    entering: isize,
}

impl Step {
    #[inline(always)]
    fn row(&self, row: usize, behind: usize) -> isize {
        self.entering + row as isize - behind as isize
    }
}

impl<'a> Band<'a> {
    /// Whether a row lies in the image, at most `margin` rows outside of the band.
    #[inline(always)]
    fn needs(&self, y: isize, margin: usize) -> bool {
        let first = self.rows.start.saturating_sub(margin) as isize;
        (first..self.pair.height.min(self.rows.end + margin) as isize).contains(&y)
    }

    /// A row of both images, if it lies in the image and is needed.
    #[inline(always)]
    fn source(&self, y: isize) -> [Option<&'a [f32]>; 2] {
        let margin = if self.v.is_empty() { RADIUS } else { 2 * RADIUS };
        if !self.needs(y, margin) {
            return [None; 2];
        }
        let [a, b] = self.pair.rows(y as usize);
        [Some(a), Some(b)]
    }

    /// Reads the entering rows: the sum and the difference of the images.
    #[inline(always)]
    fn enter<S: Simd>(&self, simd: S, scratch: &mut Scratch, step: &Step) {
        for (row, entering) in scratch.entering.iter_mut().enumerate() {
            let [a, b] = self.source(step.row(row, 0));
            read_row(&scratch.layout, a, entering, 0);
            read_row(&scratch.layout, b, entering, 1);
            for cell in entering {
                for index in 0..BLOCK / S::F32_LANES {
                    let (a, b) = (cell[0].get(simd, index), cell[1].get(simd, index));
                    cell[0].set(index, a + b);
                    cell[1].set(index, a - b);
                }
            }
        }
    }

    /// Sums `|a - b|` of an entering row.
    #[inline(always)]
    fn absolute<S: Simd>(&self, simd: S, step: &Step, row: usize, sums: &mut [[f64; 2]]) {
        let y = step.row(row, 0);
        if self.needs(y, 0) {
            let [a, b] = self.pair.rows(y as usize);
            let mut sum = Lanes::ZERO;
            for (a, b) in a.chunks(PIECE).zip(b.chunks(PIECE)) {
                add_absolute(simd, a, b, &mut sum);
            }
            sums[y as usize - self.rows.start][0] = total(&sum);
        }
    }

    /// Turns means into SSIM, which is summed, and into slopes, which are windowed along rows.
    ///
    /// Between the cells it sums `|a - b|` of the rows that enter next and clears those that will be written, so that both come from memory,
    /// in order, while the arithmetic goes on.
    #[inline(always)]
    fn similarity<S: Simd>(&mut self, simd: S, taps: &Taps<S>, scratch: &mut Scratch, [step, next]: [&Step; 2], sums: &mut [[f64; 2]]) {
        let Scratch { layout, means, slopes, windowed, inside, .. } = scratch;
        let margin = if self.v.is_empty() { 0 } else { RADIUS };
        for (row, (means, windowed)) in means.iter_mut().zip(windowed).enumerate() {
            let (y, entering) = (step.row(row, RADIUS), next.row(row, 0));
            if !self.needs(y, margin) {
                windowed.fill([Lanes::ZERO; 3]);
                self.absolute(simd, next, row, sums);
                continue;
            }
            fill_margins(means, layout.cells);
            let [a, b] = self.source(entering).map(Option::unwrap_or_default);
            let (mut a, mut b) = (a.chunks(PIECE), b.chunks(PIECE));
            let written = usize::try_from(step.row(row, 2 * RADIUS) - self.rows.start as isize).unwrap_or(usize::MAX);
            let mut written = self.v.chunks_mut(self.pair.row).nth(written).unwrap_or_default().chunks_mut(PIECE);
            let (mut ssim, mut absolute) = (Lanes::ZERO, Lanes::ZERO);
            for first in (0..inside.len()).step_by(STEP) {
                compare_cells(simd, taps, (means, first), inside, slopes, &mut ssim);
                if let (Some(a), Some(b)) = (a.next(), b.next()) {
                    add_absolute(simd, a, b, &mut absolute);
                }
                if let Some(written) = written.next() {
                    written.fill(0.0);
                }
            }
            if self.needs(entering, 0) {
                sums[entering as usize - self.rows.start][0] = total(&absolute);
            }
            if self.needs(y, 0) {
                sums[y as usize - self.rows.start][1] = total(&ssim);
            }
            if margin != 0 {
                fill_margins(slopes, layout.cells);
                window_row(simd, taps, slopes, windowed);
            }
        }
    }

    /// Windows slopes along columns, and writes the gradient of the rows `2 RADIUS` behind.
    #[inline(always)]
    fn gradient<S: Simd>(&mut self, simd: S, scratch: &mut Scratch, step: &Step) {
        let Scratch { layout, images, windowed: rows, earlier, entering: out, .. } = scratch;
        let scaled = &taps(simd, 2.0 * self.weights[1]);
        for (cell, (images, earlier)) in images.iter_mut().zip(earlier).enumerate() {
            let [p, m] = *images;
            keep(images, out, cell);
            for index in 0..BLOCK / S::F32_LANES {
                let mut means = [[splat(simd, 0.0); STEP]; 3];
                for (plane, means) in means.iter_mut().enumerate() {
                    let column = column(simd, &earlier[plane], rows, cell, plane, index);
                    for (out, &value) in earlier[plane].iter_mut().zip(&column[STEP..]) {
                        out.set(index, value);
                    }
                    *means = windowed(scaled, &column);
                }
                for (row, out) in out.iter_mut().enumerate() {
                    let pixels = [p[row].get(simd, index), m[row].get(simd, index)];
                    let means = [means[0][row], means[1][row], means[2][row]];
                    out[cell][0].set(index, slope(simd, pixels, means, self.weights[0]));
                }
            }
        }
        for (row, out) in out.iter().enumerate() {
            let y = step.row(row, 2 * RADIUS);
            if self.needs(y, 0) {
                let start = (y as usize - self.rows.start) * self.pair.row;
                write_row(layout, out, 0, &mut self.v[start..start + self.pair.row]);
            }
        }
    }
}

/// Windows p, m and their squares along columns: the rows `RADIUS` behind.
#[inline(always)]
fn means<S: Simd>(simd: S, taps: &Taps<S>, scratch: &mut Scratch) {
    let Scratch { entering, images, means, .. } = scratch;
    for (cell, [p, m]) in images.iter().enumerate() {
        for index in 0..BLOCK / S::F32_LANES {
            let (mut x, mut y) = (column(simd, p, entering, cell, 0, index), column(simd, m, entering, cell, 1, index));
            let (mean_p, mean_m) = (windowed(taps, &x), windowed(taps, &y));
            for i in 0..SPAN {
                (x[i], y[i]) = (x[i] * x[i], y[i] * y[i]);
            }
            let (squares_p, squares_m) = (windowed(taps, &x), windowed(taps, &y));
            for (row, means) in means.iter_mut().enumerate() {
                let means = &mut means[RADIUS + cell];
                means[0].set(index, mean_p[row]);
                means[1].set(index, mean_m[row]);
                means[2].set(index, squares_p[row]);
                means[3].set(index, squares_m[row]);
            }
        }
    }
}

/// Makes the rows of a step rows of an earlier one.
#[inline(always)]
fn keep(images: &mut [[Lanes; KEPT]; 2], entering: &[Row<2>; STEP], cell: usize) {
    for (plane, kept) in images.iter_mut().enumerate() {
        for row in STEP..KEPT {
            kept[row - STEP] = kept[row];
        }
        for (kept, row) in kept[KEPT - STEP..].iter_mut().zip(entering) {
            *kept = row[cell][plane];
        }
    }
}

/// Rows of earlier steps and of this one.
#[inline(always)]
fn column<S: Simd, const PLANES: usize>(
    simd: S,
    earlier: &[Lanes; KEPT],
    rows: &[Row<PLANES>; STEP],
    cell: usize,
    plane: usize,
    index: usize,
) -> [V<S>; SPAN] {
    let mut out = [splat(simd, 0.0); SPAN];
    for (out, lanes) in out.iter_mut().zip(earlier) {
        *out = lanes.get(simd, index);
    }
    for (out, row) in out[KEPT..].iter_mut().zip(rows) {
        *out = row[cell][plane].get(simd, index);
    }
    out
}

/// Adds `|a - b|`.
#[inline(always)]
fn add_absolute<S: Simd>(simd: S, a: &[f32], b: &[f32], sum: &mut Lanes) {
    let ((a, a_rest), (b, b_rest)) = (S::as_simd_f32s(a), S::as_simd_f32s(b));
    // Two sums in registers, so that an addition need not wait for the one before it.
    let mut partial = [splat(simd, 0.0), sum.get(simd, 0)];
    for (&a, &b) in a.iter().zip(b) {
        partial.swap(0, 1);
        partial[0] = partial[0] + V { simd, value: simd.abs_f32s(simd.sub_f32s(a, b)) };
    }
    sum.set(0, partial[0] + partial[1]);
    for (sum, (a, b)) in sum.0.iter_mut().zip(a_rest.iter().zip(b_rest)) {
        *sum += (a - b).abs();
    }
}

fn total(lanes: &Lanes) -> f64 {
    lanes.0.iter().map(|&v| f64::from(v)).sum()
}
