//! The rotations of a group of supports in SIMD lanes: Newton's method of [`crate::kabsch`] and the
//! derivative at its solution.
//!
//! The curvature `M` is inverted by its adjugate, one division in place of the square roots of a factor.
//! Lanes whose curvature loses its margin or that do not converge are told apart, and go through the scalar
//! path. A lane's result depends on that lane alone.

use crate::lanes::{GROUP, Lanes, Mask, V, load, splat, store};
use crate::thresholds::{ALIGNMENT_ITERATIONS, CONVERGED};
use glam::DMat3;
use lgs_core::geometry::{components, fit_rotation};
use lgs_core::thresholds::{LEAST_DETERMINANT, LEAST_PIVOT};
use pulp::Simd;

/// Fits rotations to matrices `A`, row by row: unit quaternions.
#[inline(always)]
pub(crate) fn fit_group<S: Simd>(simd: S, a: &[Lanes; 9], rotation: &mut [Lanes; 4]) {
    let mut missed = Lanes::ZERO;
    for index in 0..GROUP / S::F64_LANES {
        let (fitted, active) = newton(simd, &load(simd, a, index));
        missed.set(index, active);
        store(rotation, index, fitted);
    }
    for lane in 0..GROUP {
        if missed.0[lane] > 0.0 {
            fit_lane(a, rotation, lane);
        }
    }
}

/// The scalar path of one lane.
#[cold]
#[inline(never)]
fn fit_lane(a: &[Lanes; 9], rotation: &mut [Lanes; 4], lane: usize) {
    for (values, value) in rotation.iter_mut().zip(scalar_fit(a, lane)) {
        values.0[lane] = value;
    }
}

fn scalar_fit(a: &[Lanes; 9], lane: usize) -> [f64; 4] {
    let rows: [f64; 9] = std::array::from_fn(|i| a[i].0[lane]);
    components(fit_rotation(&DMat3::from_cols_array(&rows).transpose()).rotation)
}

/// Rotations, and 1 in the lanes without a certified one.
#[inline(always)]
fn newton<S: Simd>(simd: S, a: &[V<S>; 9]) -> ([V<S>; 4], V<S>) {
    let (zero, one) = (splat(simd, 0.0), splat(simd, 1.0));
    let mut rotation = [one, zero, zero, zero];
    let mut k = *a;
    let mut missed = one;
    for _ in 0..ALIGNMENT_ITERATIONS {
        let (turn, certified) = solve(&k, vex(&k));
        let active = missed.exceeds(zero).and(certified);
        if active.is_empty() {
            break;
        }
        let next = turned(rotation, turn);
        for i in 0..4 {
            rotation[i] = active.select(next[i], rotation[i]);
        }
        let square = turn[0].mul_add(turn[0], turn[1].mul_add(turn[1], turn[2] * turn[2]));
        missed = active.and(one.of(CONVERGED).exceeds(square)).select(zero, missed);
        if missed.exceeds(zero).is_empty() {
            break;
        }
        k = pulled_back(a, &matrix(&rotation));
    }
    (rotation, missed)
}

/// `M⁻¹ b` with `M = tr(K) I − sym(K)`, and where `M` is positive definite by a margin; the margins are those
/// of the scalar factor.
#[inline(always)]
pub(crate) fn solve<S: Simd>(k: &[V<S>; 9], b: [V<S>; 3]) -> ([V<S>; 3], Mask<S>) {
    let half = k[0].of(-0.5);
    let (xx, yy, zz) = (k[4] + k[8], k[0] + k[8], k[0] + k[4]);
    let (xy, xz, yz) = ((k[1] + k[3]) * half, (k[2] + k[6]) * half, (k[5] + k[7]) * half);
    let minor = xx * yy - xy * xy;
    let (c_xx, c_xy, c_xz) = (yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy);
    let (c_yy, c_yz) = (xx * zz - xz * xz, xy * xz - xx * yz);
    let det = xx.mul_add(c_xx, xy.mul_add(c_xy, xz * c_xz));
    let trace = k[0] + k[4] + k[8];
    let least = (trace * trace.of(LEAST_DETERMINANT)).max(trace.of(LEAST_PIVOT));
    let certified = xx.exceeds(least).and(minor.exceeds(least * xx)).and(det.exceeds(least * minor));
    let scale = det.reciprocal();
    let y = [
        scale * c_xx.mul_add(b[0], c_xy.mul_add(b[1], c_xz * b[2])),
        scale * c_xy.mul_add(b[0], c_yy.mul_add(b[1], c_yz * b[2])),
        scale * c_xz.mul_add(b[0], c_yz.mul_add(b[1], minor * b[2])),
    ];
    (y, certified)
}

/// `vex(K − Kᵀ)`.
#[inline(always)]
fn vex<S: Simd>(k: &[V<S>; 9]) -> [V<S>; 3] {
    [k[7] - k[5], k[2] - k[6], k[3] - k[1]]
}

/// `rotation ⊗ (1, turn/2)`, normalised.
#[inline(always)]
fn turned<S: Simd>([w, x, y, z]: [V<S>; 4], turn: [V<S>; 3]) -> [V<S>; 4] {
    let half = w.of(0.5);
    let [a, b, c] = [turn[0] * half, turn[1] * half, turn[2] * half];
    let q = [
        w - (x * a + y * b + z * c),
        w.mul_add(a, y * c + x) - z * b,
        w.mul_add(b, z * a + y) - x * c,
        w.mul_add(c, x * b + z) - y * a,
    ];
    let norm = q[0].mul_add(q[0], q[1].mul_add(q[1], q[2].mul_add(q[2], q[3] * q[3])));
    let scale = norm.sqrt().reciprocal();
    [q[0] * scale, q[1] * scale, q[2] * scale, q[3] * scale]
}

/// The rotation matrices of unit quaternions, row by row.
#[inline(always)]
pub(crate) fn matrix<S: Simd>(&[w, x, y, z]: &[V<S>; 4]) -> [V<S>; 9] {
    let one = w.of(1.0);
    let (x2, y2, z2) = (x + x, y + y, z + z);
    let (xx, yy, zz) = (x * x2, y * y2, z * z2);
    let (xy, xz, yz) = (x * y2, x * z2, y * z2);
    let (wx, wy, wz) = (w * x2, w * y2, w * z2);
    [one - (yy + zz), xy - wz, xz + wy, xy + wz, one - (xx + zz), yz - wx, xz - wy, yz + wx, one - (xx + yy)]
}

/// `a × b`.
#[inline(always)]
pub(crate) fn cross<S: Simd>(a: [V<S>; 3], b: [V<S>; 3]) -> [V<S>; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// `RᵀA`.
#[inline(always)]
pub(crate) fn pulled_back<S: Simd>(a: &[V<S>; 9], r: &[V<S>; 9]) -> [V<S>; 9] {
    let mut k = *a;
    for i in 0..3 {
        for j in 0..3 {
            k[3 * i + j] = r[i].mul_add(a[j], r[3 + i].mul_add(a[3 + j], r[6 + i] * a[6 + j]));
        }
    }
    k
}

/// `R v`.
#[inline(always)]
pub(crate) fn rotated<S: Simd>(r: &[V<S>; 9], v: &[V<S>; 3]) -> [V<S>; 3] {
    let mut out = *v;
    for i in 0..3 {
        out[i] = r[3 * i].mul_add(v[0], r[3 * i + 1].mul_add(v[1], r[3 * i + 2] * v[2]));
    }
    out
}

/// `Rᵀ v`.
#[inline(always)]
pub(crate) fn rotated_back<S: Simd>(r: &[V<S>; 9], v: &[V<S>; 3]) -> [V<S>; 3] {
    let mut out = *v;
    for i in 0..3 {
        out[i] = r[i].mul_add(v[0], r[3 + i].mul_add(v[1], r[6 + i] * v[2]));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use pulp::{Arch, Scalar, WithSimd};

    struct FitGroup<'a>(&'a [Lanes; 9]);

    impl WithSimd for FitGroup<'_> {
        type Output = [Lanes; 4];

        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) -> [Lanes; 4] {
            let mut rotation = [Lanes::ZERO; 4];
            fit_group(simd, self.0, &mut rotation);
            rotation
        }
    }

    /// Solid, flat, reflected, collinear, coincident supports and one that is not a number, each lane turned
    /// by another angle.
    fn matrices() -> [Lanes; 9] {
        let kinds = [
            [1.0, 0.7, 0.4],
            [1.0, 0.5, 0.0],
            [1e-6, 2e-6, 1e-7],
            [1.0, 0.6, -0.3],
            [1.0, 0.0, 0.0],
            [0.0; 3],
            [f64::NAN, 1.0, 1.0],
        ];
        let mut a = [Lanes::ZERO; 9];
        for lane in 0..GROUP {
            let spread = kinds[lane % kinds.len()];
            let (s, c) = (0.2 * lane as f64).sin_cos();
            let turn = [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]];
            for i in 0..3 {
                for j in 0..3 {
                    a[3 * i + j].0[lane] = turn[i][j] * spread[j];
                }
            }
        }
        a
    }

    #[test]
    fn every_lane_agrees_with_the_scalar_fit_whatever_the_width_of_vectors() {
        let a = matrices();
        for found in [Arch::new().dispatch(FitGroup(&a)), Scalar.vectorize(FitGroup(&a))] {
            for lane in 0..GROUP {
                let expected = scalar_fit(&a, lane);
                let along: f64 = (0..4).map(|i| found[i].0[lane] * expected[i]).sum();
                assert!((along.abs() - 1.0).abs() < 1e-12, "lane {lane}: {along}");
            }
        }
    }
}
