//! Small linear algebra on arrays in single precision: quaternions `[w, x, y, z]` and 3×3 matrices stored row
//! by row.

/// A 3×3 matrix, row by row.
pub type Mat3 = [[f32; 3]; 3];

/// Hamilton product `a ⊗ b`: the rotation `b` followed by `a`.
#[must_use]
#[inline]
pub fn quat_mul(a: [f32; 4], b: [f32; 4]) -> [f32; 4] {
    [
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    ]
}

/// The conjugate of a quaternion: the inverse of a rotation.
#[inline]
#[must_use]
pub fn quat_conjugate([w, x, y, z]: [f32; 4]) -> [f32; 4] {
    [w, -x, -y, -z]
}

/// The quaternion scaled to unit length; a (near) zero one becomes the identity.
#[must_use]
#[inline]
pub fn quat_normalize(q: [f32; 4]) -> [f32; 4] {
    let norm = q.iter().map(|v| v * v).sum::<f32>().sqrt();
    if norm > 1e-12 { q.map(|v| v / norm) } else { [1.0, 0.0, 0.0, 0.0] }
}

/// The rotation matrix of a unit quaternion.
#[must_use]
#[inline]
pub fn matrix_from_quat(q: [f32; 4]) -> Mat3 {
    let [w, x, y, z] = q;
    [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
    ]
}

/// The unit quaternion (w ≥ 0) of a rotation matrix, stable for every angle.
#[must_use]
pub fn quat_from_matrix(m: &Mat3) -> [f32; 4] {
    let columns = glam::Mat3::from_cols_array_2d(&transpose(m));
    let q = glam::Quat::from_mat3(&columns);
    let sign = if q.w < 0.0 { -1.0 } else { 1.0 };
    quat_normalize([sign * q.w, sign * q.x, sign * q.y, sign * q.z])
}

/// `mᵀ`.
#[must_use]
#[inline]
pub fn transpose(m: &Mat3) -> Mat3 {
    [[m[0][0], m[1][0], m[2][0]], [m[0][1], m[1][1], m[2][1]], [m[0][2], m[1][2], m[2][2]]]
}

/// `a b`.
#[must_use]
#[inline]
pub fn mat_mul(a: &Mat3, b: &Mat3) -> Mat3 {
    std::array::from_fn(|i| {
        std::array::from_fn(|j| a[i][0] * b[0][j] + a[i][1] * b[1][j] + a[i][2] * b[2][j])
    })
}

/// `m v`.
#[must_use]
#[inline]
pub fn mat_vec(m: &Mat3, v: [f32; 3]) -> [f32; 3] {
    std::array::from_fn(|i| dot(m[i], v))
}

/// `a · b`.
#[must_use]
#[inline]
pub fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// `a × b`.
#[must_use]
#[inline]
pub fn cross(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// `a + b`.
#[must_use]
#[inline]
pub fn add(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    std::array::from_fn(|i| a[i] + b[i])
}

/// `a − b`.
#[must_use]
#[inline]
pub fn sub(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    std::array::from_fn(|i| a[i] - b[i])
}

/// `s a`.
#[must_use]
#[inline]
pub fn scale(a: [f32; 3], s: f32) -> [f32; 3] {
    a.map(|v| v * s)
}

/// Euclidean length.
#[must_use]
#[inline]
pub fn norm(a: [f32; 3]) -> f32 {
    dot(a, a).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quaternions_and_matrices_round_trip_at_every_angle() {
        for step in 0..64 {
            let angle = step as f32 * 0.1;
            let (s, c) = (0.5 * angle).sin_cos();
            let q = quat_normalize([c, s * 0.6, s * -0.48, s * 0.64]);
            let back = quat_from_matrix(&matrix_from_quat(q));
            let sign = if q[0] < 0.0 { -1.0 } else { 1.0 };
            let worst = (0..4).map(|i| (sign * q[i] - back[i]).abs()).fold(0.0, f32::max);
            assert!(worst < 1e-5 || (q[0].abs() < 1e-3), "angle {angle}: {q:?} {back:?}");
        }
    }

    #[test]
    fn the_product_of_quaternions_is_the_product_of_matrices() {
        let (a, b) = (quat_normalize([0.3, -0.5, 0.7, 0.1]), quat_normalize([0.9, 0.2, -0.1, 0.4]));
        let product = matrix_from_quat(quat_mul(a, b));
        let expected = mat_mul(&matrix_from_quat(a), &matrix_from_quat(b));
        for (row, other) in product.iter().zip(&expected) {
            for (x, y) in row.iter().zip(other) {
                assert!((x - y).abs() < 1e-6);
            }
        }
    }
}
