//! Sixteen vectors of sixteen values, transposed in registers where the processor can.

use crate::simd::{BLOCK, Lanes};
use pulp::Simd;

/// A square of values.
pub(crate) type Square = [Lanes; BLOCK];

/// Puts the columns of a square to rows that stand `STRIDE` apart.
#[inline(always)]
pub(crate) fn transpose<S: Simd, const STRIDE: usize>(simd: S, from: &Square, plane: usize, to: &mut [[Lanes; STRIDE]; BLOCK]) {
    #[cfg(target_arch = "x86_64")]
    if let Some(&v4) = (&simd as &dyn std::any::Any).downcast_ref::<pulp::x86::V4>() {
        wide::transpose(v4, from, plane, to);
        return;
    }
    let _ = simd;
    for (i, to) in to.iter_mut().enumerate() {
        for (value, from) in to[plane].0.iter_mut().zip(from) {
            *value = from.0[i];
        }
    }
}

#[cfg(target_arch = "x86_64")]
mod wide {
    use super::{BLOCK, Lanes, Square};
    use pulp::cast;
    use pulp::x86::V4;
    use std::arch::x86_64::{__m512, __m512d};

    /// Four values of a row stay together in the first half, four rows in the second.
    #[inline(always)]
    pub(super) fn transpose<const STRIDE: usize>(simd: V4, from: &Square, plane: usize, to: &mut [[Lanes; STRIDE]; BLOCK]) {
        let mut fours = [cast::<_, __m512>(from[0].0); BLOCK];
        for i in [0, 4, 8, 12] {
            let ab = interleaved(simd, cast(from[i].0), cast(from[i + 1].0));
            let cd = interleaved(simd, cast(from[i + 2].0), cast(from[i + 3].0));
            for j in 0..2 {
                let (low, high): (__m512d, __m512d) = (cast(ab[j]), cast(cd[j]));
                fours[i + 2 * j] = cast(simd.avx512f._mm512_unpacklo_pd(low, high));
                fours[i + 2 * j + 1] = cast(simd.avx512f._mm512_unpackhi_pd(low, high));
            }
        }
        for i in 0..4 {
            let (ab, cd) = (quarters(simd, fours[i], fours[4 + i]), quarters(simd, fours[8 + i], fours[12 + i]));
            for j in 0..2 {
                let [even, odd] = quarters(simd, ab[j], cd[j]);
                to[4 * j + i][plane] = Lanes(cast(even));
                to[4 * j + i + 8][plane] = Lanes(cast(odd));
            }
        }
    }

    /// Values of both, in turns: the first two of every four, and the last two.
    #[inline(always)]
    fn interleaved(simd: V4, a: __m512, b: __m512) -> [__m512; 2] {
        [simd.avx512f._mm512_unpacklo_ps(a, b), simd.avx512f._mm512_unpackhi_ps(a, b)]
    }

    /// The even quarters of both, and the odd ones.
    #[inline(always)]
    fn quarters(simd: V4, a: __m512, b: __m512) -> [__m512; 2] {
        [simd.avx512f._mm512_shuffle_f32x4::<0b10_00_10_00>(a, b), simd.avx512f._mm512_shuffle_f32x4::<0b11_01_11_01>(a, b)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pulp::{Arch, Scalar, WithSimd};

    struct Transpose(Square);

    impl WithSimd for Transpose {
        type Output = Square;

        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) -> Square {
            let mut out = [[Lanes::ZERO; 2]; BLOCK];
            transpose(simd, &self.0, 1, &mut out);
            out.map(|planes| planes[1])
        }
    }

    #[test]
    fn rows_become_columns_at_every_feature_level() {
        let square: Square = std::array::from_fn(|i| Lanes(std::array::from_fn(|j| (BLOCK * i + j) as f32)));
        for out in [Arch::new().dispatch(Transpose(square)), Scalar.vectorize(Transpose(square))] {
            for (i, row) in out.iter().enumerate() {
                assert_eq!(row.0, std::array::from_fn(|j| (BLOCK * j + i) as f32));
            }
        }
    }
}
