//! Sixteen vectors of sixteen values, transposed in registers where the processor can.

use crate::simd::{BLOCK, Lanes};
use pulp::Simd;

/// A square of values.
pub(crate) type Square = [Lanes; BLOCK];

/// Sixteen rows of sixteen values.
pub(crate) trait Rows {
    fn row(&self, i: usize) -> &Lanes;
}

impl Rows for Square {
    #[inline(always)]
    fn row(&self, i: usize) -> &Lanes {
        &self[i]
    }
}

/// Puts the columns of a square to one plane of rows.
#[inline(always)]
pub(crate) fn transpose<S: Simd, const PLANES: usize>(
    simd: S,
    from: &impl Rows,
    plane: usize,
    to: &mut [[Lanes; PLANES]; BLOCK],
) {
    #[cfg(target_arch = "x86_64")]
    {
        let level: &dyn std::any::Any = &simd;
        if let Some(&v4) = level.downcast_ref() {
            return x86::transpose_sixteen(v4, from, plane, to);
        }
        if let Some(&v3) = level.downcast_ref() {
            return x86::transpose_eights(v3, from, plane, to);
        }
    }
    for i in 0..BLOCK {
        let row = from.row(i);
        for (to, value) in to.iter_mut().zip(row.0) {
            to[plane].0[i] = value;
        }
    }
}

/// In every quarter of a vector, of which four rows stand side by side, columns become rows; then quarters
/// change places.
#[cfg(target_arch = "x86_64")]
mod x86 {
    use super::{BLOCK, Lanes, Rows};
    use pulp::cast;
    use pulp::x86::{V3, V4};
    use std::arch::x86_64::{__m256, __m512};

    const HALF: usize = BLOCK / 2;

    #[inline(always)]
    pub(super) fn transpose_sixteen<const PLANES: usize>(
        simd: V4,
        from: &impl Rows,
        plane: usize,
        to: &mut [[Lanes; PLANES]; BLOCK],
    ) {
        // Written out, because in a loop they would be stored.
        let (a, b, c, d) = (
            four_rows(simd, from, 0),
            four_rows(simd, from, 4),
            four_rows(simd, from, 8),
            four_rows(simd, from, 12),
        );
        four_columns(simd, [a[0], b[0], c[0], d[0]], 0, plane, to);
        four_columns(simd, [a[1], b[1], c[1], d[1]], 1, plane, to);
        four_columns(simd, [a[2], b[2], c[2], d[2]], 2, plane, to);
        four_columns(simd, [a[3], b[3], c[3], d[3]], 3, plane, to);
    }

    /// Four rows from `i` on: in every quarter of result `j`, column `j` of that quarter.
    #[inline(always)]
    fn four_rows(simd: V4, from: &impl Rows, i: usize) -> [__m512; 4] {
        let (a, b): (__m512, __m512) = (cast(from.row(i).0), cast(from.row(i + 1).0));
        let (c, d): (__m512, __m512) = (cast(from.row(i + 2).0), cast(from.row(i + 3).0));
        let (ab, cd) = (simd.avx512f._mm512_unpacklo_ps(a, b), simd.avx512f._mm512_unpacklo_ps(c, d));
        let (ab_high, cd_high) =
            (simd.avx512f._mm512_unpackhi_ps(a, b), simd.avx512f._mm512_unpackhi_ps(c, d));
        [
            cast(simd.avx512f._mm512_unpacklo_pd(cast(ab), cast(cd))),
            cast(simd.avx512f._mm512_unpackhi_pd(cast(ab), cast(cd))),
            cast(simd.avx512f._mm512_unpacklo_pd(cast(ab_high), cast(cd_high))),
            cast(simd.avx512f._mm512_unpackhi_pd(cast(ab_high), cast(cd_high))),
        ]
    }

    /// Columns `i`, `i + 4`, `i + 8` and `i + 12`.
    #[inline(always)]
    fn four_columns<const PLANES: usize>(
        simd: V4,
        [a, b, c, d]: [__m512; 4],
        i: usize,
        plane: usize,
        to: &mut [[Lanes; PLANES]; BLOCK],
    ) {
        let ([ab_even, ab_odd], [cd_even, cd_odd]) = (quarters(simd, a, b), quarters(simd, c, d));
        let ([first, third], [second, fourth]) =
            (quarters(simd, ab_even, cd_even), quarters(simd, ab_odd, cd_odd));
        to[i][plane] = Lanes(cast(first));
        to[i + 4][plane] = Lanes(cast(second));
        to[i + 8][plane] = Lanes(cast(third));
        to[i + 12][plane] = Lanes(cast(fourth));
    }

    /// The even quarters of both, and the odd ones.
    #[inline(always)]
    fn quarters(simd: V4, a: __m512, b: __m512) -> [__m512; 2] {
        [
            simd.avx512f._mm512_shuffle_f32x4::<0b10_00_10_00>(a, b),
            simd.avx512f._mm512_shuffle_f32x4::<0b11_01_11_01>(a, b),
        ]
    }

    #[inline(always)]
    pub(super) fn transpose_eights<const PLANES: usize>(
        simd: V3,
        from: &impl Rows,
        plane: usize,
        to: &mut [[Lanes; PLANES]; BLOCK],
    ) {
        let mut square = [Lanes::ZERO; BLOCK];
        for (i, row) in square.iter_mut().enumerate() {
            *row = *from.row(i);
        }
        for (down, right) in [(0, 0), (0, HALF), (HALF, 0), (HALF, HALF)] {
            let mut fours = [cast::<_, __m256>([0.0_f32; HALF]); HALF];
            for i in [0, 4] {
                let [mut a, mut b, mut c, mut d] = [fours[0]; 4];
                for (row, out) in [&mut a, &mut b, &mut c, &mut d].into_iter().enumerate() {
                    *out =
                        cast(*square[down + i + row].0[right..].first_chunk::<HALF>().expect("half a row"));
                }
                let (ab, cd) = (simd.avx._mm256_unpacklo_ps(a, b), simd.avx._mm256_unpacklo_ps(c, d));
                fours[i] = cast(simd.avx._mm256_unpacklo_pd(cast(ab), cast(cd)));
                fours[i + 1] = cast(simd.avx._mm256_unpackhi_pd(cast(ab), cast(cd)));
                let (ab, cd) = (simd.avx._mm256_unpackhi_ps(a, b), simd.avx._mm256_unpackhi_ps(c, d));
                fours[i + 2] = cast(simd.avx._mm256_unpacklo_pd(cast(ab), cast(cd)));
                fours[i + 3] = cast(simd.avx._mm256_unpackhi_pd(cast(ab), cast(cd)));
            }
            for i in 0..4 {
                let low: [f32; HALF] =
                    cast(simd.avx._mm256_permute2f128_ps::<0b10_00_00>(fours[i], fours[4 + i]));
                let high: [f32; HALF] =
                    cast(simd.avx._mm256_permute2f128_ps::<0b11_00_01>(fours[i], fours[4 + i]));
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
