//! Lane arithmetic shared by the kernels, generic over the processor's vector width.
//!
//! A kernel is a `pulp::WithSimd` value: `pulp::Arch::dispatch` compiles it once per feature level (AVX-512,
//! AVX2, NEON, scalar) and picks at run time. Kernels work on blocks of [`BLOCK`] values, that is `BLOCK /
//! lanes` vectors.
//!
//! No closures in here and in the kernels: the body of a closure (of `array::map`, say) is compiled without
//! the vector features, so that intrinsics in it would stay calls.

use crate::exponential::exp2;
use pulp::Simd;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// Values of the widest vector.
pub(crate) const BLOCK: usize = 16;

/// [`BLOCK`] values on a cache line.
#[derive(Clone, Copy, Debug, Default)]
#[repr(align(64))]
pub(crate) struct Lanes(pub [f32; BLOCK]);

impl Lanes {
    pub(crate) const ZERO: Self = Self([0.0; BLOCK]);

    /// Vector number `index` of the block.
    #[inline(always)]
    pub(crate) fn get<S: Simd>(&self, simd: S, index: usize) -> V<S> {
        V { simd, value: S::as_simd_f32s(&self.0).0[index] }
    }

    /// Replaces vector number `index` of the block.
    #[inline(always)]
    pub(crate) fn set<S: Simd>(&mut self, index: usize, value: V<S>) {
        S::as_mut_simd_f32s(&mut self.0).0[index] = value.value;
    }
}

/// A vector with operators, for formulas too long to be read as calls.
#[derive(Clone, Copy)]
pub(crate) struct V<S: Simd> {
    pub simd: S,
    pub value: S::f32s,
}

impl<S: Simd> V<S> {
    /// A constant beside `self`.
    #[inline(always)]
    pub(crate) fn of(self, value: f32) -> Self {
        splat(self.simd, value)
    }

    /// `self · b + c`.
    #[inline(always)]
    pub(crate) fn mul_add(self, b: Self, c: Self) -> Self {
        Self { value: self.simd.mul_add_f32s(self.value, b.value, c.value), ..self }
    }

    /// `c - self · b`.
    #[inline(always)]
    pub(crate) fn negate_mul_add(self, b: Self, c: Self) -> Self {
        Self { value: self.simd.negate_mul_add_f32s(self.value, b.value, c.value), ..self }
    }

    #[inline(always)]
    pub(crate) fn sqrt(self) -> Self {
        Self { value: self.simd.sqrt_f32s(self.value), ..self }
    }

    /// The smaller one; `other` if `self` is NaN.
    #[inline(always)]
    pub(crate) fn min(self, other: Self) -> Self {
        Self { value: self.simd.min_f32s(self.value, other.value), ..self }
    }

    /// The larger one; `other` if `self` is NaN.
    #[inline(always)]
    pub(crate) fn max(self, other: Self) -> Self {
        Self { value: self.simd.max_f32s(self.value, other.value), ..self }
    }

    /// `self` where the mask is set, else `other`.
    #[inline(always)]
    pub(crate) fn where_set(self, mask: S::m32s, other: Self) -> Self {
        Self { value: self.simd.select_f32s(mask, self.value, other.value), ..self }
    }

    /// `e^self` within 4e-7 relative for arguments within ±80; beyond it saturates, NaN included.
    #[inline(always)]
    pub(crate) fn exp(self) -> Self {
        let x = (self * self.of(std::f32::consts::LOG2_E)).min(self.of(126.0)).max(self.of(-126.0));
        Self { value: exp2(self.simd, x.value), ..self }
    }

    /// `log2(self)` of a normal positive number, within 2e-7 absolute plus a rounding.
    #[inline(always)]
    pub(crate) fn log2(self) -> Self {
        let simd = self.simd;
        // Exponent and mantissa, the latter in [√½, √2).
        let bits = simd.sub_u32s(simd.transmute_u32s_f32s(self.value), simd.splat_u32s(ROOT_HALF_BITS));
        let exponent = simd.and_u32s(bits, simd.splat_u32s(0xff80_0000));
        let mantissa =
            simd.transmute_f32s_u32s(simd.sub_u32s(simd.transmute_u32s_f32s(self.value), exponent));
        // The biased exponent as a float: its bits in the mantissa of 2²³.
        let biased = simd.wrapping_dyn_shr_u32s(
            simd.add_u32s(exponent, simd.splat_u32s(0x4000_0000)),
            simd.splat_u32s(23),
        );
        let whole = simd.transmute_f32s_u32s(simd.or_u32s(biased, simd.splat_u32s(0x4b00_0000)));
        let whole = Self { value: whole, ..self } - self.of(8_388_608.0 + 128.0);
        let mantissa = Self { value: mantissa, ..self };
        // log2 m = 2/ln 2 · artanh((m - 1) / (m + 1)).
        let one = self.of(1.0);
        let s = (mantissa - one) / (mantissa + one);
        let z = s * s;
        let series = z.mul_add(self.of(2.0 / 9.0), self.of(2.0 / 7.0)).mul_add(z, self.of(2.0 / 5.0));
        let series = series.mul_add(z, self.of(2.0 / 3.0)).mul_add(z, self.of(2.0));
        (s * series).mul_add(self.of(std::f32::consts::LOG2_E), whole)
    }
}

/// The same value in every lane.
#[inline(always)]
pub(crate) fn splat<S: Simd>(simd: S, value: f32) -> V<S> {
    V { simd, value: simd.splat_f32s(value) }
}

macro_rules! operator {
    ($trait:ident, $method:ident, $operation:ident) => {
        impl<S: Simd> $trait for V<S> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self { value: self.simd.$operation(self.value, other.value), ..self }
            }
        }
    };
}
operator!(Add, add, add_f32s);
operator!(Sub, sub, sub_f32s);
operator!(Mul, mul, mul_f32s);
operator!(Div, div, div_f32s);

impl<S: Simd> Neg for V<S> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self { value: self.simd.neg_f32s(self.value), ..self }
    }
}

/// Bits of `√½`.
const ROOT_HALF_BITS: u32 = 0x3f35_04f3;

/// Newton steps that bring [`rough_reciprocal`] within 3e-7.
pub(crate) const ROUGH_STEPS: usize = 3;

/// `1 / x` for normal positive numbers within 0.13 relative: the exponent, negated, and the mantissa as if it
/// were part of it.
#[inline(always)]
pub(crate) fn rough_reciprocal<S: Simd>(simd: S, x: S::f32s) -> S::f32s {
    simd.transmute_f32s_u32s(simd.sub_u32s(simd.splat_u32s(0x7ef3_11c7), simd.transmute_u32s_f32s(x)))
}

/// `1 / x` for normal positive numbers within 3e-7 relative: an estimate from the bits, then three Newton
/// steps. Division is slower than all the rest of a step of blending.
#[inline(always)]
pub(crate) fn reciprocal<S: Simd>(simd: S, x: S::f32s) -> S::f32s {
    let two = simd.splat_f32s(2.0);
    let mut r = rough_reciprocal(simd, x);
    for _ in 0..ROUGH_STEPS {
        r = simd.mul_f32s(r, simd.negate_mul_add_f32s(x, r, two));
    }
    r
}

/// `a · b + c`; kept short because the kernels are made of it.
#[inline(always)]
pub(crate) fn fma<S: Simd>(simd: S, a: S::f32s, b: S::f32s, c: S::f32s) -> S::f32s {
    simd.mul_add_f32s(a, b, c)
}

/// Whether no lane of a mask is set.
#[inline(always)]
pub(crate) fn none<S: Simd>(simd: S, mask: S::m32s) -> bool {
    simd.first_true_m32s(mask) == S::F32_LANES
}

#[cfg(test)]
mod tests {
    use super::*;
    use pulp::{Arch, WithSimd};

    enum Function {
        Exp2,
        Log2,
    }

    struct Evaluate<'a>(Function, &'a mut [f32]);

    impl WithSimd for Evaluate<'_> {
        type Output = ();
        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) {
            for value in S::as_mut_simd_f32s(self.1).0 {
                *value = match self.0 {
                    Function::Exp2 => exp2(simd, *value),
                    Function::Log2 => V { simd, value: *value }.log2().value,
                };
            }
        }
    }

    #[test]
    fn exp2_stays_within_its_bound() {
        let inputs: Vec<f32> = (0..1 << 16).map(|i| -20.0 + i as f32 * (21.0 / 65536.0)).collect();
        let mut found = inputs.clone();
        Arch::new().dispatch(Evaluate(Function::Exp2, &mut found));
        for (x, y) in inputs.iter().zip(&found) {
            let expected = f64::from(*x).exp2();
            assert!((f64::from(*y) / expected - 1.0).abs() < 3e-7, "2^{x} gave {y}");
        }
    }

    #[test]
    fn log2_stays_within_its_bound() {
        let inputs: Vec<f32> = (0..1 << 16).map(|i| (-12.0 + i as f32 * (24.0 / 65536.0)).exp2()).collect();
        let mut found = inputs.clone();
        Arch::new().dispatch(Evaluate(Function::Log2, &mut found));
        for (x, y) in inputs.iter().zip(&found) {
            let expected = f64::from(*x).log2();
            assert!(
                (f64::from(*y) - expected).abs() < 3e-7 + 1.2e-7 * expected.abs(),
                "log2 {x} gave {y}, not {expected}"
            );
        }
    }
}
