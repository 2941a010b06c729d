//! Several vectors side by side.

use crate::simd::{ROUGH_STEPS, V, rough_reciprocal};
use pulp::Simd;
use std::ops::{Add, Mul, Sub};

/// Several vectors on which the same is done, so that what is done to one need not wait for what was just
/// done to it.
#[derive(Clone, Copy)]
pub(crate) struct Pack<S: Simd, const N: usize>(pub [V<S>; N]);

impl<S: Simd, const N: usize> Pack<S, N> {
    /// `self · b + c`.
    #[inline(always)]
    pub(crate) fn mul_add(mut self, b: Self, c: Self) -> Self {
        for i in 0..N {
            self.0[i] = self.0[i].mul_add(b.0[i], c.0[i]);
        }
        self
    }

    /// `c - self · b`.
    #[inline(always)]
    pub(crate) fn negate_mul_add(mut self, b: Self, c: Self) -> Self {
        for i in 0..N {
            self.0[i] = self.0[i].negate_mul_add(b.0[i], c.0[i]);
        }
        self
    }

    /// `1 / self` for normal positive numbers within 3e-7 relative.
    #[inline(always)]
    pub(crate) fn reciprocal(self) -> Self {
        let (mut r, two) = (self, Self([self.0[0].of(2.0); N]));
        let mut steps = 0;
        for i in 0..N {
            (r.0[i].value, steps) = reciprocal_estimate(self.0[i].simd, self.0[i].value);
        }
        for _ in 0..steps {
            r = r * self.negate_mul_add(r, two);
        }
        r
    }
}

macro_rules! pack_operator {
    ($trait:ident, $method:ident) => {
        impl<S: Simd, const N: usize> $trait for Pack<S, N> {
            type Output = Self;
            #[inline(always)]
            fn $method(mut self, other: Self) -> Self {
                for i in 0..N {
                    self.0[i] = self.0[i].$method(other.0[i]);
                }
                self
            }
        }
    };
}
pack_operator!(Add, add);
pack_operator!(Sub, sub);
pack_operator!(Mul, mul);

/// An estimate of `1 / x` for normal positive numbers, and the Newton steps that bring it within 3e-7.
#[inline(always)]
fn reciprocal_estimate<S: Simd>(simd: S, x: S::f32s) -> (S::f32s, usize) {
    #[cfg(target_arch = "x86_64")]
    {
        use std::any::Any;
        let (v4, x): (&dyn Any, &dyn Any) = (&simd, &x);
        if let (Some(v4), Some(x)) = (v4.downcast_ref::<pulp::x86::V4>(), x.downcast_ref::<pulp::f32x16>()) {
            let estimate: &dyn Any =
                &pulp::cast::<_, pulp::f32x16>(v4.avx512f._mm512_rcp14_ps(pulp::cast(*x)));
            if let Some(estimate) = estimate.downcast_ref() {
                return (*estimate, 1);
            }
        }
    }
    (rough_reciprocal(simd, x), ROUGH_STEPS)
}

#[cfg(test)]
mod tests {
    use super::*;
    use pulp::{Arch, Scalar, WithSimd};

    struct Reciprocals<'a>(&'a mut [f32]);

    impl WithSimd for Reciprocals<'_> {
        type Output = ();
        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) {
            for [a, b] in S::as_mut_simd_f32s(self.0).0.as_chunks_mut().0 {
                let pack = Pack([V { simd, value: *a }, V { simd, value: *b }]).reciprocal();
                (*a, *b) = (pack.0[0].value, pack.0[1].value);
            }
        }
    }

    #[test]
    fn reciprocals_stay_within_their_bound_at_every_feature_level() {
        let inputs: Vec<f32> = (0..1 << 16).map(|i| (-30.0 + i as f32 * (60.0 / 65536.0)).exp2()).collect();
        let (mut fast, mut plain) = (inputs.clone(), inputs.clone());
        Arch::new().dispatch(Reciprocals(&mut fast));
        Scalar.vectorize(Reciprocals(&mut plain));
        for (x, y) in inputs.iter().zip(&fast).chain(inputs.iter().zip(&plain)) {
            assert!((f64::from(*x) * f64::from(*y) - 1.0).abs() < 3e-7, "1 / {x} gave {y}");
        }
    }
}
