//! Quaternions and rotation vectors in kernels: arrays of four numbers in registers, w first, and of three.
#![allow(missing_docs, reason = "those of what the language's macro writes beside a function")]

use burn_cubecl::cubecl::{self, prelude::*};

/// Below this squared angle the coefficients of a rotation come from their series.
const SMALL_SQUARED_ANGLE: f32 = 1e-3;

/// The rotation matrix of a unit quaternion, row by row.
#[cube]
pub fn matrix(q: &Array<f32>) -> Array<f32> {
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

/// `a ⊗ b`.
#[cube]
pub fn product(a: &Array<f32>, b: &Array<f32>) -> Array<f32> {
    let (aw, ax, ay, az) = (a[0usize], a[1usize], a[2usize], a[3usize]);
    let (bw, bx, by, bz) = (b[0usize], b[1usize], b[2usize], b[3usize]);
    let mut out = Array::<f32>::new(4usize);
    out[0usize] = aw * bw - ax * bx - ay * by - az * bz;
    out[1usize] = aw * bx + ax * bw + ay * bz - az * by;
    out[2usize] = aw * by - ax * bz + ay * bw + az * bx;
    out[3usize] = aw * bz + ax * by - ay * bx + az * bw;
    out
}

/// The conjugate, which is the inverse of a unit quaternion.
#[cube]
pub fn conjugate(q: &Array<f32>) -> Array<f32> {
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
pub fn normalised(q: &Array<f32>) -> Array<f32> {
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

/// For the squared angle of a rotation vector: cos(θ/2), sin(θ/2)/θ and the derivative of the latter by θ,
/// divided by θ.
#[cube]
pub fn half_angle(squared: f32) -> Array<f32> {
    let mut out = Array::<f32>::new(3usize);
    if squared < SMALL_SQUARED_ANGLE {
        out[0usize] = 1.0f32 - squared / 8.0f32;
        out[1usize] = 0.5f32 - squared / 48.0f32;
        out[2usize] = squared / 960.0f32 - 1.0f32 / 24.0f32;
    } else {
        let theta = squared.sqrt();
        let sine = (0.5f32 * theta).sin() / theta;
        let cosine = (0.5f32 * theta).cos();
        out[0usize] = cosine;
        out[1usize] = sine;
        out[2usize] = (0.5f32 * cosine - sine) / squared;
    }
    out
}

/// The squared angle of the rotation vector at a place.
#[cube]
pub fn squared_angle(values: &[f32], at: usize) -> f32 {
    values[at] * values[at]
        + values[at + 1usize] * values[at + 1usize]
        + values[at + 2usize] * values[at + 2usize]
}

/// The quaternion of the rotation vector at a place.
#[cube]
pub fn exponential(values: &[f32], at: usize) -> Array<f32> {
    let half = half_angle(squared_angle(values, at));
    let mut q = Array::<f32>::new(4usize);
    q[0usize] = half[0usize];
    for k in 0..3usize {
        q[k + 1usize] = half[1usize] * values[at + k];
    }
    q
}
