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

/// The window as vectors, from its edge to its centre; the other half is the same.
pub(crate) type Taps<S> = [V<S>; RADIUS + 1];

/// The window times a factor.
#[inline(always)]
pub(crate) fn taps<S: Simd>(simd: S, scale: f32) -> Taps<S> {
    let mut out = [splat(simd, 0.0); RADIUS + 1];
    for (out, weight) in out.iter_mut().zip(weights()) {
        *out = splat(simd, scale * weight);
    }
    out
}

/// Adds a tap's products to all sums, tap by tap, so that no sum waits for another. Written out, because the compiler keeps sums in registers only
/// where every index is a constant.
macro_rules! add_taps {
    ($taps:ident, $inputs:ident, $out:ident: $($tap:literal)+) => {$(
        add_taps!(@ $taps, $inputs, $out, $tap: 0 1 2 3 4 5 6 7);
    )+};
    (@ $taps:ident, $inputs:ident, $out:ident, $tap:literal: $($sum:literal)+) => {$(
        $out[$sum] = $taps[RADIUS - ($tap - RADIUS as isize).unsigned_abs()].mul_add($inputs[$tap + $sum], $out[$sum]);
    )+};
}

/// The window around each of the middle `STEP` inputs.
#[inline(always)]
pub(crate) fn windowed<S: Simd>(taps: &Taps<S>, inputs: &[V<S>; SPAN]) -> [V<S>; STEP] {
    let mut out = [splat(taps[0].simd, 0.0); STEP];
    add_taps!(taps, inputs, out: 0 1 2 3 4 5 6 7 8 9 10);
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use pulp::{Scalar, WithSimd};

    struct Window([f32; SPAN]);

    impl WithSimd for Window {
        type Output = [f32; STEP];

        fn with_simd<S: Simd>(self, simd: S) -> [f32; STEP] {
            let inputs = self.0.map(|value| splat(simd, value));
            windowed(&taps(simd, 1.0), &inputs).map(|mean| simd.reduce_sum_f32s(mean.value) / S::F32_LANES as f32)
        }
    }

    #[test]
    fn every_mean_weighs_the_inputs_around_it() {
        let inputs: [f32; SPAN] = std::array::from_fn(|i| ((i * 37) % 17) as f32 - 5.0);
        let means = Scalar.vectorize(Window(inputs));
        for (i, mean) in means.iter().enumerate() {
            let expected: f32 = weights().iter().zip(&inputs[i..]).map(|(w, x)| w * x).sum();
            assert!((mean - expected).abs() < 1e-5, "{mean} for {expected}");
        }
    }
}
