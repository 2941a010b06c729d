//! SSIM and its slopes from windowed means.
//!
//! Of the sum `p = a + b` and the difference `m = a - b`: with means P and M, and variances about them,
//! `2 μa μb = (P² - M²) / 2`, `μa² + μb² = (P² + M²) / 2`, and the same for the variances. The halves cancel in SSIM.

use crate::cells::Row;
use crate::simd::{BLOCK, Lanes, V, reciprocal, splat};
use crate::window::{RADIUS, SPAN, STEP, Taps, windowed};
use pulp::Simd;

/// `2 (0.01 L)²` for a dynamic range of 1.
const C1: f32 = 2e-4;
/// `2 (0.03 L)²` for a dynamic range of 1.
const C2: f32 = 1.8e-3;

/// The window along a row around `STEP` cells.
#[inline(always)]
fn along<S: Simd, const PLANES: usize>(
    simd: S,
    taps: &Taps<S>,
    reach: &[[Lanes; PLANES]; SPAN],
    plane: usize,
    index: usize,
) -> [V<S>; STEP] {
    let mut inputs = [splat(simd, 0.0); SPAN];
    for (input, planes) in inputs.iter_mut().zip(reach) {
        *input = planes[plane].get(simd, index);
    }
    windowed(taps, &inputs)
}

/// Windows a row.
#[inline(always)]
pub(crate) fn window_row<S: Simd>(simd: S, taps: &Taps<S>, row: &Row<3>, out: &mut Row<3>) {
    for (block, out) in out.as_chunks_mut::<STEP>().0.iter_mut().enumerate() {
        let reach = row[block * STEP..].first_chunk().expect("margins");
        for plane in 0..3 {
            for index in 0..BLOCK / S::F32_LANES {
                let means = along(simd, taps, reach, plane, index);
                for (i, out) in out.iter_mut().enumerate() {
                    out[plane].set(index, means[i]);
                }
            }
        }
    }
}

/// Windows means along a row, `STEP` cells from `first` on; adds up SSIM, and gives the slopes.
#[inline(always)]
pub(crate) fn compare_cells<S: Simd>(
    simd: S,
    taps: &Taps<S>,
    (means, first): (&Row<4>, usize),
    inside: &[Lanes],
    slopes: &mut Row<3>,
    ssim: &mut Lanes,
) {
    let reach = means[first..].first_chunk().expect("margins");
    let slopes: &mut [_; STEP] = slopes[RADIUS + first..].first_chunk_mut().expect("margins");
    for index in 0..BLOCK / S::F32_LANES {
        let (p, m) = (along(simd, taps, reach, 0, index), along(simd, taps, reach, 1, index));
        let (squares_p, squares_m) = (along(simd, taps, reach, 2, index), along(simd, taps, reach, 3, index));
        let mut total = ssim.get(simd, index);
        for (i, (slopes, inside)) in slopes.iter_mut().zip(&inside[first..]).enumerate() {
            let (s, by) = compare([p[i], m[i], squares_p[i], squares_m[i]], inside.get(simd, index));
            total = total + s;
            slopes[0].set(index, by[0]);
            slopes[1].set(index, by[1]);
            slopes[2].set(index, by[2]);
        }
        ssim.set(index, total);
    }
}

/// SSIM from the windowed means of p, m, p² and m², and half of its slopes by those of p (with that of m), of p², and, negated, of m²; zero
/// where `inside` is.
#[inline(always)]
fn compare<S: Simd>([p, m, squares_p, squares_m]: [V<S>; 4], inside: V<S>) -> (V<S>, [V<S>; 3]) {
    let p_c = p.mul_add(p, p.of(C1));
    let (n1, d1) = (m.negate_mul_add(m, p_c), m.mul_add(m, p_c));
    let (q, r) = (p.negate_mul_add(p, squares_p + p.of(C2)), m.negate_mul_add(m, squares_m));
    let (n2, d2) = (q - r, q + r);
    let inverse = V { simd: p.simd, value: reciprocal(p.simd, (d1 * d2).value) } * inside;
    let s = n1 * n2 * inverse;
    let (u1, v1) = (s.negate_mul_add(d1, n1), s.mul_add(d1, n1));
    let (u2, v2) = (s.negate_mul_add(d2, n2), s.mul_add(d2, n2));
    let by_mean = m.mul_add(v1 - v2, p * (u2 - u1));
    (s, [by_mean * inverse, u1 * inverse, v1 * inverse])
}

/// The gradient from the slopes, windowed with twice the weight of SSIM.
#[inline(always)]
pub(crate) fn slope<S: Simd>(simd: S, [p, m]: [V<S>; 2], [mean, by_sum, by_difference]: [V<S>; 3], weight_absolute: f32) -> V<S> {
    let (absolute, zero) = (splat(simd, weight_absolute), splat(simd, 0.0));
    let above = absolute.where_set(simd.greater_than_f32s(m.value, zero.value), zero);
    let sign = (-absolute).where_set(simd.less_than_f32s(m.value, zero.value), above);
    m.negate_mul_add(by_difference, p.mul_add(by_sum, mean)) + sign
}
