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

#[inline(always)]
pub(crate) fn taps<S: Simd>(simd: S) -> Taps<S> {
    let mut out = [splat(simd, 0.0); RADIUS + 1];
    for (out, weight) in out.iter_mut().zip(weights()) {
        *out = splat(simd, weight);
    }
    out
}

/// Adds inputs, by number, to the sums they belong to. Written out, because the compiler keeps sums in registers only where every index is a
/// constant.
macro_rules! add_inputs {
    ($taps:ident, $inputs:ident, $out:ident: $($input:literal to $($sum:literal)+;)+) => {$($(
        $out[$sum] = $taps[RADIUS - ($input - $sum - RADIUS as isize).unsigned_abs()].mul_add($inputs[$input], $out[$sum]);
    )+)+};
}

/// The window around each of the middle `STEP` inputs. Input by input, so that one is loaded once for all of its sums.
#[inline(always)]
#[rustfmt::skip]
pub(crate) fn windowed<S: Simd>(taps: &Taps<S>, inputs: &[V<S>; SPAN]) -> [V<S>; STEP] {
    let mut out = [splat(taps[0].simd, 0.0); STEP];
    add_inputs!(taps, inputs, out:
        0 to 0; 1 to 0 1; 2 to 0 1 2; 3 to 0 1 2 3; 4 to 0 1 2 3 4; 5 to 0 1 2 3 4 5; 6 to 0 1 2 3 4 5 6;
        7 to 0 1 2 3 4 5 6 7; 8 to 0 1 2 3 4 5 6 7; 9 to 0 1 2 3 4 5 6 7; 10 to 0 1 2 3 4 5 6 7;
        11 to 1 2 3 4 5 6 7; 12 to 2 3 4 5 6 7; 13 to 3 4 5 6 7; 14 to 4 5 6 7; 15 to 5 6 7; 16 to 6 7; 17 to 7;
    );
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
            windowed(&taps(simd), &inputs).map(|mean| simd.reduce_sum_f32s(mean.value) / S::F32_LANES as f32)
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
