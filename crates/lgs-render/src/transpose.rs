//! Sixteen vectors of sixteen values, transposed in registers where the processor can.

use crate::simd::{BLOCK, Lanes};
use pulp::Simd;

/// A square of values.
pub(crate) type Square = [Lanes; BLOCK];

/// Puts the columns of a square to one plane of rows.
#[inline(always)]
pub(crate) fn transpose<S: Simd, const PLANES: usize>(simd: S, from: &Square, plane: usize, to: &mut [[Lanes; PLANES]; BLOCK]) {
    #[cfg(target_arch = "x86_64")]
    {
        let simd: &dyn std::any::Any = &simd;
        if let Some(&v4) = simd.downcast_ref() {
            return x86::transpose_sixteen(v4, from, plane, to);
        }
        if let Some(&v3) = simd.downcast_ref() {
            return x86::transpose_eights(v3, from, plane, to);
        }
    }
    let _ = simd;
    for (i, to) in to.iter_mut().enumerate() {
        for (value, from) in to[plane].0.iter_mut().zip(from) {
            *value = from.0[i];
        }
    }
}

/// In every quarter of a vector, of which four rows stand side by side, columns become rows; then quarters change places.
#[cfg(target_arch = "x86_64")]
mod x86 {
    use super::{BLOCK, Lanes, Square};
    use pulp::cast;
    use pulp::x86::{V3, V4};
    use std::arch::x86_64::{__m256, __m512};

    const HALF: usize = BLOCK / 2;

    #[inline(always)]
    pub(super) fn transpose_sixteen<const PLANES: usize>(simd: V4, from: &Square, plane: usize, to: &mut [[Lanes; PLANES]; BLOCK]) {
        let mut fours = [cast::<_, __m512>(from[0].0); BLOCK];
        for i in [0, 4, 8, 12] {
            let [a, b, c, d]: [__m512; 4] = [cast(from[i].0), cast(from[i + 1].0), cast(from[i + 2].0), cast(from[i + 3].0)];
            let (ab, cd) = (simd.avx512f._mm512_unpacklo_ps(a, b), simd.avx512f._mm512_unpacklo_ps(c, d));
            fours[i] = cast(simd.avx512f._mm512_unpacklo_pd(cast(ab), cast(cd)));
            fours[i + 1] = cast(simd.avx512f._mm512_unpackhi_pd(cast(ab), cast(cd)));
            let (ab, cd) = (simd.avx512f._mm512_unpackhi_ps(a, b), simd.avx512f._mm512_unpackhi_ps(c, d));
            fours[i + 2] = cast(simd.avx512f._mm512_unpacklo_pd(cast(ab), cast(cd)));
            fours[i + 3] = cast(simd.avx512f._mm512_unpackhi_pd(cast(ab), cast(cd)));
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

    /// The even quarters of both, and the odd ones.
    #[inline(always)]
    fn quarters(simd: V4, a: __m512, b: __m512) -> [__m512; 2] {
        [simd.avx512f._mm512_shuffle_f32x4::<0b10_00_10_00>(a, b), simd.avx512f._mm512_shuffle_f32x4::<0b11_01_11_01>(a, b)]
    }

    #[inline(always)]
    pub(super) fn transpose_eights<const PLANES: usize>(simd: V3, from: &Square, plane: usize, to: &mut [[Lanes; PLANES]; BLOCK]) {
        for (down, right) in [(0, 0), (0, HALF), (HALF, 0), (HALF, HALF)] {
            let mut fours = [cast::<_, __m256>([0.0_f32; HALF]); HALF];
            for i in [0, 4] {
                let [mut a, mut b, mut c, mut d] = [fours[0]; 4];
                for (row, out) in [&mut a, &mut b, &mut c, &mut d].into_iter().enumerate() {
                    *out = cast(*from[down + i + row].0[right..].first_chunk::<HALF>().expect("half a row"));
                }
                let (ab, cd) = (simd.avx._mm256_unpacklo_ps(a, b), simd.avx._mm256_unpacklo_ps(c, d));
                fours[i] = cast(simd.avx._mm256_unpacklo_pd(cast(ab), cast(cd)));
                fours[i + 1] = cast(simd.avx._mm256_unpackhi_pd(cast(ab), cast(cd)));
                let (ab, cd) = (simd.avx._mm256_unpackhi_ps(a, b), simd.avx._mm256_unpackhi_ps(c, d));
                fours[i + 2] = cast(simd.avx._mm256_unpacklo_pd(cast(ab), cast(cd)));
                fours[i + 3] = cast(simd.avx._mm256_unpackhi_pd(cast(ab), cast(cd)));
            }
            for i in 0..4 {
                let low: [f32; HALF] = cast(simd.avx._mm256_permute2f128_ps::<0b10_00_00>(fours[i], fours[4 + i]));
                let high: [f32; HALF] = cast(simd.avx._mm256_permute2f128_ps::<0b11_00_01>(fours[i], fours[4 + i]));
                to[right + i][plane].0[down..down + HALF].copy_from_slice(&low);
                to[right + i + 4][plane].0[down..down + HALF].copy_from_slice(&high);
            }
        }
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
        let mut results = vec![Arch::new().dispatch(Transpose(square)), Scalar.vectorize(Transpose(square))];
        #[cfg(target_arch = "x86_64")]
        results.extend(pulp::x86::V3::try_new().map(|simd| Simd::vectorize(simd, Transpose(square))));
        for out in results {
            for (i, row) in out.iter().enumerate() {
                assert_eq!(row.0, std::array::from_fn(|j| (BLOCK * j + i) as f32));
            }
        }
    }
}
