//! The rotation that fits one point set to another, and its derivative.
//!
//! `R = argmax tr(RᵀA)` over SO(3) is found by Newton's method from the identity, since the rotation of one
//! step is small: with `K = RᵀA`, the gradient in body axes is `vex(K − Kᵀ)` and the negative Hessian `M =
//! tr(K) I − sym(K)`. A stationary point with `M` positive definite is the global maximum (the others are
//! saddles), so success is certified; otherwise Horn's 4×4 matrix is diagonalised by Jacobi rotations. The
//! derivative needs no singular vectors: method §4.6. All in f64. Alignment runs the same method on many
//! supports in SIMD lanes ([`crate::kabsch_lanes`]) and comes here with those whose rotation the lanes can't
//! certify.

use lgs_core::linear::{Mat3, matrix_from_quat};

/// A 3×3 matrix in double precision.
pub(crate) type Mat3d = [[f64; 3]; 3];

/// `det M` over `tr³ K` under which the support is called degenerate: about (s₂ + s₃)/s₁ of the signed
/// singular values. f32 coordinates leave about 1e-7 of noise there.
pub(crate) const DEGENERATE: f64 = 1e-6;

/// Least pivot of `M`, whatever its scale.
pub(crate) const TINY: f64 = 1e-30;

/// Square of the Newton step, squared radians, after which one more leaves rounding error: it squares the
/// error that is left.
pub(crate) const CONVERGED: f64 = 1e-10;

/// How strongly a degenerate fit is drawn to the identity: what the data leave open is not rotated.
const DEGENERATE_PULL: f64 = 1e-5;

/// A fitted rotation.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Fit {
    /// Unit quaternion.
    rotation: [f64; 4],
    /// The lower triangle of the Cholesky factor of `M`; none where the support is degenerate and the
    /// rotation has no derivative.
    curvature: Option<Cholesky>,
}

/// The rotation `R ∈ SO(3)` that maximises `tr(RᵀA)`, for `A = Σ target sourceᵀ` of centred points (Eq. 6).
///
/// Where the points leave rotations open (collinear, coincident, fewer than three) the smallest of them is
/// taken.
#[must_use]
pub fn kabsch(a: &Mat3) -> Mat3 {
    matrix_from_quat(fit(&widen(a)).rotation.map(|v| v as f32))
}

/// Backwards through [`kabsch`]: the cotangent of `A` given that of `R`; zero where the rotation has no
/// derivative.
#[must_use]
pub fn kabsch_vjp(a: &Mat3, v_rotation: &Mat3) -> Mat3 {
    let fitted = fit(&widen(a));
    let r = matrix_from_quat_f64(fitted.rotation);
    let pulled = mat_mul(&transpose(&r), &widen(v_rotation));
    let Some(curvature) = fitted.curvature else { return [[0.0; 3]; 3] };
    let y = curvature.solve(vex(&pulled));
    mat_mul(&r, &skew(y)).map(|row| row.map(|v| v as f32))
}

/// The best rotation for `A` as a unit quaternion.
pub(crate) fn quaternion(a: &Mat3d) -> [f64; 4] {
    fit(a).rotation
}

/// Fits a rotation to `A`.
fn fit(a: &Mat3d) -> Fit {
    const ITERATIONS: usize = 12;
    let mut rotation = [1.0, 0.0, 0.0, 0.0];
    for _ in 0..ITERATIONS {
        let k = pulled_back(a, rotation);
        let Some(curvature) = Cholesky::of_curvature(&k) else { break };
        let turn = curvature.solve(vex(&k));
        rotation = normalize(quat_mul(rotation, [1.0, 0.5 * turn[0], 0.5 * turn[1], 0.5 * turn[2]]));
        if turn[0] * turn[0] + turn[1] * turn[1] + turn[2] * turn[2] < CONVERGED {
            return Fit { rotation, curvature: Some(curvature) };
        }
    }
    fit_by_eigenvector(a)
}

fn fit_by_eigenvector(a: &Mat3d) -> Fit {
    let rotation = largest_eigenvector(&horn_matrix(a));
    if let Some(curvature) = Cholesky::of_curvature(&pulled_back(a, rotation)) {
        return Fit { rotation, curvature: Some(curvature) };
    }
    let norm = a.as_flattened().iter().map(|v| v * v).sum::<f64>().sqrt();
    if norm.is_nan() || norm < TINY {
        return Fit { rotation: [1.0, 0.0, 0.0, 0.0], curvature: None };
    }
    let mut drawn = *a;
    for (axis, row) in drawn.iter_mut().enumerate() {
        row[axis] += DEGENERATE_PULL * norm;
    }
    Fit { rotation: largest_eigenvector(&horn_matrix(&drawn)), curvature: None }
}

/// `RᵀA`.
fn pulled_back(a: &Mat3d, rotation: [f64; 4]) -> Mat3d {
    mat_mul(&transpose(&matrix_from_quat_f64(rotation)), a)
}

/// A lower triangular factor `L` of a symmetric matrix `L Lᵀ`: l00, l10, l11, l20, l21, l22, with the
/// diagonal inverted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Cholesky([f64; 6]);

impl Cholesky {
    /// Of `tr(K) I − sym(K)`, if it is positive definite by a margin.
    fn of_curvature(k: &Mat3d) -> Option<Self> {
        let trace = k[0][0] + k[1][1] + k[2][2];
        let off = |i: usize, j: usize| -0.5 * (k[i][j] + k[j][i]);
        let m = [trace - k[0][0], off(1, 0), trace - k[1][1], off(2, 0), off(2, 1), trace - k[2][2]];
        Self::new(m, trace)
    }

    /// Of a symmetric matrix given as m00, m10, m11, m20, m21, m22 whose determinant exceeds a small part of
    /// `scale³`.
    pub(crate) fn new(m: [f64; 6], scale: f64) -> Option<Self> {
        let tiny = DEGENERATE * scale;
        let positive = |v: f64| v.is_finite() && v > tiny && v > TINY;
        if !positive(m[0]) {
            return None;
        }
        let i00 = 1.0 / m[0].sqrt();
        let (l10, l20) = (m[1] * i00, m[3] * i00);
        let d11 = m[2] - l10 * l10;
        if !positive(d11) {
            return None;
        }
        let i11 = 1.0 / d11.sqrt();
        let l21 = (m[4] - l20 * l10) * i11;
        let d22 = m[5] - l20 * l20 - l21 * l21;
        positive(d22).then(|| Self([i00, l10, i11, l20, l21, 1.0 / d22.sqrt()]))
    }

    /// The solution `y` of `L Lᵀ y = b`.
    pub(crate) fn solve(&self, b: [f64; 3]) -> [f64; 3] {
        let [i00, l10, i11, l20, l21, i22] = self.0;
        let x0 = b[0] * i00;
        let x1 = (b[1] - l10 * x0) * i11;
        let x2 = (b[2] - l20 * x0 - l21 * x1) * i22;
        let y2 = x2 * i22;
        let y1 = (x1 - l21 * y2) * i11;
        [(x0 - l10 * y1 - l20 * y2) * i00, y1, y2]
    }
}

/// Horn's symmetric matrix, whose eigenvector of the largest eigenvalue is the quaternion of the best
/// rotation.
fn horn_matrix(a: &Mat3d) -> [[f64; 4]; 4] {
    let [[xx, yx, zx], [xy, yy, zy], [xz, yz, zz]] = *a; // a[target][source], so xy = source x times target y
    [
        [xx + yy + zz, yz - zy, zx - xz, xy - yx],
        [yz - zy, xx - yy - zz, xy + yx, zx + xz],
        [zx - xz, xy + yx, yy - xx - zz, yz + zy],
        [xy - yx, zx + xz, yz + zy, zz - xx - yy],
    ]
}

/// The unit eigenvector of the largest eigenvalue, by cyclic Jacobi rotations.
fn largest_eigenvector(matrix: &[[f64; 4]; 4]) -> [f64; 4] {
    const SWEEPS: usize = 12;
    let mut m = *matrix;
    let mut vectors: [[f64; 4]; 4] =
        std::array::from_fn(|i| std::array::from_fn(|j| f64::from(u8::from(i == j))));
    for _ in 0..SWEEPS {
        for p in 0..3 {
            for q in p + 1..4 {
                jacobi_rotation(&mut m, &mut vectors, p, q);
            }
        }
    }
    let best = (1..4).fold(0, |best, i| if m[i][i] > m[best][best] { i } else { best });
    let vector = normalize(std::array::from_fn(|i| vectors[i][best]));
    if vector[0] < 0.0 { vector.map(|v| -v) } else { vector }
}

fn jacobi_rotation(m: &mut [[f64; 4]; 4], vectors: &mut [[f64; 4]; 4], p: usize, q: usize) {
    if m[p][q].abs() < 1e-300 {
        return;
    }
    let theta = (m[q][q] - m[p][p]) / (2.0 * m[p][q]);
    let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
    let c = 1.0 / (t * t + 1.0).sqrt();
    let s = t * c;
    for row in m.iter_mut().chain(vectors.iter_mut()) {
        (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
    }
    #[expect(clippy::needless_range_loop, reason = "two rows of one matrix")]
    for column in 0..4 {
        (m[p][column], m[q][column]) =
            (c * m[p][column] - s * m[q][column], s * m[p][column] + c * m[q][column]);
    }
}

fn normalize(q: [f64; 4]) -> [f64; 4] {
    let norm = q.iter().map(|v| v * v).sum::<f64>().sqrt();
    if norm > 0.0 && norm.is_finite() { q.map(|v| v / norm) } else { [1.0, 0.0, 0.0, 0.0] }
}

fn quat_mul(a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
    [
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    ]
}

/// The rotation matrix of a unit quaternion.
fn matrix_from_quat_f64([w, x, y, z]: [f64; 4]) -> Mat3d {
    [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
    ]
}

/// `vex(X − Xᵀ)`.
fn vex(x: &Mat3d) -> [f64; 3] {
    [x[2][1] - x[1][2], x[0][2] - x[2][0], x[1][0] - x[0][1]]
}

/// `[y]×`.
fn skew([x, y, z]: [f64; 3]) -> Mat3d {
    [[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]]
}

/// `m` in double precision.
fn widen(m: &Mat3) -> Mat3d {
    m.map(|row| row.map(f64::from))
}

fn transpose(m: &Mat3d) -> Mat3d {
    std::array::from_fn(|i| std::array::from_fn(|j| m[j][i]))
}

fn mat_mul(a: &Mat3d, b: &Mat3d) -> Mat3d {
    std::array::from_fn(|i| {
        std::array::from_fn(|j| a[i][0] * b[0][j] + a[i][1] * b[1][j] + a[i][2] * b[2][j])
    })
}

#[cfg(test)]
mod tests;
