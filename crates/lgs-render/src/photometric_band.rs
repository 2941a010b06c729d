//! A band of rows of the photometric loss, streamed `STEP` rows at a time through the windows of SSIM.
//!
//! Rows enter as cells (`cells`) of `p = a + b` and `m = a - b`; p, m, p² and m² are windowed along them. Then column by column: windows of these, `RADIUS`
//! rows behind, become SSIM and its three slopes, and windows of the slopes, another `RADIUS` rows behind, take the place of what was read. Rows of
//! slopes are windowed along them and become the gradient.

use crate::cells::{CHANNELS, Layout, Row, cells, cells_mut, fill_margins};
use crate::pack::Pack;
use crate::photometric::Pair;
use crate::photometric_memory::Memory;
use crate::simd::{BLOCK, Lanes, V, splat};
use crate::ssim::{Constants, compare, gain, slope};
use crate::transpose::Rows;
use crate::window::{Column, Nest, RADIUS, STEP, down};
use crate::window_row::along;
use pulp::{Simd, WithSimd};
use std::cell::RefCell;
use std::ops::Range;

/// Rows of which SSIM is computed at once.
const PACK: usize = 4;
/// Rows of p and m that are kept: the gradient lies `2 RADIUS` rows behind what enters.
const KEPT: usize = STEP + 2 * RADIUS;

/// Some rows of a pair of images; dispatching it gives `[Σ |a - b|, Σ SSIM]` of each row.
pub(crate) struct Band<'a> {
    pub pair: Pair<'a>,
    pub rows: Range<usize>,
    /// Of the two terms in the gradient, per value.
    pub weights: [f32; 2],
    /// Gradient of the rows; empty if not asked for.
    pub v: &'a mut [f32],
}

/// Buffers of a band, kept by each thread from call to call: about 1.5 MB for a width of 800.
#[derive(Default)]
struct Scratch {
    layout: Layout,
    cells: Cells,
}

thread_local! {
    static SCRATCH: RefCell<Scratch> = RefCell::default();
}

impl WithSimd for Band<'_> {
    type Output = Vec<[f64; 2]>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Vec<[f64; 2]> {
        // Not `with`: its closure would be compiled without the vector features.
        let mut scratch = SCRATCH.take();
        let layout = Layout::new(self.pair.row / CHANNELS);
        if scratch.layout != layout {
            scratch = Scratch { layout, cells: Cells::new(&layout) };
        }
        let (cells, Range { start, end }) = (&mut scratch.cells, self.rows.clone());
        cells.begin(&layout, self.weights[1]);
        let (absolute, scale) = (self.weights[0], 1.0 / gain() as f32);
        let loss = Loss { simd, layout, nest: Nest::new(simd), constants: Constants::new(simd), absolute, scale };
        let with_gradient = !self.v.is_empty();
        let mut memory = Memory::new(self.pair, self.rows, self.v);
        let mut entering = start.saturating_sub(memory.reach()) as isize;
        while entering < (end + memory.reach()) as isize {
            cells.enter(&loss, &mut memory, entering);
            cells.compare(&loss, &mut memory, entering, with_gradient);
            if with_gradient {
                cells.gradient(&loss, &mut memory, entering);
            }
            entering += STEP as isize;
        }
        let sums = memory.sums;
        SCRATCH.set(scratch);
        sums
    }
}

/// What does not change from step to step.
struct Loss<S: Simd> {
    simd: S,
    layout: Layout,
    nest: Nest<S>,
    constants: Constants<S>,
    /// Weight of `|a - b|` in the gradient, and the scale of the slopes by p and m over that of the others.
    absolute: f32,
    scale: f32,
}

/// What lies between the images and the gradient.
#[derive(Default)]
struct Cells {
    /// Rows of p and m, the last one first.
    images: Vec<Row<2>>,
    /// Rows of p, m, p² and m², windowed along rows; then of slopes, windowed along columns.
    windowed: [Row<4>; STEP],
    /// By cell, what the windows along columns keep of p, m, p², m² and of the slopes.
    columns: Vec<([Column; 4], [Column; 3])>,
    /// A row of slopes, windowed along columns and rows.
    slopes: Row<3>,
    /// By cell: one for what is in the image; the same times the weight of its SSIM in the gradient.
    inside: Vec<[Lanes; 2]>,
}

impl Cells {
    fn new(layout: &Layout) -> Self {
        Self {
            images: vec![layout.row(); KEPT],
            windowed: std::array::from_fn(|_| layout.row()),
            columns: Vec::new(),
            slopes: layout.row(),
            inside: (0..layout.cells()).map(|cell| [layout.inside(cell), Lanes::ZERO]).collect(),
        }
    }

    /// For a new band.
    fn begin(&mut self, layout: &Layout, weight: f32) {
        self.columns.clear();
        self.columns.resize(layout.cells(), Default::default());
        // Slopes are halves, in units of the windows' sums.
        let weight = 2.0 * gain() as f32 * weight;
        for [inside, weighted] in &mut self.inside {
            *weighted = Lanes(inside.0.map(|inside| inside * weight));
        }
    }

    /// Turns the entering rows to cells and windows them along rows.
    #[inline(always)]
    fn enter<S: Simd>(&mut self, loss: &Loss<S>, memory: &mut Memory<'_>, entering: isize) {
        let Self { images, windowed, .. } = self;
        let Loss { simd, layout, nest, .. } = loss;
        images.rotate_right(STEP);
        for (row, windowed) in windowed.iter_mut().enumerate() {
            let (y, image) = (entering + row as isize, &mut images[STEP - 1 - row]);
            if !memory.needs(y, memory.reach()) {
                image.as_flattened_mut().fill([Lanes::ZERO; 2]);
                windowed.as_flattened_mut().fill([Lanes::ZERO; 4]);
                continue;
            }
            for (square, image) in cells_mut(image).as_chunks_mut().0.iter_mut().enumerate().take(layout.squares()) {
                memory.read(*simd, y, square, image);
            }
            let absolute = absolute(*simd, &cells(image)[..layout.cells()]);
            memory.set_sum(y, 0, &absolute);
            fill_margins(*simd, layout, image);
            for plane in 0..2 {
                along::<S, false, 2, 4>(*simd, nest, (image, plane), (windowed, plane));
                along::<S, true, 2, 4>(*simd, nest, (image, plane), (windowed, 2 + plane));
            }
        }
    }

    /// Windows along columns, turns means into SSIM, which is summed, and into slopes, which are windowed in turn. Between the columns it asks for
    /// what the next step will touch.
    #[inline(always)]
    fn compare<S: Simd>(&mut self, loss: &Loss<S>, memory: &mut Memory<'_>, entering: isize, with_gradient: bool) {
        let (simd, first) = (loss.simd, entering - RADIUS as isize);
        let needed = memory.needed(first, memory.reach() - RADIUS);
        // Out here, because clearing them takes time.
        let zero = [splat(simd, 0.0); STEP];
        let (mut entered, mut means, mut slopes) = (zero, [zero; 4], [zero; 3]);
        let mut totals = [Lanes::ZERO; STEP];
        let count = self.columns.len();
        // Of one length, so that there is one check for all.
        let [a, b, c, d, e, f, g, h] = self.windowed.each_mut().map(|row| &mut cells_mut(row)[..count]);
        memory.begin(entering + STEP as isize);
        for (cell, ((of_means, of_slopes), inside)) in self.columns.iter_mut().zip(&self.inside).enumerate() {
            memory.advance(simd);
            let rows = [&mut a[cell], &mut b[cell], &mut c[cell], &mut d[cell], &mut e[cell], &mut f[cell], &mut g[cell], &mut h[cell]];
            for index in 0..BLOCK / S::F32_LANES {
                for plane in 0..4 {
                    for row in 0..STEP {
                        entered[row] = rows[row][plane].get(simd, index);
                    }
                    means[plane] = down(simd, &loss.nest, &mut of_means[plane], &entered, index);
                }
                compare_rows(&loss.constants, &means, inside, &mut totals, &mut slopes, index);
                if needed.len() < STEP {
                    for slopes in &mut slopes {
                        slopes[..needed.start].copy_from_slice(&zero[..needed.start]);
                        slopes[needed.end..].copy_from_slice(&zero[needed.end..]);
                    }
                }
                if with_gradient {
                    for plane in 0..3 {
                        let sums = down(simd, &loss.nest, &mut of_slopes[plane], &slopes[plane], index);
                        for row in 0..STEP {
                            rows[row][plane].set(index, sums[row]);
                        }
                    }
                }
            }
        }
        for (row, total) in totals.iter().enumerate() {
            memory.set_sum(first + row as isize, 1, total);
        }
    }

    /// Windows slopes along rows, and turns them to the gradient of the rows `2 RADIUS` behind.
    #[inline(always)]
    fn gradient<S: Simd>(&mut self, loss: &Loss<S>, memory: &mut Memory<'_>, entering: isize) {
        let Loss { simd, layout, nest, .. } = loss;
        for (row, windowed) in self.windowed.iter_mut().enumerate() {
            let y = entering + row as isize - 2 * RADIUS as isize;
            if memory.needs(y, 0) {
                fill_margins(*simd, layout, windowed);
                for plane in 0..3 {
                    along::<S, false, 4, 3>(*simd, nest, (windowed, plane), (&mut self.slopes, plane));
                }
                write_row(loss, &self.slopes, &self.images[KEPT - 1 - row], memory, y);
            }
        }
    }
}

/// SSIM of `STEP` rows of a column, which is added to the totals, and its slopes.
#[inline(always)]
fn compare_rows<S: Simd>(
    constants: &Constants<S>,
    means: &[[V<S>; STEP]; 4],
    [inside, weight]: &[Lanes; 2],
    totals: &mut [Lanes; STEP],
    slopes: &mut [[V<S>; STEP]; 3],
    index: usize,
) {
    let simd = means[0][0].simd;
    for first in (0..STEP).step_by(PACK) {
        let mut packed = [Pack([means[0][0]; PACK]); 4];
        for plane in 0..4 {
            for row in 0..PACK {
                packed[plane].0[row] = means[plane][first + row];
            }
        }
        let (ssim, by) = compare(constants, packed, weight.get(simd, index));
        for row in 0..PACK {
            let total = &mut totals[first + row];
            total.set(index, ssim.0[row].mul_add(inside.get(simd, index), total.get(simd, index)));
            for plane in 0..3 {
                slopes[plane][first + row] = by[plane].0[row];
            }
        }
    }
}

/// Writes the gradient of a row.
#[inline(always)]
fn write_row<S: Simd>(loss: &Loss<S>, slopes: &Row<3>, image: &Row<2>, memory: &mut Memory<'_>, y: isize) {
    let (slopes, images) = (cells(slopes).as_chunks().0, cells(image).as_chunks().0);
    for square in (0..loss.layout.squares()).rev() {
        let gradient = Gradient { slopes: &slopes[square], images: &images[square], absolute: loss.absolute, scale: loss.scale };
        memory.write(loss.simd, y, square, &gradient);
    }
}

/// Gradient of some cells, from windowed slopes and from p and m.
struct Gradient<'a> {
    slopes: &'a [[Lanes; 3]; BLOCK],
    images: &'a [[Lanes; 2]; BLOCK],
    /// As in [`Loss`].
    absolute: f32,
    scale: f32,
}

impl Rows for Gradient<'_> {
    #[inline(always)]
    fn row<S: Simd>(&self, simd: S, cell: usize) -> Lanes {
        let (scale, absolute) = (splat(simd, self.scale), splat(simd, self.absolute));
        let (slopes, [p, m], mut out) = (&self.slopes[cell], &self.images[cell], Lanes::ZERO);
        for index in 0..BLOCK / S::F32_LANES {
            let by = [slopes[0].get(simd, index), slopes[1].get(simd, index), slopes[2].get(simd, index)];
            out.set(index, slope([p.get(simd, index), m.get(simd, index)], by, scale, absolute));
        }
        out
    }
}

/// Sums `|m|` of cells of p and m.
#[inline(always)]
fn absolute<S: Simd>(simd: S, cells: &[[Lanes; 2]]) -> Lanes {
    let mut out = Lanes::ZERO;
    for index in 0..BLOCK / S::F32_LANES {
        // Three sums, so that an addition need not wait for the one before it.
        let mut sums = [splat(simd, 0.0); CHANNELS];
        for pixel in cells.as_chunks::<CHANNELS>().0 {
            for (sum, [_, m]) in sums.iter_mut().zip(pixel) {
                *sum = *sum + V { simd, value: simd.abs_f32s(m.get(simd, index).value) };
            }
        }
        out.set(index, sums[0] + sums[1] + sums[2]);
    }
    out
}
