//! The rotation that fits a matrix, in single precision (method §4.6): Newton's method, and Horn's
//! eigenvector where it fails, as [`lgs_core::geometry::fit_rotation`] does in double precision.

use cubecl::prelude::*;
use lgs_tensor::cube::quaternions::{matrix, normalised, product};
use lgs_tensor::cube::vectors::zeros;

use super::vectors::{axial, pulled_back};
use crate::thresholds::{
    ALIGNMENT_ITERATIONS_F32, CONVERGED_F32, EIGENVALUE_GAP, LEAST_OFF_DIAGONAL, LEAST_PROJECTION,
    LEAST_SCALE, NEARLY_CONVERGED, SWEEPS,
};
use lgs_core::thresholds::LEAST_DETERMINANT;

/// The least determinant in the kernels' precision.
const LEAST: f32 = LEAST_DETERMINANT as f32;

/// No rotation.
#[cube]
pub(super) fn identity() -> Array<f32> {
    let mut q = zeros(4usize);
    q[0usize] = 1.0f32;
    q
}

/// The rotation that fits a matrix whose largest entry is one.
#[cube]
pub(super) fn fitted(a: &Array<f32>) -> Array<f32> {
    let mut found = newton(a, &identity());
    if found[4usize] == 0.0f32 {
        found = by_eigenvector(a);
    }
    let mut q = Array::<f32>::new(4usize);
    #[unroll]
    for i in 0..4usize {
        q[i] = found[i];
    }
    q
}

/// Newton's method from a rotation; the last number is 1 where it has arrived.
#[cube]
fn newton(a: &Array<f32>, from: &Array<f32>) -> Array<f32> {
    let mut out = Array::<f32>::new(5usize);
    #[unroll]
    for i in 0..4usize {
        out[i] = from[i];
    }
    out[4usize] = 0.0f32;
    let mut square = 1.0f32;
    for _ in 0..ALIGNMENT_ITERATIONS_F32 {
        let mut q = numbers_of(&out);
        let k = pulled_back(a, &matrix(&q));
        let factor = curvature(&k);
        if factor[6usize] == 0.0f32 {
            square = 1.0f32;
            break;
        }
        let turn = solve(&factor, &axial(&k));
        let mut by = Array::<f32>::new(4usize);
        by[0usize] = 1.0f32;
        square = 0.0f32;
        #[unroll]
        for i in 0..3usize {
            by[i + 1] = 0.5f32 * turn[i];
            square += turn[i] * turn[i];
        }
        q = normalised(&product(&q, &by));
        #[unroll]
        for i in 0..4usize {
            out[i] = q[i];
        }
        if square < CONVERGED_F32 {
            break;
        }
    }
    // What still moves has arrived but for the rounding of a thin support.
    out[4usize] = select(square < NEARLY_CONVERGED, 1.0f32, 0.0f32);
    out
}

/// The first four numbers.
#[cube]
fn numbers_of(values: &Array<f32>) -> Array<f32> {
    let mut q = Array::<f32>::new(4usize);
    #[unroll]
    for i in 0..4usize {
        q[i] = values[i];
    }
    q
}

/// The factor of `tr(K) I − sym(K)` as inverses of its diagonal and what is beside it; the last number is 1
/// where that is positive definite by a margin.
#[cube]
pub(super) fn curvature(k: &Array<f32>) -> Array<f32> {
    let trace = k[0usize] + k[4usize] + k[8usize];
    let mut m = Array::<f32>::new(6usize);
    m[0usize] = k[4usize] + k[8usize];
    m[1usize] = -0.5f32 * (k[1usize] + k[3usize]);
    m[2usize] = k[0usize] + k[8usize];
    m[3usize] = -0.5f32 * (k[2usize] + k[6usize]);
    m[4usize] = -0.5f32 * (k[5usize] + k[7usize]);
    m[5usize] = k[0usize] + k[4usize];
    factor(&m, trace)
}

/// The factor of a symmetric matrix given as m00, m10, m11, m20, m21, m22
/// ([`lgs_core::geometry::PositiveFactor`]).
#[cube]
pub(super) fn factor(m: &Array<f32>, scale: f32) -> Array<f32> {
    let mut out = zeros(7usize);
    let tiny = LEAST * scale;
    if m[0usize] > tiny && m[0usize] > LEAST_SCALE {
        let i00 = 1.0f32 / m[0usize].sqrt();
        let (l10, l20) = (m[1usize] * i00, m[3usize] * i00);
        let d11 = m[2usize] - l10 * l10;
        if d11 > tiny && d11 > LEAST_SCALE {
            let i11 = 1.0f32 / d11.sqrt();
            let l21 = (m[4usize] - l20 * l10) * i11;
            let d22 = m[5usize] - l20 * l20 - l21 * l21;
            if d22 > tiny && d22 > LEAST_SCALE {
                out[0usize] = i00;
                out[1usize] = l10;
                out[2usize] = i11;
                out[3usize] = l20;
                out[4usize] = l21;
                out[5usize] = 1.0f32 / d22.sqrt();
                out[6usize] = 1.0f32;
            }
        }
    }
    out
}

/// The solution of `L Lᵀ y = b`; zero without a factor.
#[cube]
pub(super) fn solve(factor: &Array<f32>, b: &Array<f32>) -> Array<f32> {
    let x0 = b[0usize] * factor[0usize];
    let x1 = (b[1usize] - factor[1usize] * x0) * factor[2usize];
    let x2 = (b[2usize] - factor[3usize] * x0 - factor[4usize] * x1) * factor[5usize];
    let mut y = Array::<f32>::new(3usize);
    y[2usize] = x2 * factor[5usize];
    y[1usize] = (x1 - factor[4usize] * y[2usize]) * factor[2usize];
    y[0usize] = (x0 - factor[1usize] * y[1usize] - factor[3usize] * y[2usize]) * factor[0usize];
    y
}

/// Newton's method from the leading eigenvector of Horn's matrix. Where even that has no curvature, the
/// smallest of the rotations that the points leave open: what the eigenvectors of the greatest eigenvalue
/// show of the identity.
#[cube]
fn by_eigenvector(a: &Array<f32>) -> Array<f32> {
    let mut s = horn(a);
    let mut vectors = Array::<f32>::new(16usize);
    #[unroll]
    for i in 0..16usize {
        vectors[i] = select(i % 5usize == 0usize, 1.0f32, 0.0f32);
    }
    for _ in 0..SWEEPS {
        for p in 0..3usize {
            for q in p + 1usize..4usize {
                rotate_plane(&mut s, &mut vectors, p, q);
            }
        }
    }
    let mut best = 0usize;
    for i in 1..4usize {
        best = select(s[5usize * i] > s[5usize * best], i, best);
    }
    let mut leading = Array::<f32>::new(4usize);
    for i in 0..4usize {
        leading[i] = vectors[4usize * i + best];
    }
    let mut found = newton(a, &normalised(&leading));
    if found[4usize] == 0.0f32 {
        found = smallest(&s, &vectors, &leading, s[5usize * best]);
    }
    let sign = select(found[0usize] < 0.0f32, -1.0f32, 1.0f32);
    for i in 0..4usize {
        found[i] = sign * found[i];
    }
    found
}

/// Horn's symmetric 4×4 matrix, row by row, whose leading eigenvector is the quaternion of the best rotation.
#[cube]
fn horn(a: &Array<f32>) -> Array<f32> {
    let trace = a[0usize] + a[4usize] + a[8usize];
    let v = axial(a);
    let mut s = Array::<f32>::new(16usize);
    s[0usize] = trace;
    #[unroll]
    for i in 0..3usize {
        s[i + 1] = v[i];
        s[4 * (i + 1)] = v[i];
        #[unroll]
        for j in 0..3usize {
            s[4 * (i + 1) + j + 1] = a[3 * i + j] + a[3 * j + i];
        }
        s[5 * (i + 1)] = s[5 * (i + 1)] - trace;
    }
    s
}

/// A Jacobi rotation, which takes the entry (p, q) of a symmetric 4×4 matrix to zero.
#[cube]
fn rotate_plane(s: &mut Array<f32>, vectors: &mut Array<f32>, p: usize, q: usize) {
    let off = s[4usize * p + q];
    if off.abs() > LEAST_OFF_DIAGONAL {
        let theta = (s[5usize * q] - s[5usize * p]) / (2.0f32 * off);
        let sign = select(theta < 0.0f32, -1.0f32, 1.0f32);
        let tangent = sign / (theta.abs() + (theta * theta + 1.0f32).sqrt());
        let cosine = 1.0f32 / (tangent * tangent + 1.0f32).sqrt();
        let sine = tangent * cosine;
        for i in 0..4usize {
            let (x, y) = (s[4usize * i + p], s[4usize * i + q]);
            s[4usize * i + p] = cosine * x - sine * y;
            s[4usize * i + q] = sine * x + cosine * y;
            let (x, y) = (vectors[4usize * i + p], vectors[4usize * i + q]);
            vectors[4usize * i + p] = cosine * x - sine * y;
            vectors[4usize * i + q] = sine * x + cosine * y;
        }
        for i in 0..4usize {
            let (x, y) = (s[4usize * p + i], s[4usize * q + i]);
            s[4usize * p + i] = cosine * x - sine * y;
            s[4usize * q + i] = sine * x + cosine * y;
        }
    }
}

/// The identity's part in the space of the eigenvectors of an eigenvalue, or one of these.
#[cube]
fn smallest(s: &Array<f32>, vectors: &Array<f32>, leading: &Array<f32>, greatest: f32) -> Array<f32> {
    let mut sum = zeros(4usize);
    for column in 0..4usize {
        let is_open = s[5usize * column] >= greatest - EIGENVALUE_GAP * greatest.abs();
        let along = select(is_open, vectors[column], 0.0f32);
        for i in 0..4usize {
            sum[i] = sum[i] + along * vectors[4usize * i + column];
        }
    }
    // The square of the part's length is the part along the identity.
    let is_seen = sum[0usize] > LEAST_PROJECTION;
    let mut q = Array::<f32>::new(4usize);
    for i in 0..4usize {
        q[i] = select(is_seen, sum[i], leading[i]);
    }
    let unit = normalised(&q);
    let mut out = Array::<f32>::new(5usize);
    for i in 0..4usize {
        out[i] = unit[i];
    }
    out[4usize] = 1.0f32;
    out
}
