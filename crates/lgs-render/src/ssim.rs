//! SSIM and its slopes from windowed values.
//!
//! Of the sum `p = a + b` and the difference `m = a - b`: with means P and M, and variances about them, `2 μa
//! μb = (P² - M²) / 2`, `μa² + μb² = (P² + M²) / 2`, and the same for the variances. The halves cancel in
//! SSIM.
//!
//! Windows give sums that are `gain` times a mean (`window`), so that here all terms of SSIM are `gain²`
//! times theirs, which cancels as well.

use crate::pack::Pack;
use crate::simd::{V, splat};
use crate::window;
use pulp::Simd;

/// `2 (0.01 L)²` for a dynamic range of 1.
const C1: f64 = 2e-4;
/// `2 (0.03 L)²` for a dynamic range of 1.
const C2: f64 = 1.8e-3;

/// Sums of a window, along rows and columns, over a mean.
pub(crate) fn gain() -> f64 {
    window::gain().powi(2)
}

/// Constants of SSIM in units of the windows' sums.
#[derive(Clone, Copy)]
pub(crate) struct Constants<S: Simd> {
    gain: V<S>,
    c1: V<S>,
    c2: V<S>,
}

impl<S: Simd> Constants<S> {
    #[inline(always)]
    pub(crate) fn new(simd: S) -> Self {
        let gain = gain();
        Self {
            gain: splat(simd, gain as f32),
            c1: splat(simd, (gain * gain * C1) as f32),
            c2: splat(simd, (gain * gain * C2) as f32),
        }
    }
}

/// SSIM from the windowed sums of p, m, p² and m²; and, times `weight`, half of its slopes by those of p
/// (with that of m), and, over the gain, by those of p² and, negated, of m².
#[inline(always)]
pub(crate) fn compare<S: Simd, const N: usize>(
    constants: &Constants<S>,
    [p, m, squares_p, squares_m]: [Pack<S, N>; 4],
    weight: V<S>,
) -> (Pack<S, N>, [Pack<S, N>; 3]) {
    let [gain, c1, c2] = [constants.gain, constants.c1, constants.c2].map(|v| Pack([v; N]));
    let (p_c, m_m) = (p.mul_add(p, c1), m * m);
    let (n1, d1) = (p_c - m_m, p_c + m_m);
    let (q, r) = (p.negate_mul_add(p, squares_p.mul_add(gain, c2)), m.negate_mul_add(m, squares_m * gain));
    let (n2, d2) = (q - r, q + r);
    let inverse = (d1 * d2).reciprocal();
    let s = n1 * n2 * inverse;
    let (u1, v1) = (s.negate_mul_add(d1, n1), s.mul_add(d1, n1));
    let (u2, v2) = (s.negate_mul_add(d2, n2), s.mul_add(d2, n2));
    let by_mean = m.mul_add(v1 - v2, p * (u2 - u1));
    let weighted = inverse * Pack([weight; N]);
    (s, [by_mean * weighted, u1 * weighted, v1 * weighted])
}

/// The gradient from the windowed slopes.
///
/// `scale` is that of the slopes by p and m over that of the others.
#[inline(always)]
pub(crate) fn slope<S: Simd>(
    [p, m]: [V<S>; 2],
    [mean, by_sum, by_difference]: [V<S>; 3],
    scale: V<S>,
    weight_absolute: V<S>,
) -> V<S> {
    // The sign of m times the weight; zero where m is.
    let (simd, zero) = (p.simd, p.of(0.0));
    let sign = simd.and_u32s(simd.transmute_u32s_f32s(m.value), simd.splat_u32s(1 << 31));
    let signed =
        simd.transmute_f32s_u32s(simd.xor_u32s(sign, simd.transmute_u32s_f32s(weight_absolute.value)));
    let same = simd.equal_f32s(m.value, zero.value);
    let sign = zero.where_set(same, V { simd, value: signed });
    m.negate_mul_add(by_difference, p.mul_add(by_sum, mean.mul_add(scale, sign)))
}
