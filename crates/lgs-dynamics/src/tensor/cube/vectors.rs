//! Vectors, matrices (row by row) and quaternions (w first) in kernels: small arrays in registers.

use cubecl::prelude::*;

/// So many numbers at a place.
#[cube]
pub(super) fn numbers(values: &[f32], at: usize, #[comptime] count: usize) -> Array<f32> {
    let mut out = Array::<f32>::new(count);
    #[unroll]
    for k in 0..count {
        out[k] = values[at + k];
    }
    out
}

/// Writes so many numbers to a place.
#[cube]
pub(super) fn write(values: &mut [f32], at: usize, from: &Array<f32>, #[comptime] count: usize) {
    #[unroll]
    for k in 0..count {
        values[at + k] = from[k];
    }
}

/// So many zeros.
#[cube]
pub(super) fn zeros(#[comptime] count: usize) -> Array<f32> {
    let mut out = Array::<f32>::new(count);
    #[unroll]
    for k in 0..count {
        out[k] = 0.0f32;
    }
    out
}

/// `a + h b` of vectors.
#[cube]
pub(super) fn plus(a: &Array<f32>, b: &Array<f32>, h: f32) -> Array<f32> {
    let mut out = Array::<f32>::new(3usize);
    #[unroll]
    for k in 0..3usize {
        out[k] = a[k] + h * b[k];
    }
    out
}

/// `a · b` of vectors.
#[cube]
pub(super) fn dot(a: &Array<f32>, b: &Array<f32>) -> f32 {
    a[0usize] * b[0usize] + a[1usize] * b[1usize] + a[2usize] * b[2usize]
}

/// `a × b`.
#[cube]
pub(super) fn cross(a: &Array<f32>, b: &Array<f32>) -> Array<f32> {
    let mut out = Array::<f32>::new(3usize);
    out[0usize] = a[1usize] * b[2usize] - a[2usize] * b[1usize];
    out[1usize] = a[2usize] * b[0usize] - a[0usize] * b[2usize];
    out[2usize] = a[0usize] * b[1usize] - a[1usize] * b[0usize];
    out
}

/// `R v`.
#[cube]
pub(super) fn rotated(r: &Array<f32>, v: &Array<f32>) -> Array<f32> {
    let mut out = Array::<f32>::new(3usize);
    #[unroll]
    for i in 0..3usize {
        out[i] = r[3 * i] * v[0usize] + r[3 * i + 1] * v[1usize] + r[3 * i + 2] * v[2usize];
    }
    out
}

/// `Rᵀ v`.
#[cube]
pub(super) fn rotated_back(r: &Array<f32>, v: &Array<f32>) -> Array<f32> {
    let mut out = Array::<f32>::new(3usize);
    #[unroll]
    for i in 0..3usize {
        out[i] = r[i] * v[0usize] + r[3 + i] * v[1usize] + r[6 + i] * v[2usize];
    }
    out
}

/// `Rᵀ A`.
#[cube]
pub(super) fn pulled_back(a: &Array<f32>, r: &Array<f32>) -> Array<f32> {
    let mut out = Array::<f32>::new(9usize);
    #[unroll]
    for i in 0..3usize {
        #[unroll]
        for j in 0..3usize {
            out[3 * i + j] = r[i] * a[j] + r[3 + i] * a[3 + j] + r[6 + i] * a[6 + j];
        }
    }
    out
}

/// The vector `a` with `m − mᵀ = [a]×`.
#[cube]
pub(super) fn axial(m: &Array<f32>) -> Array<f32> {
    let mut out = Array::<f32>::new(3usize);
    out[0usize] = m[7usize] - m[5usize];
    out[1usize] = m[2usize] - m[6usize];
    out[2usize] = m[3usize] - m[1usize];
    out
}

/// The rotation matrix of a unit quaternion.
#[cube]
pub(super) fn matrix(q: &Array<f32>) -> Array<f32> {
    let (w, x, y, z) = (q[0usize], q[1usize], q[2usize], q[3usize]);
    let mut out = Array::<f32>::new(9usize);
    out[0usize] = 1.0f32 - 2.0f32 * (y * y + z * z);
    out[1usize] = 2.0f32 * (x * y - w * z);
    out[2usize] = 2.0f32 * (x * z + w * y);
    out[3usize] = 2.0f32 * (x * y + w * z);
    out[4usize] = 1.0f32 - 2.0f32 * (x * x + z * z);
    out[5usize] = 2.0f32 * (y * z - w * x);
    out[6usize] = 2.0f32 * (x * z - w * y);
    out[7usize] = 2.0f32 * (y * z + w * x);
    out[8usize] = 1.0f32 - 2.0f32 * (x * x + y * y);
    out
}

/// `a ⊗ b` of quaternions.
#[cube]
pub(super) fn product(a: &Array<f32>, b: &Array<f32>) -> Array<f32> {
    let (aw, ax, ay, az) = (a[0usize], a[1usize], a[2usize], a[3usize]);
    let (bw, bx, by, bz) = (b[0usize], b[1usize], b[2usize], b[3usize]);
    let mut out = Array::<f32>::new(4usize);
    out[0usize] = aw * bw - ax * bx - ay * by - az * bz;
    out[1usize] = aw * bx + ax * bw + ay * bz - az * by;
    out[2usize] = aw * by - ax * bz + ay * bw + az * bx;
    out[3usize] = aw * bz + ax * by - ay * bx + az * bw;
    out
}

/// The conjugate of a quaternion.
#[cube]
pub(super) fn conjugate(q: &Array<f32>) -> Array<f32> {
    let mut out = Array::<f32>::new(4usize);
    out[0usize] = q[0usize];
    #[unroll]
    for k in 1..4usize {
        out[k] = -q[k];
    }
    out
}

/// A quaternion over its length.
#[cube]
pub(super) fn normalised(q: &Array<f32>) -> Array<f32> {
    let squares =
        q[0usize] * q[0usize] + q[1usize] * q[1usize] + q[2usize] * q[2usize] + q[3usize] * q[3usize];
    let per_length = 1.0f32 / squares.sqrt();
    let mut out = Array::<f32>::new(4usize);
    #[unroll]
    for k in 0..4usize {
        out[k] = q[k] * per_length;
    }
    out
}
