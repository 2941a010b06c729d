//! SSIM and its slopes from windowed means, and the windows along rows of cells around them.

use crate::cells::Row;
use crate::simd::{BLOCK, Lanes, V, reciprocal, splat};
use crate::window::{RADIUS, SPAN, STEP, Taps, windowed};
use pulp::Simd;

/// `(0.01 L)²` for a dynamic range of 1.
const C1: f32 = 1e-4;
/// `(0.03 L)²` for a dynamic range of 1.
const C2: f32 = 9e-4;
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
        let (a, b) = (along(simd, taps, reach, 0, index), along(simd, taps, reach, 1, index));
        let (squares, products) = (along(simd, taps, reach, 2, index), along(simd, taps, reach, 3, index));
        let mut total = ssim.get(simd, index);
        for (i, (slopes, inside)) in slopes.iter_mut().zip(&inside[first..]).enumerate() {
            let (s, by) = compare([a[i], b[i], squares[i], products[i]], inside.get(simd, index));
            total = total + s;
            slopes[0].set(index, by[0]);
            slopes[1].set(index, by[1]);
            slopes[2].set(index, by[2]);
        }
        ssim.set(index, total);
    }
}

/// SSIM from the windowed means of a, b, a² + b², ab, and its slopes by those of a, a² + b² and ab; zero where `inside` is.
#[inline(always)]
fn compare<S: Simd>([a, b, squares, products]: [V<S>; 4], inside: V<S>) -> (V<S>, [V<S>; 3]) {
    let (two, c1, c2) = (a.of(2.0), a.of(C1), a.of(C2));
    let (aa_bb, ab) = (a.mul_add(a, b * b), a * b);
    let (n1, n2) = (two.mul_add(ab, c1), two.mul_add(products - ab, c2));
    let (d1, d2) = (aa_bb + c1, squares - aa_bb + c2);
    // A factor of all that follows.
    let inverse = V { simd: a.simd, value: reciprocal(a.simd, (d1 * d2).value) } * inside;
    let s = n1 * n2 * inverse;
    // s / d1 and s / d2 without two more divisions.
    let by_both = s * inverse;
    let (by_d1, by_d2) = (by_both * d2, by_both * d1);
    let by_mean = b.mul_add(inverse * (n2 - n1), a * (by_d2 - by_d1));
    (s, [by_mean + by_mean, -by_d2, (n1 + n1) * inverse])
}

/// The gradient from the windowed slopes.
#[inline(always)]
pub(crate) fn slope<S: Simd>(simd: S, [a, b]: [V<S>; 2], [mean, square, product]: [V<S>; 3], weights: [f32; 2]) -> V<S> {
    let (absolute, zero) = (splat(simd, weights[0]), splat(simd, 0.0));
    let above = absolute.where_set(simd.greater_than_f32s(a.value, b.value), zero);
    let sign = (-absolute).where_set(simd.less_than_f32s(a.value, b.value), above);
    let structure = (a + a).mul_add(square, b.mul_add(product, mean));
    splat(simd, weights[1]).mul_add(structure, sign)
}
