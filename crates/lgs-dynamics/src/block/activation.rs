//! SiLU with its first two derivatives as ends of matrix products, and softplus.
//!
//! `φ(z) = z s`, `φ' = s (1 + z (1 − s))`, `φ'' = s (1 − s) (2 + z (1 − 2 s))` with `s = sigmoid(z)`
//! (reference §8.3). The exponential is a polynomial of degree 5 after reduction to powers of two (relative
//! error below 3e-7).

use crate::block::product::{Epilogue, vector, vector_at};
use pulp::Simd;

/// Minimax polynomial of 2^x on ±½: relative error below 7.5e-8 before rounding.
const EXP2: [f32; 6] = [1.0, 0.693_146_97, 0.240_221_2, 0.055_507_133, 0.009_675_541, 0.001_327_647_2];

/// `1.5 · 2²³`: adding it leaves the rounded integer in the low bits.
const ROUNDING: f32 = 12_582_912.0;

/// Beyond this |z| the sigmoid is 0 or 1 to the last digit, and its exponential still a normal number.
const SATURATED: f32 = 87.0;

#[inline(always)]
fn sigmoid<S: Simd>(simd: S, z: S::f32s) -> S::f32s {
    let x = simd.max_f32s(simd.splat_f32s(-SATURATED), simd.min_f32s(simd.splat_f32s(SATURATED), z));
    let (log2_e, rounding, one) =
        (simd.splat_f32s(-std::f32::consts::LOG2_E), simd.splat_f32s(ROUNDING), simd.splat_f32s(1.0));
    let shifted = simd.mul_add_f32s(x, log2_e, rounding);
    let fraction = simd.mul_add_f32s(x, log2_e, simd.sub_f32s(rounding, shifted));
    let mut p = simd.splat_f32s(EXP2[5]);
    for &c in EXP2[..5].iter().rev() {
        p = simd.mul_add_f32s(p, fraction, simd.splat_f32s(c));
    }
    let exponent = simd.wrapping_dyn_shl_u32s(simd.transmute_u32s_f32s(shifted), simd.splat_u32s(23));
    let exp = simd.transmute_f32s_u32s(simd.add_u32s(simd.transmute_u32s_f32s(p), exponent));
    simd.div_f32s(one, simd.add_f32s(one, exp))
}

/// `h = φ(z)` of `z = sums + bias`; all matrices are `[rows, bias.len()]`.
pub(crate) struct Silu<'a> {
    pub(crate) bias: &'a [f32],
    pub(crate) h: &'a mut [f32],
}

impl Epilogue for Silu<'_> {
    #[inline(always)]
    fn take<S: Simd>(&mut self, simd: S, row: usize, column: usize, sums: S::f32s) {
        let z = simd.add_f32s(sums, vector_at::<S>(self.bias, column));
        *vector::<S>(self.h, row * self.bias.len() + column) = simd.mul_f32s(z, sigmoid(simd, z));
    }
}

/// `h = φ(z)` and `slope = φ'(z)` of `z = sums + bias`.
pub(crate) struct SiluSlope<'a> {
    pub(crate) bias: &'a [f32],
    pub(crate) h: &'a mut [f32],
    pub(crate) slope: &'a mut [f32],
}

impl Epilogue for SiluSlope<'_> {
    #[inline(always)]
    fn take<S: Simd>(&mut self, simd: S, row: usize, column: usize, sums: S::f32s) {
        let z = simd.add_f32s(sums, vector_at::<S>(self.bias, column));
        let at = row * self.bias.len() + column;
        let s = sigmoid(simd, z);
        *vector::<S>(self.h, at) = simd.mul_f32s(z, s);
        *vector::<S>(self.slope, at) = slope(simd, z, s);
    }
}

/// `h = φ(z)`, `slope = φ'(z)` and `curvature = φ''(z)` of `z = sums + bias`.
pub(crate) struct SiluCurvature<'a> {
    pub(crate) bias: &'a [f32],
    pub(crate) h: &'a mut [f32],
    pub(crate) slope: &'a mut [f32],
    pub(crate) curvature: &'a mut [f32],
}

impl Epilogue for SiluCurvature<'_> {
    #[inline(always)]
    fn take<S: Simd>(&mut self, simd: S, row: usize, column: usize, sums: S::f32s) {
        let z = simd.add_f32s(sums, vector_at::<S>(self.bias, column));
        let at = row * self.bias.len() + column;
        let s = sigmoid(simd, z);
        let two = simd.splat_f32s(2.0);
        let bend = simd.mul_add_f32s(z, simd.negate_mul_add_f32s(two, s, simd.splat_f32s(1.0)), two);
        *vector::<S>(self.h, at) = simd.mul_f32s(z, s);
        *vector::<S>(self.slope, at) = slope(simd, z, s);
        *vector::<S>(self.curvature, at) = simd.mul_f32s(simd.negate_mul_add_f32s(s, s, s), bend);
    }
}

#[inline(always)]
fn slope<S: Simd>(simd: S, z: S::f32s, s: S::f32s) -> S::f32s {
    let one = simd.splat_f32s(1.0);
    simd.mul_f32s(s, simd.mul_add_f32s(z, simd.sub_f32s(one, s), one))
}

/// `softplus(x) = ln(1 + eˣ)`, and its slope, the sigmoid.
#[inline(always)]
pub(crate) fn softplus(x: f32) -> (f32, f32) {
    let e = (-x.abs()).exp();
    (x.max(0.0) + e.ln_1p(), if x >= 0.0 { 1.0 / (1.0 + e) } else { e / (1.0 + e) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::block::packed::Right;
    use crate::block::product::{Columns, Product};

    /// φ, φ' and φ'' of 16 values.
    fn activated(z: [f32; 16]) -> [[f32; 16]; 3] {
        let [mut h, mut slope, mut curvature] = [[0.0; 16]; 3];
        let epilogue = SiluCurvature { bias: &z, h: &mut h, slope: &mut slope, curvature: &mut curvature };
        Product { left: Columns(&[0.0], 1), rows: 1, right: Right::plain(&[0.0; 16], 16), epilogue }.run();
        [h, slope, curvature]
    }

    #[test]
    fn silu_and_its_derivatives_keep_their_bounds() {
        for step in -600..600 {
            let z: [f32; 16] = std::array::from_fn(|i| (step as f32 + i as f32 / 16.0) * 0.05);
            let found = activated(z);
            for (i, z) in z.into_iter().map(f64::from).enumerate() {
                let s = 1.0 / (1.0 + (-z).exp());
                let expected =
                    [z * s, s * (1.0 + z * (1.0 - s)), s * (1.0 - s) * (2.0 + z * (1.0 - 2.0 * s))];
                for (found, expected) in found.iter().zip(expected) {
                    assert!(
                        (f64::from(found[i]) - expected).abs() <= 1e-6 * (1.0 + expected.abs()),
                        "z = {z}: {} {expected}",
                        found[i]
                    );
                }
            }
        }
    }

    #[test]
    fn saturation_is_finite_and_nan_stays() {
        let [h, slope, curvature] = activated(std::array::from_fn(|i| if i % 2 == 0 { 1e30 } else { -1e6 }));
        assert!(h[0] == 1e30 && h[1].abs() < 1e-30);
        assert!(slope[1].abs() < 1e-30 && curvature[1].abs() < 1e-24);
        assert!(activated([f32::NAN; 16]).iter().all(|values| values[3].is_nan()));
    }

    #[test]
    fn softplus_is_stable_at_both_ends() {
        assert_eq!(softplus(200.0), (200.0, 1.0));
        assert!(softplus(-200.0).0 >= 0.0 && softplus(-200.0).0 < 1e-30);
        assert!((softplus(0.3).0 - 0.3_f32.exp().ln_1p()).abs() < 1e-6);
    }
}
