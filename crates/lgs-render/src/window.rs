//! The separable 11-tap Gaussian window of SSIM over interleaved RGB rows, and the rings of rows it slides over.

use crate::simd::fma;
use pulp::Simd;

/// Taps on either side of the centre.
pub(crate) const RADIUS: usize = 5;
/// Taps of the window.
pub(crate) const SIZE: usize = 2 * RADIUS + 1;
/// Standard deviation, pixels.
const SIGMA: f64 = 1.5;
/// Rows are padded to whole vectors of the widest kind.
const BLOCK: usize = 16;
/// Bytes.
const CACHE_LINE: usize = 64;

/// The normalised window.
pub(crate) fn weights() -> [f32; SIZE] {
    let raw: [f64; SIZE] = std::array::from_fn(|i| (-0.5 * ((i as f64 - RADIUS as f64) / SIGMA).powi(2)).exp());
    let total: f64 = raw.iter().sum();
    raw.map(|w| (w / total) as f32)
}

/// Length of a buffer that holds a row with `RADIUS` pixels of padding on both sides and room for whole vectors.
pub(crate) fn padded_len(row: usize) -> usize {
    row.next_multiple_of(BLOCK) + 6 * RADIUS
}

/// The last 11 rows of `PLANES` planes, addressed by image row.
pub(crate) struct Ring<const PLANES: usize> {
    stride: usize,
    /// Where the first row starts: on a cache line, or every vector load would touch two.
    base: usize,
    /// `SIZE · PLANES` rows and one of zeros, which stands for rows outside of the image.
    values: Vec<f32>,
}

impl<const PLANES: usize> Ring<PLANES> {
    pub(crate) fn stride(row: usize) -> usize {
        row.next_multiple_of(BLOCK)
    }

    pub(crate) fn new(row: usize) -> Self {
        let stride = Self::stride(row);
        let values = vec![0.0; stride * (SIZE * PLANES + 1) + BLOCK];
        let base = values.as_ptr().align_offset(CACHE_LINE).min(BLOCK);
        Self { stride, base, values }
    }

    fn start(&self, plane: usize, y: usize) -> usize {
        self.base + (plane * SIZE + y % SIZE) * self.stride
    }

    pub(crate) fn row_mut(&mut self, plane: usize, y: usize) -> &mut [f32] {
        let start = self.start(plane, y);
        &mut self.values[start..start + self.stride]
    }

    /// The 11 rows around `y`.
    pub(crate) fn around(&self, plane: usize, y: usize, height: usize) -> [&[f32]; SIZE] {
        std::array::from_fn(|tap| {
            let inside = (y + tap).checked_sub(RADIUS).filter(|&source| source < height);
            let start = inside.map_or(self.base + SIZE * PLANES * self.stride, |source| self.start(plane, source));
            &self.values[start..start + self.stride]
        })
    }
}

/// Windows a padded row into `out`, a pixel being three floats.
#[inline(always)]
pub(crate) fn horizontal<S: Simd>(simd: S, window: &[f32; SIZE], padded: &[f32], out: &mut [f32]) {
    let length = out.len();
    let shifted: [&[f32]; SIZE] = std::array::from_fn(|tap| &padded[3 * tap..3 * tap + length]);
    vertical(simd, window, &shifted, out);
}

/// `Σ window[tap] · rows[tap]`, the window being symmetric; all rows have the length of `out`, a multiple of 16.
#[inline(always)]
pub(crate) fn vertical<S: Simd>(simd: S, window: &[f32; SIZE], rows: &[&[f32]; SIZE], out: &mut [f32]) {
    let out = S::as_mut_simd_f32s(out).0;
    let [r0, r1, r2, r3, r4, r5, r6, r7, r8, r9, r10] = rows;
    let (r0, r1, r2) = (vectors::<S>(r0, out.len()), vectors::<S>(r1, out.len()), vectors::<S>(r2, out.len()));
    let (r3, r4, r5) = (vectors::<S>(r3, out.len()), vectors::<S>(r4, out.len()), vectors::<S>(r5, out.len()));
    let (r6, r7, r8) = (vectors::<S>(r6, out.len()), vectors::<S>(r7, out.len()), vectors::<S>(r8, out.len()));
    let (r9, r10) = (vectors::<S>(r9, out.len()), vectors::<S>(r10, out.len()));
    let (w0, w1, w2) = (simd.splat_f32s(window[0]), simd.splat_f32s(window[1]), simd.splat_f32s(window[2]));
    let (w3, w4, w5) = (simd.splat_f32s(window[3]), simd.splat_f32s(window[4]), simd.splat_f32s(window[5]));
    for (i, out) in out.iter_mut().enumerate() {
        let mut sum = simd.mul_f32s(w5, r5[i]);
        sum = fma(simd, w0, simd.add_f32s(r0[i], r10[i]), sum);
        sum = fma(simd, w1, simd.add_f32s(r1[i], r9[i]), sum);
        sum = fma(simd, w2, simd.add_f32s(r2[i], r8[i]), sum);
        sum = fma(simd, w3, simd.add_f32s(r3[i], r7[i]), sum);
        *out = fma(simd, w4, simd.add_f32s(r4[i], r6[i]), sum);
    }
}

/// The first `count` vectors of a row, so that the loop above needs no further bounds checks.
#[inline(always)]
fn vectors<S: Simd>(row: &[f32], count: usize) -> &[S::f32s] {
    &S::as_simd_f32s(row).0[..count]
}
