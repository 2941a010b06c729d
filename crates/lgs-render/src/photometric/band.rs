//! A band of rows of the photometric loss, streamed `STEP` rows at a time through the windows of SSIM,
//! sixteen pixels after sixteen.
//!
//! Of the sum `p = a + b` and the difference `m = a - b`, sixteen floats of a row side by side, p, m, p² and
//! m² are windowed down their columns. Squares of sixteen rows and floats are transposed, and windowed on
//! along rows, sixteen rows side by side. That gives means, these become SSIM and its three slopes, and the
//! slopes go back the same way: along rows, transposed, down columns. `RADIUS` rows and pixels behind what
//! enters means are known, twice as far the gradient.

use super::compare::ComparedPixels;
use super::lines::{Behind, Cells, Channel, PIXELS, Plane, Rows, WAITING, Waiting, behind};
use super::memory::{Memory, Wanted, ask, read};
use super::pair::{CHANNELS, Pair};
use crate::simd::{BLOCK, Lanes, V, splat};
use crate::ssim::{Constants, gain, slope};
use crate::transpose::{Square, transpose};
use crate::window::{Nest, Past, RADIUS, STEP, slide};
use pulp::{Simd, WithSimd};
use std::cell::Cell;
use std::ops::Range;

/// Some rows of a pair of images; dispatching it gives `[Σ |a - b|, Σ SSIM]` of each row.
pub(super) struct Band<'a> {
    pub pair: Pair<'a>,
    pub rows: Range<usize>,
    /// Weights of the two terms in the gradient, per value.
    pub weights: [f32; 2],
    /// Gradient of the rows; empty if not asked for.
    pub v: &'a mut [f32],
}

/// Steps of a band, with its gradient.
pub(super) fn steps(start: usize, end: usize) -> usize {
    (end + 2 * RADIUS - start.saturating_sub(2 * RADIUS)).div_ceil(STEP)
}

thread_local! {
    /// Kept by each thread from call to call.
    static STREAM: Cell<Option<Box<Stream>>> = const { Cell::new(None) };
}

impl WithSimd for Band<'_> {
    type Output = Vec<[f64; 2]>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Vec<[f64; 2]> {
        let mut stream = STREAM.take().unwrap_or_default();
        let (weights, Range { start, end }) = (self.weights, self.rows.clone());
        let loss = Loss::new(simd, self.pair.row, weights);
        let mut memory = Memory::new(self.pair, self.rows, self.v);
        stream.begin(self.pair.row);
        let mut entering = start.saturating_sub(memory.reach()) as isize;
        while entering < (end + memory.reach()) as isize {
            stream.step(&loss, &mut memory, entering);
            entering += STEP as isize;
        }
        STREAM.set(Some(stream));
        memory.sums
    }
}

/// Constants of a band.
struct Loss<S: Simd> {
    simd: S,
    nest: Nest<S>,
    constants: Constants<S>,
    /// Pixels of a row.
    width: usize,
    /// Weight of SSIM's slopes, and of `|a - b|` in the gradient.
    weight: f32,
    absolute: V<S>,
    /// Scale of the slopes by p and m over that of the others.
    scale: V<S>,
}

impl<S: Simd> Loss<S> {
    #[inline(always)]
    fn new(simd: S, row: usize, [absolute, structural]: [f32; 2]) -> Self {
        Self {
            simd,
            nest: Nest::new(simd),
            constants: Constants::new(simd),
            width: row / CHANNELS,
            // Slopes are halves, in units of the windows' sums.
            weight: 2.0 * gain() as f32 * structural,
            absolute: splat(simd, absolute),
            scale: splat(simd, 1.0 / gain() as f32),
        }
    }
}

/// State and buffers between the images and the gradient.
#[derive(Default)]
struct Stream {
    /// State of the windows of p, m, p² and m² down columns, per sixteen floats of a row.
    down: Vec<[Past; 4]>,
    /// State of the windows of slopes down columns, per sixteen floats of a row.
    back_down: Vec<[Past; 3]>,
    /// Per sixteen floats of a row, p and m of the last rows that entered: their gradient comes with the next
    /// ones'.
    kept: Vec<[[Lanes; 2]; 2 * RADIUS]>,
    /// State of the windows of p, m, p² and m² along rows, per channel.
    along: [[Past; 4]; CHANNELS],
    /// State of the windows of slopes along rows, per channel.
    back_along: [[Past; 3]; CHANNELS],
    /// Per pixel and channel: p, m, p² and m², windowed down columns, then along rows; slopes; slopes,
    /// windowed along rows.
    cells: Cells,
    /// Slopes, windowed along rows, of pixels whose squares are not complete.
    waiting: Waiting,
    /// The images p and m of two blocks, per sixteen floats and row.
    images: [[[Square; 2]; CHANNELS]; 2],
    /// Sixteen floats of each row: of p, m, p² or m², windowed, or of the gradient.
    square: Square,
    /// Slopes of sixteen floats of each row.
    slopes: [[Lanes; 3]; STEP],
    /// The sum `Σ |a - b|` of each row.
    absolute: Square,
    /// The sum `Σ SSIM` of each row.
    similarity: [f64; STEP],
}

impl Stream {
    /// Clears the state for a new band.
    fn begin(&mut self, row: usize) {
        let blocks = row.div_ceil(CHANNELS * PIXELS);
        self.down.clear();
        self.down.resize(CHANNELS * blocks, Default::default());
        self.back_down.clear();
        self.back_down.resize(CHANNELS * blocks, Default::default());
        // What these hold of another band only reaches rows outside of this one.
        self.kept.resize(CHANNELS * blocks, Default::default());
    }

    /// Lets `STEP` rows enter.
    #[inline(always)]
    fn step<S: Simd>(&mut self, loss: &Loss<S>, memory: &mut Memory<'_>, entering: isize) {
        let [compared, leaving] = [1, 2].map(|k| entering - (k * RADIUS) as isize);
        let images = memory.images(entering);
        let needed = memory.needed(compared, memory.reach() - RADIUS);
        let weight = Lanes(std::array::from_fn(|row| if needed.contains(&row) { loss.weight } else { 0.0 }));
        (self.along, self.back_along, self.absolute, self.similarity) = Default::default();
        let columns = self.down.len();
        for first in (0..=columns).step_by(CHANNELS) {
            if first < columns {
                for column in first..first + CHANNELS {
                    self.enter(loss, &images, column);
                }
            } else {
                self.cells.as_flattened_mut().fill([Lanes::ZERO; 4]);
            }
            self.compare(loss, &weight, first / CHANNELS * PIXELS, memory.wanted());
            if memory.wanted() == Wanted::Gradient && first > 0 {
                for column in first - CHANNELS..first {
                    self.leave(loss, memory, leaving, column);
                }
            }
        }
        let absolute = self.absolute.map(|lanes| lanes.0.iter().map(|&v| f64::from(v)).sum());
        memory.set_sums(entering, 0, &absolute);
        memory.set_sums(compared, 1, &self.similarity);
    }

    /// Sixteen floats of the entering rows, windowed down their columns.
    #[inline(always)]
    fn enter<S: Simd>(&mut self, loss: &Loss<S>, images: &[[&[f32]; STEP]; 2], column: usize) {
        let (simd, at, [a, b]) = (loss.simd, BLOCK * column, images);
        let third = column % CHANNELS;
        let ([p, m], square) = (&mut self.images[column / CHANNELS % 2][third], &mut self.square);
        for row in 0..STEP {
            for index in 0..BLOCK / S::F32_LANES {
                let (a, b) = (read(simd, a[row], at, index), read(simd, b[row], at, index));
                let (difference, sum) = (a - b, self.absolute[row].get(simd, index));
                p[row].set(index, a + b);
                m[row].set(index, difference);
                self.absolute[row].set(index, sum + V { simd, value: simd.abs_f32s(difference.value) });
            }
        }
        let (past, out) =
            (&mut self.down[column], &mut self.cells.as_flattened_mut().as_chunks_mut().0[third]);
        ask(simd, images, 0..4, at);
        down::<S, false>(loss, p, &mut past[0], square);
        transpose(simd, square, 0, out);
        ask(simd, images, 4..8, at);
        down::<S, false>(loss, m, &mut past[1], square);
        transpose(simd, square, 1, out);
        ask(simd, images, 8..12, at);
        down::<S, true>(loss, p, &mut past[2], square);
        transpose(simd, square, 2, out);
        ask(simd, images, 12..16, at);
        down::<S, true>(loss, m, &mut past[3], square);
        transpose(simd, square, 3, out);
    }

    /// Windows along rows, turns means into SSIM, which is summed, and into slopes, which are windowed in
    /// turn.
    #[inline(always)]
    fn compare<S: Simd>(&mut self, loss: &Loss<S>, weight: &Lanes, pixel: usize, wanted: Wanted) {
        let (simd, cells) = (loss.simd, &mut self.cells);
        let [start, end] = [0, loss.width].map(|x| (x + RADIUS).saturating_sub(pixel).min(PIXELS));
        let mut inside = [0.0; PIXELS];
        inside[start..end].fill(1.0);
        let compared = ComparedPixels { constants: &loss.constants, inside: &inside };
        let mut totals = Lanes::ZERO;
        for channel in 0..CHANNELS {
            for index in 0..BLOCK / S::F32_LANES {
                for plane in 0..4 {
                    let mut line = Channel { cells: &mut *cells, channel, plane };
                    slide(simd, &loss.nest, &mut self.along[channel][plane], &mut line, index);
                }
                let total = compared.pixels(cells, channel, weight.get(simd, index), index);
                totals.set(index, totals.get(simd, index) + total);
            }
            if wanted == Wanted::Value {
                continue;
            }
            if end - start < PIXELS {
                for outside in [0..start, end..PIXELS] {
                    cells[outside].iter_mut().for_each(|pixel| pixel[channel] = Default::default());
                }
            }
            for index in 0..BLOCK / S::F32_LANES {
                for plane in 0..3 {
                    let slopes = Channel { cells: &mut *cells, channel, plane };
                    let mut line = Behind { slopes, waiting: &mut self.waiting };
                    line.begin(simd, index);
                    slide(simd, &loss.nest, &mut self.back_along[channel][plane], &mut line, index);
                }
            }
        }
        for (sum, total) in self.similarity.iter_mut().zip(totals.0) {
            *sum += f64::from(total);
        }
    }

    /// Windows slopes of sixteen floats down their columns, and writes their gradient.
    #[inline(always)]
    fn leave<S: Simd>(&mut self, loss: &Loss<S>, memory: &mut Memory<'_>, first: isize, column: usize) {
        let (simd, at, third) = (loss.simd, BLOCK * column, column % CHANNELS);
        let (past, cells) = (&mut self.back_down[column], &self.cells.as_flattened().as_chunks().0[third]);
        let ([p, m], kept) = (&self.images[column / CHANNELS % 2][third], &mut self.kept[column]);
        let Self { slopes, square, .. } = self;
        for plane in 0..3 {
            memory.ask(simd, first, STEP * plane / 3..STEP * (plane + 1) / 3, at);
            transpose(simd, &Plane { cells, plane: behind(plane) }, plane, slopes);
        }
        for index in 0..BLOCK / S::F32_LANES {
            for (plane, past) in past.iter_mut().enumerate() {
                slide(simd, &loss.nest, past, &mut Plane { cells: &mut *slopes, plane }, index);
            }
            for row in 0..2 * RADIUS {
                square[row].set(index, gradient(loss, [&kept[row][0], &kept[row][1]], &slopes[row], index));
            }
            for row in 0..WAITING {
                square[2 * RADIUS + row]
                    .set(index, gradient(loss, [&p[row], &m[row]], &slopes[2 * RADIUS + row], index));
            }
        }
        for row in 0..2 * RADIUS {
            kept[row] = [p[WAITING + row], m[WAITING + row]];
        }
        memory.write(first, at, square);
    }
}

/// Gradient from p and m, and from windowed slopes.
#[inline(always)]
fn gradient<S: Simd>(loss: &Loss<S>, image: [&Lanes; 2], by: &[Lanes; 3], index: usize) -> V<S> {
    let (simd, [p, m], [mean, sum, difference]) = (loss.simd, image, by);
    let by = [mean.get(simd, index), sum.get(simd, index), difference.get(simd, index)];
    slope([p.get(simd, index), m.get(simd, index)], by, loss.scale, loss.absolute)
}

/// Windows rows, or their squares, down columns.
#[inline(always)]
fn down<S: Simd, const SQUARED: bool>(loss: &Loss<S>, rows: &Square, past: &mut Past, square: &mut Square) {
    for index in 0..BLOCK / S::F32_LANES {
        slide(loss.simd, &loss.nest, past, &mut Rows::<SQUARED> { rows, square }, index);
    }
}
