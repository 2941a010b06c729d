//! A band of rows of the photometric loss, streamed `STEP` rows at a time through the windows of SSIM.
//!
//! Rows enter as cells (`cells`) of `p = a + b` and `m = a - b`; p, m, p² and m² are windowed along them. Then column by column: windows of these, `RADIUS`
//! rows behind, become SSIM and its three slopes, and windows of the slopes, another `RADIUS` rows behind, take the place of what was read. Rows of
//! slopes are windowed along them and become the gradient.

use crate::cells::{CHANNELS, Layout, Row, cells, cells_mut, fill_margins};
use crate::photometric::Pair;
use crate::photometric_memory::Memory;
use crate::simd::{BLOCK, Lanes, Pack, V, splat};
use crate::ssim::{Constants, compare, gain, slope};
use crate::window::{Column, Nest, RADIUS, STEP, along, down};
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

/// Buffers of a band, kept by each thread from call to call: about 1.6 MB for a width of 800.
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
        let layout = Layout::new(self.pair.row / 3);
        if scratch.layout != layout {
            scratch = Scratch { layout, cells: Cells::new(&layout) };
        }
        let (cells, end) = (&mut scratch.cells, self.rows.end as isize);
        cells.begin(&layout, self.weights[1]);
        let with_gradient = !self.v.is_empty();
        let mut entering = self.rows.start as isize;
        let mut memory = Memory::new(self.pair, self.rows, self.v);
        entering = (entering - memory.reach() as isize).max(0);
        let (nest, constants) = (Nest::new(simd), Constants::new(simd));
        while entering - (memory.reach() as isize) < end {
            cells.enter(simd, &nest, &layout, &mut memory, entering);
            cells.compare(simd, (&nest, &constants), &mut memory, entering, with_gradient);
            if with_gradient {
                cells.gradient(simd, &nest, &layout, &mut memory, (entering, self.weights[0]));
            }
            entering += STEP as isize;
        }
        let sums = memory.sums;
        SCRATCH.set(scratch);
        sums
    }
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
    fn enter<S: Simd>(&mut self, simd: S, nest: &Nest<S>, layout: &Layout, memory: &mut Memory<'_>, entering: isize) {
        let Self { images, windowed, .. } = self;
        images.rotate_right(STEP);
        for (row, windowed) in windowed.iter_mut().enumerate() {
            let (y, image) = (entering + row as isize, &mut images[STEP - 1 - row]);
            if !memory.needs(y, memory.reach()) {
                image.as_flattened_mut().fill([Lanes::ZERO; 2]);
                windowed.as_flattened_mut().fill([Lanes::ZERO; 4]);
                continue;
            }
            for (square, image) in cells_mut(image).as_chunks_mut::<BLOCK>().0.iter_mut().enumerate().take(layout.squares()) {
                memory.read(simd, y, square, image);
            }
            let absolute = absolute(simd, &cells(image)[..layout.cells()]);
            memory.set_sum(y, 0, &absolute);
            fill_margins(simd, layout, image);
            for plane in 0..2 {
                along::<S, false, 2, 4>(simd, nest, (image, plane), (windowed, plane));
                along::<S, true, 2, 4>(simd, nest, (image, plane), (windowed, 2 + plane));
            }
        }
    }

    /// Windows along columns, turns means into SSIM, which is summed, and into slopes, which are windowed in turn. Between the columns memory is read
    /// and written.
    #[inline(always)]
    fn compare<S: Simd>(
        &mut self,
        simd: S,
        (nest, constants): (&Nest<S>, &Constants<S>),
        memory: &mut Memory<'_>,
        entering: isize,
        with_gradient: bool,
    ) {
        let (zero, first) = (splat(simd, 0.0), entering - RADIUS as isize);
        let mut needed = [true; STEP];
        for (row, needed) in needed.iter_mut().enumerate() {
            *needed = memory.needs(first + row as isize, memory.reach() - RADIUS);
        }
        let mut totals = [Lanes::ZERO; STEP];
        // Out here, because clearing them takes time.
        let (mut entered, [mut means, mut slopes]) = ([zero; STEP], [[[zero; STEP]; 4]; 2]);
        let [a, b, c, d, e, f, g, h] = self.windowed.each_mut().map(|row| cells_mut(row));
        memory.begin(entering + STEP as isize);
        for (cell, ((of_means, of_slopes), [inside, weight])) in self.columns.iter_mut().zip(&self.inside).enumerate() {
            memory.advance(simd);
            let rows = [&mut a[cell], &mut b[cell], &mut c[cell], &mut d[cell], &mut e[cell], &mut f[cell], &mut g[cell], &mut h[cell]];
            for index in 0..BLOCK / S::F32_LANES {
                for plane in 0..4 {
                    for row in 0..STEP {
                        entered[row] = rows[row][plane].get(simd, index);
                    }
                    means[plane] = down(simd, nest, &mut of_means[plane], &entered, index);
                }
                let (inside, weight) = (inside.get(simd, index), weight.get(simd, index));
                for first in (0..STEP).step_by(PACK) {
                    let mut packed = [Pack([zero; PACK]); 4];
                    for plane in 0..4 {
                        for row in 0..PACK {
                            packed[plane].0[row] = means[plane][first + row];
                        }
                    }
                    let (s, by) = compare(constants, packed, weight);
                    for row in 0..PACK {
                        let total = &mut totals[first + row];
                        total.set(index, s.0[row].mul_add(inside, total.get(simd, index)));
                        for plane in 0..3 {
                            slopes[plane][first + row] = by[plane].0[row];
                        }
                    }
                }
                for row in (0..STEP).filter(|&row| !needed[row]) {
                    for plane in 0..3 {
                        slopes[plane][row] = zero;
                    }
                }
                if with_gradient {
                    for plane in 0..3 {
                        let sums = down(simd, nest, &mut of_slopes[plane], &slopes[plane], index);
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
    fn gradient<S: Simd>(
        &mut self,
        simd: S,
        nest: &Nest<S>,
        layout: &Layout,
        memory: &mut Memory<'_>,
        (entering, weight_absolute): (isize, f32),
    ) {
        let Self { images, windowed, slopes, .. } = self;
        let (scale, absolute) = (splat(simd, 1.0 / gain() as f32), splat(simd, weight_absolute));
        let mut gradient = [Lanes::ZERO; BLOCK];
        for (row, windowed) in windowed.iter_mut().enumerate() {
            let y = entering + row as isize - 2 * RADIUS as isize;
            if !memory.needs(y, 0) {
                continue;
            }
            fill_margins(simd, layout, windowed);
            for plane in 0..3 {
                along::<S, false, 4, 3>(simd, nest, (windowed, plane), (slopes, plane));
            }
            let (slopes, image) = (cells(slopes).as_chunks::<BLOCK>().0, cells(&images[KEPT - 1 - row]).as_chunks::<BLOCK>().0);
            for square in (0..layout.squares()).rev() {
                let (slopes, image) = (&slopes[square], &image[square]);
                for i in 0..BLOCK {
                    for index in 0..BLOCK / S::F32_LANES {
                        let by = [slopes[i][0].get(simd, index), slopes[i][1].get(simd, index), slopes[i][2].get(simd, index)];
                        let pixels = [image[i][0].get(simd, index), image[i][1].get(simd, index)];
                        gradient[i].set(index, slope(pixels, by, scale, absolute));
                    }
                }
                memory.write(simd, y, square, &gradient);
            }
        }
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
            for channel in 0..CHANNELS {
                let m: V<S> = pixel[channel][1].get(simd, index);
                sums[channel] = sums[channel] + V { simd, value: simd.abs_f32s(m.value) };
            }
        }
        out.set(index, sums[0] + sums[1] + sums[2]);
    }
    out
}
