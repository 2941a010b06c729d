//! The photometric loss `(1 - λ) mean|a - b| + λ (1 - SSIM(a, b))` and its gradient by `a`, fused
//! (method §2.4).
//!
//! SSIM uses an 11×11 Gaussian window (σ = 1.5), zero padding, and averages over all pixels and channels. It
//! needs four windowed means: of a, b, a² + b² and ab (the two variances occur only as a sum). Its gradient
//! windows three maps again; the window is its own transpose.
//!
//! Bands of rows are streamed in parallel (`band`), so that images are read once, the gradient is
//! written once, and what lies between never leaves the cache. There is a band for each thread. Bands overlap
//! by recomputation, so that nothing that a row becomes depends on where its band begins; sums are kept per
//! row and added in order.

mod band;
mod compare;
mod lines;
mod memory;
mod pair;

use crate::window::STEP;
use lgs_core::{Image, psnr_of_mse};
use pulp::Arch;
use rayon::prelude::*;

use band::{Band, steps};
use pair::Pair;

/// Weight of the structural term in training.
pub const DEFAULT_LAMBDA: f32 = 0.2;
/// Fewest rows of a band: below this the overlap costs more than the parallelism gains.
const MIN_BAND_ROWS: usize = 48;

/// The photometric loss of a rendered image.
///
/// # Panics
/// If an image has not the number of pixels of `size`, width and height.
#[must_use]
pub fn photometric(rendered: &[[f32; 3]], target: &[[f32; 3]], size: [usize; 2], lambda: f32) -> f32 {
    let sums = Pair::new(rendered, target, size).sums();
    (1.0 - lambda) * sums.mean_absolute + lambda * (1.0 - sums.ssim)
}

/// The photometric loss and its gradient by the rendered image. [`PhotometricVjp::update`] does the same in
/// an array that is there.
///
/// # Panics
/// If an image has not the number of pixels of `size`, width and height.
#[must_use]
pub fn photometric_vjp(
    rendered: &[[f32; 3]],
    target: &[[f32; 3]],
    size: [usize; 2],
    lambda: f32,
) -> (f32, Vec<[f32; 3]>) {
    let mut out = PhotometricVjp::default();
    let loss = out.update(rendered, target, size, lambda);
    (loss, out.gradient)
}

/// The gradient of the photometric loss, in an array that is kept from call to call.
#[derive(Clone, Debug, Default)]
pub struct PhotometricVjp {
    /// Gradient by the rendered image.
    pub gradient: Vec<[f32; 3]>,
}

impl PhotometricVjp {
    /// Replaces the gradient by that of [`photometric_vjp`], and gives the loss.
    ///
    /// # Panics
    /// If an image has not the number of pixels of `size`, width and height.
    pub fn update(
        &mut self,
        rendered: &[[f32; 3]],
        target: &[[f32; 3]],
        size: [usize; 2],
        lambda: f32,
    ) -> f32 {
        let pair = Pair::new(rendered, target, size);
        self.gradient.resize(rendered.len(), [0.0; 3]);
        let sums = pair.sums_vjp(1.0 - lambda, -lambda, &mut self.gradient);
        (1.0 - lambda) * sums.mean_absolute + lambda * (1.0 - sums.ssim)
    }
}

/// Structural similarity of two images of one size, mean over pixels and channels.
///
/// # Panics
/// If the sizes differ.
#[must_use]
pub fn ssim(a: &Image, b: &Image) -> f32 {
    assert_eq!((a.width, a.height), (b.width, b.height), "sizes of the images");
    Pair::new(&a.pixels, &b.pixels, [a.width as usize, a.height as usize]).sums().ssim
}

/// Structural similarity and its gradient by `a`.
///
/// # Panics
/// If the sizes differ.
#[must_use]
pub fn ssim_vjp(a: &Image, b: &Image) -> (f32, Vec<[f32; 3]>) {
    assert_eq!((a.width, a.height), (b.width, b.height), "sizes of the images");
    let mut v = vec![[0.0; 3]; a.pixels.len()];
    let sums =
        Pair::new(&a.pixels, &b.pixels, [a.width as usize, a.height as usize]).sums_vjp(0.0, 1.0, &mut v);
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

/// Peak signal-to-noise ratio in decibels for a peak of 1, as [`psnr_of_mse`].
///
/// # Panics
/// If the sizes differ.
#[must_use]
pub fn psnr(a: &Image, b: &Image) -> f32 {
    psnr_of_mse(mse(a, b)) as f32
}

/// The two means that make the loss.
#[derive(Clone, Copy, Debug)]
struct Sums {
    mean_absolute: f32,
    ssim: f32,
}

impl Pair<'_> {
    /// Rows of a band: one per thread, of heights with which the threads have as few steps as can be, and
    /// finish together.
    fn band_rows(&self) -> usize {
        let least = MIN_BAND_ROWS.max(self.height.div_ceil(rayon::current_num_threads()));
        let most_steps = |rows: &usize| {
            (0..self.height).step_by(*rows).map(|start| steps(start, self.height.min(start + rows))).max()
        };
        (least..least + STEP).min_by_key(most_steps).unwrap_or(least)
    }

    fn sums(&self) -> Sums {
        let (arch, rows) = (Arch::new(), self.band_rows());
        let partial: Vec<Vec<[f64; 2]>> = (0..self.height.div_ceil(rows))
            .into_par_iter()
            .map(|band| {
                let rows = band * rows..self.height.min((band + 1) * rows);
                arch.dispatch(Band { pair: *self, rows, weights: [0.0; 2], v: &mut [] })
            })
            .collect();
        self.total(&partial)
    }

    /// Every value of `v` is replaced, by the gradient of `weight_absolute · mean|a - b| + weight_ssim ·
    /// SSIM`.
    fn sums_vjp(&self, weight_absolute: f32, weight_ssim: f32, v: &mut [[f32; 3]]) -> Sums {
        let (arch, rows) = (Arch::new(), self.band_rows());
        let weights = [weight_absolute, weight_ssim].map(|w| w / self.a.len().max(1) as f32);
        let partial: Vec<Vec<[f64; 2]>> = v
            .as_flattened_mut()
            .par_chunks_mut((rows * self.row).max(1))
            .enumerate()
            .map(|(band, v)| {
                let rows = band * rows..self.height.min((band + 1) * rows);
                arch.dispatch(Band { pair: *self, rows, weights, v })
            })
            .collect();
        self.total(&partial)
    }

    fn total(&self, partial: &[Vec<[f64; 2]>]) -> Sums {
        let total = partial.iter().flatten().fold([0.0, 0.0], |sum, row| [sum[0] + row[0], sum[1] + row[1]]);
        let count = self.a.len().max(1) as f64;
        Sums { mean_absolute: (total[0] / count) as f32, ssim: (total[1] / count) as f32 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pulp::{Scalar, Simd};

    #[test]
    fn feature_levels_differ_by_roundings() {
        let (width, height) = (100, 40);
        let image = |factor: usize| -> Vec<[f32; 3]> {
            (0..width * height)
                .map(|i| [0, 1, 2].map(|c| ((i * factor + 7 * c) % 97) as f32 / 97.0))
                .collect()
        };
        let (a, b) = (image(31), image(36));
        let run = |compute: &dyn Fn(Band<'_>) -> Vec<[f64; 2]>| {
            let mut v = vec![0.0; 3 * width * height];
            let sums = compute(Band {
                pair: Pair::new(&a, &b, [width, height]),
                rows: 0..height,
                weights: [0.8, -0.2],
                v: &mut v,
            });
            (sums, v)
        };
        let (sums, v) = run(&|band| Scalar.vectorize(band));
        let mut others = vec![run(&|band| Arch::new().dispatch(band))];
        #[cfg(target_arch = "x86_64")]
        others.extend(pulp::x86::V3::try_new().map(|simd| run(&|band| Simd::vectorize(simd, band))));
        for (other, v_other) in others {
            for (a, b) in sums.as_flattened().iter().zip(other.as_flattened()) {
                assert!((a - b).abs() < 1e-3, "{a} and {b} in a row");
            }
            let apart = v.iter().zip(&v_other).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            assert!(apart < 1e-5, "gradients are {apart} apart");
        }
    }
}
