//! Small dense linear algebra in double precision: least squares, symmetric eigenvectors, the nearest
//! rotation.
//!
//! The fits of this crate have a few dozen unknowns at most, so plain loops are enough; double precision
//! because they difference positions twice.

pub(crate) use lgs_core::linear::solve_positive;

/// A point or vector.
pub(crate) type V3 = [f64; 3];
/// A 3×3 matrix, row by row.
pub(crate) type M3 = [[f64; 3]; 3];

/// The identity.
pub(crate) const IDENTITY: M3 = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// `m v`.
#[inline]
pub(crate) fn mat_vec(m: &M3, v: V3) -> V3 {
    [dot(m[0], v), dot(m[1], v), dot(m[2], v)]
}

/// `mᵀ v`.
#[inline]
pub(crate) fn mat_t_vec(m: &M3, v: V3) -> V3 {
    std::array::from_fn(|i| m[0][i] * v[0] + m[1][i] * v[1] + m[2][i] * v[2])
}

/// `a b`.
pub(crate) fn mat_mul(a: &M3, b: &M3) -> M3 {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..3).map(|k| a[i][k] * b[k][j]).sum()))
}

/// `a · b`.
#[inline]
pub(crate) fn dot(a: V3, b: V3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// `a × b`.
#[inline]
pub(crate) fn cross(a: V3, b: V3) -> V3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// `a + b`.
#[inline]
pub(crate) fn add(a: V3, b: V3) -> V3 {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// `a − b`.
#[inline]
pub(crate) fn sub(a: V3, b: V3) -> V3 {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// `s a`.
#[inline]
pub(crate) fn scale(a: V3, s: f64) -> V3 {
    [s * a[0], s * a[1], s * a[2]]
}

/// `|a|²`.
#[inline]
pub(crate) fn norm2(a: V3) -> f64 {
    dot(a, a)
}

/// Single to double precision.
#[inline]
pub(crate) fn wide(a: [f32; 3]) -> V3 {
    a.map(f64::from)
}

/// Double to single precision.
#[inline]
pub(crate) fn narrow(a: V3) -> [f32; 3] {
    a.map(|v| v as f32)
}

/// The inverse of a 3×3 matrix by cofactors; `None` if it is singular.
pub(crate) fn inverse3(m: &M3) -> Option<M3> {
    let c0 = cross(m[1], m[2]);
    let c1 = cross(m[2], m[0]);
    let c2 = cross(m[0], m[1]);
    let determinant = dot(m[0], c0);
    if !(determinant.abs() > 1e-300 && determinant.is_finite()) {
        return None;
    }
    Some(std::array::from_fn(|i| [c0[i] / determinant, c1[i] / determinant, c2[i] / determinant]))
}

/// Eigenvalues (descending) and unit eigenvectors (rows of the second array) of a symmetric matrix, by cyclic
/// Jacobi rotations.
pub(crate) fn symmetric_eigen<const N: usize>(mut a: [[f64; N]; N]) -> ([f64; N], [[f64; N]; N]) {
    let mut vectors = [[0.0; N]; N];
    for (i, row) in vectors.iter_mut().enumerate() {
        row[i] = 1.0;
    }
    for _ in 0..30 {
        let off: f64 = (0..N).flat_map(|i| (0..i).map(move |j| (i, j))).map(|(i, j)| a[i][j] * a[i][j]).sum();
        let diagonal: f64 = (0..N).map(|i| a[i][i] * a[i][i]).sum();
        if off <= 1e-30 * diagonal || off == 0.0 {
            break;
        }
        for p in 0..N {
            for q in p + 1..N {
                rotate(&mut a, &mut vectors, p, q);
            }
        }
    }
    let mut order: [usize; N] = std::array::from_fn(|i| i);
    order.sort_by(|&i, &j| a[j][j].total_cmp(&a[i][i]));
    (order.map(|i| a[i][i]), order.map(|i| vectors[i]))
}

/// One Jacobi rotation that zeroes `a[p][q]`.
fn rotate<const N: usize>(a: &mut [[f64; N]; N], vectors: &mut [[f64; N]; N], p: usize, q: usize) {
    if a[p][q] == 0.0 {
        return;
    }
    let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
    let t = theta.signum() / (theta.abs() + theta.hypot(1.0));
    let c = 1.0 / t.hypot(1.0);
    let s = t * c;
    for row in a.iter_mut() {
        (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
    }
    for k in 0..N {
        (a[p][k], a[q][k]) = (c * a[p][k] - s * a[q][k], s * a[p][k] + c * a[q][k]);
        (vectors[p][k], vectors[q][k]) =
            (c * vectors[p][k] - s * vectors[q][k], s * vectors[p][k] + c * vectors[q][k]);
    }
}

/// The rotation `R` that maximises `tr(Rᵀ a)`, through Horn's quaternion form: defined (if not unique) for
/// every `a`.
pub(crate) fn nearest_rotation(a: &M3) -> M3 {
    let [[xx, yx, zx], [xy, yy, zy], [xz, yz, zz]] = *a;
    let (values, vectors) = symmetric_eigen([
        [xx + yy + zz, yz - zy, zx - xz, xy - yx],
        [yz - zy, xx - yy - zz, xy + yx, zx + xz],
        [zx - xz, xy + yx, yy - xx - zz, yz + zy],
        [xy - yx, zx + xz, yz + zy, zz - xx - yy],
    ]);
    if !values[0].is_finite() || values[0] <= 0.0 {
        return IDENTITY;
    }
    rotation_of_quaternion(vectors[0])
}

/// The matrix of a unit quaternion `[w, x, y, z]`.
fn rotation_of_quaternion([w, x, y, z]: [f64; 4]) -> M3 {
    [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
    ]
}

/// The rotation by the vector `r` (axis times angle).
pub(crate) fn rotation_of_vector(r: V3) -> M3 {
    let angle = norm2(r).sqrt();
    let half = 0.5 * angle;
    let sinc = if angle < 1e-8 { 0.5 } else { half.sin() / angle };
    rotation_of_quaternion([half.cos(), sinc * r[0], sinc * r[1], sinc * r[2]])
}

/// The middle value of a list (0 for an empty one); the upper of the two in an even one.
pub(crate) fn median(mut values: Vec<f64>) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_rotation_of_a_stretched_rotation_is_that_rotation() {
        let r = rotation_of_vector([0.4, -1.7, 0.9]);
        let stretched = mat_mul(&r, &[[2.0, 0.1, 0.0], [0.1, 1.0, 0.2], [0.0, 0.2, 0.5]]);
        let found = nearest_rotation(&stretched);
        for i in 0..3 {
            for j in 0..3 {
                assert!((found[i][j] - r[i][j]).abs() < 1e-12, "{found:?} {r:?}");
            }
        }
        assert_eq!(nearest_rotation(&[[0.0; 3]; 3]), IDENTITY);
    }

    #[test]
    fn cholesky_and_cofactors_agree() {
        let m = [[4.0, 1.0, 0.5], [1.0, 3.0, 0.2], [0.5, 0.2, 2.0]];
        let inverse = inverse3(&m).unwrap();
        let mut a: Vec<f64> = m.concat();
        let mut b = IDENTITY.concat();
        assert!(solve_positive(&mut a, &mut b, 3, 3));
        for (x, y) in b.iter().zip(inverse.as_flattened()) {
            assert!((x - y).abs() < 1e-12);
        }
        assert!(!solve_positive(&mut [1.0, 2.0, 2.0, 1.0], &mut [0.0; 2], 2, 1));
    }
}
