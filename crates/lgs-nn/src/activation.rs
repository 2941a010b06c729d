//! ReLU, and SiLU with its first two derivatives, as ends of matrix products.
//!
//! SiLU: `φ(z) = z s`, `φ' = s (1 + z (1 − s))`, `φ'' = s (1 − s) (2 + z (1 − 2 s))` with `s = sigmoid(z)`
//! (method §4.1). The exponential is a polynomial of degree 5 after reduction to powers of two (relative
//! error below 3e-7).

use crate::product::{Epilogue, vector, vector_at};
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

/// The numbers that are added to the sums of a product: one row for all rows (a bias), or a matrix (the sums
/// over the inputs read before).
#[derive(Clone, Copy)]
pub(crate) struct Offset<'a> {
    values: &'a [f32],
    stride: usize,
}

impl<'a> Offset<'a> {
    /// The same row for all rows.
    pub(crate) fn row(values: &'a [f32]) -> Self {
        Self { values, stride: 0 }
    }

    /// A matrix `[rows, units]`.
    pub(crate) fn matrix(values: &'a [f32], units: usize) -> Self {
        Self { values, stride: units }
    }

    #[inline(always)]
    fn plus<S: Simd>(self, simd: S, row: usize, column: usize, sums: S::f32s) -> S::f32s {
        simd.add_f32s(sums, vector_at::<S>(self.values, row * self.stride + column))
    }
}

/// `z = sums + offset`, `[rows, units]`.
pub(crate) struct Linear<'a> {
    pub(crate) offset: Offset<'a>,
    pub(crate) z: &'a mut [f32],
    pub(crate) units: usize,
}

impl Epilogue for Linear<'_> {
    #[inline(always)]
    fn take<S: Simd>(&mut self, simd: S, row: usize, column: usize, sums: S::f32s) {
        let z = self.offset.plus(simd, row, column, sums);
        *vector::<S>(self.z, row * self.units + column) = z;
    }
}

/// `h = max(z, 0)` of `z = sums + offset`, `[rows, units]`.
pub(crate) struct Relu<'a> {
    pub(crate) offset: Offset<'a>,
    pub(crate) h: &'a mut [f32],
    pub(crate) units: usize,
}

impl Epilogue for Relu<'_> {
    #[inline(always)]
    fn take<S: Simd>(&mut self, simd: S, row: usize, column: usize, sums: S::f32s) {
        let z = self.offset.plus(simd, row, column, sums);
        let zero = simd.splat_f32s(0.0);
        let h = simd.select_f32s(simd.greater_than_f32s(z, zero), z, zero);
        *vector::<S>(self.h, row * self.units + column) = h;
    }
}

/// `h = φ(z)` of `z = sums + offset`, and where they are asked for `slope = φ'(z)` and `curvature = φ''(z)`,
/// `[rows, units]` each.
pub(crate) struct Silu<'a> {
    pub(crate) offset: Offset<'a>,
    pub(crate) units: usize,
    pub(crate) h: &'a mut [f32],
    pub(crate) slope: Option<&'a mut [f32]>,
    pub(crate) curvature: Option<&'a mut [f32]>,
}

impl Epilogue for Silu<'_> {
    #[inline(always)]
    fn take<S: Simd>(&mut self, simd: S, row: usize, column: usize, sums: S::f32s) {
        let z = self.offset.plus(simd, row, column, sums);
        let at = row * self.units + column;
        let s = sigmoid(simd, z);
        *vector::<S>(self.h, at) = simd.mul_f32s(z, s);
        if let Some(values) = &mut self.slope {
            *vector::<S>(values, at) = slope(simd, z, s);
        }
        if let Some(values) = &mut self.curvature {
            *vector::<S>(values, at) = curvature(simd, z, s);
        }
    }
}

#[inline(always)]
fn slope<S: Simd>(simd: S, z: S::f32s, s: S::f32s) -> S::f32s {
    let one = simd.splat_f32s(1.0);
    simd.mul_f32s(s, simd.mul_add_f32s(z, simd.sub_f32s(one, s), one))
}

#[inline(always)]
fn curvature<S: Simd>(simd: S, z: S::f32s, s: S::f32s) -> S::f32s {
    let two = simd.splat_f32s(2.0);
    let bend = simd.mul_add_f32s(z, simd.negate_mul_add_f32s(two, s, simd.splat_f32s(1.0)), two);
    simd.mul_f32s(simd.negate_mul_add_f32s(s, s, s), bend)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::packed::Right;
    use crate::product::{Columns, Product};

    /// φ, φ' and φ'' of 16 values.
    fn activated(z: [f32; 16]) -> [[f32; 16]; 3] {
        let [mut h, mut slope, mut curvature] = [[0.0; 16]; 3];
        let epilogue = Silu {
            offset: Offset::row(&z),
            units: 16,
            h: &mut h,
            slope: Some(&mut slope),
            curvature: Some(&mut curvature),
        };
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
}
