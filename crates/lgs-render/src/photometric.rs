//! The photometric loss `(1 - λ) mean|a - b| + λ (1 - SSIM(a, b))` and its gradient by `a`, fused (`reference-systems` §2.5).
//!
//! SSIM uses an 11×11 Gaussian window (σ = 1.5), zero padding, and averages over all pixels and channels. It needs four windowed means:
//! of a, b, a² + b² and ab (the two variances occur only as a sum). Its gradient windows three maps again; the window is its own transpose.
//!
//! Rows are processed interleaved as they are stored, a step of one pixel being three floats. Each chunk of rows streams through two rings
//! of 11 rows, windowed horizontally on entry and vertically on exit, so that images are read once and the gradient is written once.
//! Chunks overlap by recomputation and depend on the height only; sums are kept per row and added in order.

use crate::window::{RADIUS, Ring, SIZE, horizontal, padded_len, vertical, weights};
use lgs_core::Image;
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

/// Weight of the structural term in training.
pub const DEFAULT_LAMBDA: f32 = 0.2;
/// `(0.01 L)²` for a dynamic range of 1.
const C1: f32 = 1e-4;
/// `(0.03 L)²` for a dynamic range of 1.
const C2: f32 = 9e-4;
/// Fewest rows of a chunk: below this the overlap costs more than the parallelism gains.
const MIN_CHUNK_ROWS: usize = 40;

/// The photometric loss of a rendered image.
///
/// # Panics
/// If an image has not `width · height` pixels.
#[must_use]
pub fn photometric(rendered: &[[f32; 3]], target: &[[f32; 3]], width: usize, height: usize, lambda: f32) -> f32 {
    let sums = Pair::new(rendered, target, width, height).sums();
    (1.0 - lambda) * sums.mean_absolute + lambda * (1.0 - sums.ssim)
}

/// The photometric loss and its gradient by the rendered image.
///
/// # Panics
/// If an image has not `width · height` pixels.
#[must_use]
pub fn photometric_vjp(rendered: &[[f32; 3]], target: &[[f32; 3]], width: usize, height: usize, lambda: f32) -> (f32, Vec<[f32; 3]>) {
    let (sums, v) = Pair::new(rendered, target, width, height).sums_vjp(1.0 - lambda, -lambda);
    ((1.0 - lambda) * sums.mean_absolute + lambda * (1.0 - sums.ssim), v)
}

/// Structural similarity of two images of one size, mean over pixels and channels.
///
/// # Panics
/// If the sizes differ.
#[must_use]
pub fn ssim(a: &Image, b: &Image) -> f32 {
    assert_eq!((a.width, a.height), (b.width, b.height), "sizes of the images");
    Pair::new(&a.pixels, &b.pixels, a.width as usize, a.height as usize).sums().ssim
}

/// Structural similarity and its gradient by `a`.
///
/// # Panics
/// If the sizes differ.
#[must_use]
pub fn ssim_vjp(a: &Image, b: &Image) -> (f32, Vec<[f32; 3]>) {
    assert_eq!((a.width, a.height), (b.width, b.height), "sizes of the images");
    let (sums, v) = Pair::new(&a.pixels, &b.pixels, a.width as usize, a.height as usize).sums_vjp(0.0, 1.0);
    (sums.ssim, v)
}

/// Mean squared error over pixels and channels, as float64; 0 for empty images.
///
/// # Panics
/// If the sizes differ.
#[must_use]
pub fn mse(a: &Image, b: &Image) -> f64 {
    assert_eq!((a.width, a.height), (b.width, b.height), "sizes of the images");
    let (x, y) = (a.pixels.as_flattened(), b.pixels.as_flattened());
    let total: f64 = x.iter().zip(y).map(|(x, y)| f64::from(x - y).powi(2)).sum();
    total / x.len().max(1) as f64
}

/// Peak signal-to-noise ratio in decibels for a peak of 1; infinite for equal images.
///
/// # Panics
/// If the sizes differ.
#[must_use]
pub fn psnr(a: &Image, b: &Image) -> f32 {
    (-10.0 * mse(a, b).log10()) as f32
}

/// The two means that make the loss.
#[derive(Clone, Copy, Debug)]
struct Sums {
    mean_absolute: f32,
    ssim: f32,
}

/// Two images as interleaved rows.
#[derive(Clone, Copy)]
struct Pair<'a> {
    a: &'a [f32],
    b: &'a [f32],
    /// Floats of a row: three times the width.
    row: usize,
    height: usize,
}

impl<'a> Pair<'a> {
    fn new(a: &'a [[f32; 3]], b: &'a [[f32; 3]], width: usize, height: usize) -> Self {
        assert_eq!(a.len(), width * height, "pixels of the first image");
        assert_eq!(b.len(), width * height, "pixels of the second image");
        Self { a: a.as_flattened(), b: b.as_flattened(), row: 3 * width, height }
    }

    fn chunk_rows(&self) -> usize {
        MIN_CHUNK_ROWS.max(self.height.div_ceil(16))
    }

    fn sums(&self) -> Sums {
        let (arch, rows) = (Arch::new(), self.chunk_rows());
        let partial: Vec<Vec<[f64; 2]>> = (0..self.height.div_ceil(rows))
            .into_par_iter()
            .map(|c| arch.dispatch(Chunk { pair: *self, rows: c * rows..self.height.min((c + 1) * rows), weights: [0.0; 2], v: &mut [] }))
            .collect();
        self.total(&partial)
    }

    /// The gradient is that of `weight_absolute · mean|a - b| + weight_ssim · SSIM`.
    fn sums_vjp(&self, weight_absolute: f32, weight_ssim: f32) -> (Sums, Vec<[f32; 3]>) {
        let (arch, rows) = (Arch::new(), self.chunk_rows());
        let mut v = vec![[0.0; 3]; self.a.len() / 3];
        let weights = [weight_absolute, weight_ssim].map(|w| w / self.a.len().max(1) as f32);
        let partial: Vec<Vec<[f64; 2]>> = v
            .as_flattened_mut()
            .par_chunks_mut((rows * self.row).max(1))
            .enumerate()
            .map(|(c, v)| arch.dispatch(Chunk { pair: *self, rows: c * rows..self.height.min((c + 1) * rows), weights, v }))
            .collect();
        (self.total(&partial), v)
    }

    fn total(&self, partial: &[Vec<[f64; 2]>]) -> Sums {
        let total = partial.iter().flatten().fold([0.0, 0.0], |sum, row| [sum[0] + row[0], sum[1] + row[1]]);
        let count = self.a.len().max(1) as f64;
        Sums { mean_absolute: (total[0] / count) as f32, ssim: (total[1] / count) as f32 }
    }
}

/// Some rows of a pair of images, streamed; returns the sums of each row.
struct Chunk<'a> {
    pair: Pair<'a>,
    rows: std::ops::Range<usize>,
    /// Of the two terms in the gradient, per value.
    weights: [f32; 2],
    /// Gradient of the rows; empty if not asked for.
    v: &'a mut [f32],
}

impl WithSimd for Chunk<'_> {
    type Output = Vec<[f64; 2]>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Vec<[f64; 2]> {
        let Self { pair, rows, weights: terms, v } = self;
        let window = weights();
        let row = pair.row;
        let mut means = Ring::<4>::new(row);
        let mut slopes = Ring::<3>::new(row);
        let mut wide = vec![0.0; padded_len(row)];
        let mut map: [Vec<f32>; 4] = std::array::from_fn(|_| vec![0.0; Ring::<4>::stride(row)]);
        let mut out = Vec::with_capacity(rows.len());
        // Rows whose windowed means are needed: with a gradient, the neighbours' as well.
        let margin = if v.is_empty() { 0 } else { RADIUS };
        let mut entered = rows.start.saturating_sub(margin + RADIUS);
        for shifted in rows.start..rows.end + 2 * margin {
            // `shifted - margin` is the row whose means are complete, `shifted - 2 margin` that whose gradient is.
            if let Some(y) = shifted.checked_sub(margin).filter(|&y| y < pair.height) {
                while entered < pair.height.min(y + RADIUS + 1) {
                    enter(simd, &pair, entered, &window, &mut wide, &mut means);
                    entered += 1;
                }
                for (plane, target) in map.iter_mut().enumerate() {
                    vertical(simd, &window, &means.around(plane, y, pair.height), target);
                }
                let ssim = similarity(&mut map, row);
                if rows.contains(&y) {
                    out.push([absolute_difference(&pair, y), ssim]);
                }
                if margin > 0 {
                    for (plane, source) in map[..3].iter().enumerate() {
                        wide[3 * RADIUS..3 * RADIUS + row].copy_from_slice(&source[..row]);
                        horizontal(simd, &window, &wide, slopes.row_mut(plane, y));
                    }
                }
            }
            if let Some(y) = shifted.checked_sub(2 * margin).filter(|&y| margin > 0 && rows.contains(&y)) {
                for (plane, target) in map[..3].iter_mut().enumerate() {
                    vertical(simd, &window, &slopes.around(plane, y, pair.height), target);
                }
                let at = (y - rows.start) * row;
                gradient(&pair, y, &map, terms, &mut v[at..at + row]);
            }
        }
        out
    }
}

/// Reads a row of both images, windows its four products horizontally and puts them into the ring.
#[inline(always)]
fn enter<S: Simd>(simd: S, pair: &Pair, y: usize, window: &[f32; SIZE], wide: &mut [f32], means: &mut Ring<4>) {
    let (a, b) = (&pair.a[y * pair.row..][..pair.row], &pair.b[y * pair.row..][..pair.row]);
    let inner = 3 * RADIUS..3 * RADIUS + pair.row;
    wide[inner.clone()].copy_from_slice(a);
    horizontal(simd, window, wide, means.row_mut(0, y));
    wide[inner.clone()].copy_from_slice(b);
    horizontal(simd, window, wide, means.row_mut(1, y));
    combine(&mut wide[inner.clone()], a, b, |a, b| a.mul_add(a, b * b));
    horizontal(simd, window, wide, means.row_mut(2, y));
    combine(&mut wide[inner], a, b, |a, b| a * b);
    horizontal(simd, window, wide, means.row_mut(3, y));
}

#[inline(always)]
fn combine(out: &mut [f32], a: &[f32], b: &[f32], f: impl Fn(f32, f32) -> f32) {
    for ((out, &a), &b) in out.iter_mut().zip(a).zip(b) {
        *out = f(a, b);
    }
}

/// Turns a row of the windowed means of a, b, a² + b², ab into the slopes of SSIM by the means of a, a² and ab; returns its sum.
#[inline(always)]
fn similarity(map: &mut [Vec<f32>; 4], row: usize) -> f64 {
    let [p0, p1, p2, p3] = map;
    let (p0, p1, p2, p3) = (&mut p0[..row], &mut p1[..row], &mut p2[..row], &mut p3[..row]);
    for i in 0..row {
        let (a, b, squares, product) = (p0[i], p1[i], p2[i], p3[i]);
        let (aa_bb, ab) = (a.mul_add(a, b * b), a * b);
        let (n1, n2) = (2.0f32.mul_add(ab, C1), 2.0f32.mul_add(product - ab, C2));
        let (d1, d2) = (aa_bb + C1, squares - aa_bb + C2);
        let inverse = 1.0 / (d1 * d2);
        let s = n1 * n2 * inverse;
        // s / d1 and s / d2 without two more divisions.
        let (by_d1, by_d2) = (s * d2 * inverse, s * d1 * inverse);
        p0[i] = 2.0 * (b * inverse * (n2 - n1) + a * (by_d2 - by_d1));
        p1[i] = -by_d2;
        p2[i] = 2.0 * n1 * inverse;
        p3[i] = s;
    }
    lane_sum(p3)
}

/// `Σ |a - b|` over a row.
#[inline(always)]
fn absolute_difference(pair: &Pair, y: usize) -> f64 {
    let (a, b) = (&pair.a[y * pair.row..][..pair.row], &pair.b[y * pair.row..][..pair.row]);
    let mut lanes = [0.0_f32; 16];
    let (a_blocks, b_blocks) = (a.as_chunks::<16>(), b.as_chunks::<16>());
    for (a, b) in a_blocks.0.iter().zip(b_blocks.0) {
        for i in 0..16 {
            lanes[i] += (a[i] - b[i]).abs();
        }
    }
    let tail: f32 = a_blocks.1.iter().zip(b_blocks.1).map(|(a, b)| (a - b).abs()).sum();
    lanes.iter().map(|&v| f64::from(v)).sum::<f64>() + f64::from(tail)
}

#[inline(always)]
fn lane_sum(values: &[f32]) -> f64 {
    let (blocks, tail) = values.as_chunks::<16>();
    let mut lanes = [0.0_f32; 16];
    for block in blocks {
        for i in 0..16 {
            lanes[i] += block[i];
        }
    }
    lanes.iter().chain(tail).map(|&v| f64::from(v)).sum()
}

/// Gradient of a row from the windowed slopes.
#[inline(always)]
fn gradient(pair: &Pair, y: usize, map: &[Vec<f32>; 4], [weight_absolute, weight_ssim]: [f32; 2], v: &mut [f32]) {
    let row = v.len();
    let (a, b) = (&pair.a[y * row..][..row], &pair.b[y * row..][..row]);
    let [mean, square, product, _] = map;
    let (mean, square, product) = (&mean[..row], &square[..row], &product[..row]);
    for i in 0..row {
        let sign = f32::from(u8::from(a[i] > b[i])) - f32::from(u8::from(a[i] < b[i]));
        let structure = (2.0 * a[i]).mul_add(square[i], b[i].mul_add(product[i], mean[i]));
        v[i] = weight_ssim.mul_add(structure, weight_absolute * sign);
    }
}
