//! The separable 11-tap Gaussian window of SSIM, over vectors in a row or in a column: eight results from eighteen inputs at a time, so
//! that an input is read once for all of them.

use crate::simd::{V, splat};
use pulp::Simd;

/// Taps on either side of the centre.
pub(crate) const RADIUS: usize = 5;
/// Taps of the window.
const SIZE: usize = 2 * RADIUS + 1;
/// Standard deviation, pixels.
const SIGMA: f64 = 1.5;
/// Results at a time.
pub(crate) const STEP: usize = 8;
/// Inputs that the windows of `STEP` results reach.
pub(crate) const SPAN: usize = STEP + 2 * RADIUS;

/// The normalised window.
pub(crate) fn weights() -> [f32; SIZE] {
    let raw: [f64; SIZE] = std::array::from_fn(|i| (-0.5 * ((i as f64 - RADIUS as f64) / SIGMA).powi(2)).exp());
    let total: f64 = raw.iter().sum();
    raw.map(|w| (w / total) as f32)
}

/// The window as vectors.
pub(crate) type Taps<S> = [V<S>; SIZE];

#[inline(always)]
pub(crate) fn taps<S: Simd>(simd: S) -> Taps<S> {
    let mut out = [splat(simd, 0.0); SIZE];
    for (out, weight) in out.iter_mut().zip(weights()) {
        *out = splat(simd, weight);
    }
    out
}

/// The window around each of the middle `STEP` inputs.
#[inline(always)]
pub(crate) fn windowed<S: Simd>(taps: &Taps<S>, inputs: &[V<S>; SPAN]) -> [V<S>; STEP] {
    let mut out = [taps[0]; STEP];
    for (i, out) in out.iter_mut().enumerate() {
        *out = *out * inputs[i];
    }
    for t in 1..SIZE {
        for (i, out) in out.iter_mut().enumerate() {
            *out = taps[t].mul_add(inputs[i + t], *out);
        }
    }
    out
}
