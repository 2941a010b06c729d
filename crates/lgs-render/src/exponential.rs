//! The exponential that blending is made of.

use pulp::Simd;

/// Minimax polynomial of 2^x on [-1/2, 1/2], degree 5: relative error below 7.5e-8 before rounding (Remez,
/// computed in float64).
const EXP2: [f32; 6] = [1.0, 0.693_146_97, 0.240_221_2, 0.055_507_133, 0.009_675_541, 0.001_327_647_2];

/// `1.5 · 2²³`: adding it rounds a small float to the nearest integer, which then sits in the low mantissa
/// bits.
const ROUNDING: f32 = 12_582_912.0;

/// `2^x` for `-126 ≤ x ≤ 126` within 3e-7 relative; anything outside.
#[inline(always)]
#[must_use]
pub fn exp2<S: Simd>(simd: S, x: S::f32s) -> S::f32s {
    let shifted = simd.add_f32s(x, simd.splat_f32s(ROUNDING));
    let fraction = simd.sub_f32s(x, simd.sub_f32s(shifted, simd.splat_f32s(ROUNDING)));
    let mut p = simd.splat_f32s(EXP2[5]);
    for &c in EXP2[..5].iter().rev() {
        p = simd.mul_add_f32s(p, fraction, simd.splat_f32s(c));
    }
    let exponent = simd.wrapping_dyn_shl_u32s(simd.transmute_u32s_f32s(shifted), simd.splat_u32s(23));
    simd.transmute_f32s_u32s(simd.add_u32s(simd.transmute_u32s_f32s(p), exponent))
}
