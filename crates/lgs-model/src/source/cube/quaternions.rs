//! Quaternions and rotation vectors in kernels: arrays of four numbers, w first, and of three.

use cubecl::prelude::*;

/// Below this squared angle the coefficients of a rotation come from their series (`super::super::pose`).
const SMALL_SQUARED_ANGLE: f32 = 1e-3;

/// The quaternion at a place, divided by its length, and the length in the fifth place.
#[cube]
pub(in crate::source) fn unit(values: &[f32], at: usize) -> Array<f32> {
    let mut q = Array::<f32>::new(5usize);
    let mut squares = 0.0f32;
    for k in 0..4usize {
        squares += values[at + k] * values[at + k];
    }
    let length = squares.sqrt().max(1e-12f32);
    for k in 0..4usize {
        q[k] = values[at + k] / length;
    }
    q[4usize] = length;
    q
}

/// Cotangent of a quaternion, given that of its unit form, which [`unit`] gave with the length.
#[cube]
pub(in crate::source) fn unit_vjp(q: &Array<f32>, v: &Array<f32>) -> Array<f32> {
    let along = q[0usize] * v[0usize] + q[1usize] * v[1usize] + q[2usize] * v[2usize] + q[3usize] * v[3usize];
    let mut out = Array::<f32>::new(4usize);
    for k in 0..4usize {
        out[k] = (v[k] - q[k] * along) / q[4usize];
    }
    out
}

/// Writes [`unit_vjp`] to a place.
#[cube]
pub(in crate::source) fn write_unit_vjp(q: &Array<f32>, v: &Array<f32>, out: &mut [f32], at: usize) {
    let v_quaternion = unit_vjp(q, v);
    for k in 0..4usize {
        out[at + k] = v_quaternion[k];
    }
}

/// `a ⊗ b`.
#[cube]
pub(in crate::source) fn product(a: &Array<f32>, b: &Array<f32>) -> Array<f32> {
    let mut q = Array::<f32>::new(4usize);
    q[0usize] = a[0usize] * b[0usize] - a[1usize] * b[1usize] - a[2usize] * b[2usize] - a[3usize] * b[3usize];
    for k in 0..3usize {
        let (i, j) = ((k + 1usize) % 3usize + 1usize, (k + 2usize) % 3usize + 1usize);
        q[k + 1usize] = a[0usize] * b[k + 1usize] + a[k + 1usize] * b[0usize] + a[i] * b[j] - a[j] * b[i];
    }
    q
}

/// The conjugate of a unit quaternion, which is its inverse.
#[cube]
pub(in crate::source) fn conjugate(a: &Array<f32>) -> Array<f32> {
    let mut q = Array::<f32>::new(4usize);
    q[0usize] = a[0usize];
    for k in 1..4usize {
        q[k] = -a[k];
    }
    q
}

/// `u` turned by a unit quaternion.
#[cube]
pub(super) fn rotate(q: &Array<f32>, u: &Array<f32>) -> Array<f32> {
    let mut t = Array::<f32>::new(3usize);
    for k in 0..3usize {
        let (i, j) = ((k + 1usize) % 3usize, (k + 2usize) % 3usize);
        t[k] = 2.0f32 * (q[i + 1usize] * u[j] - q[j + 1usize] * u[i]);
    }
    let mut out = Array::<f32>::new(3usize);
    for k in 0..3usize {
        let (i, j) = ((k + 1usize) % 3usize, (k + 2usize) % 3usize);
        out[k] = u[k] + q[0usize] * t[k] + q[i + 1usize] * t[j] - q[j + 1usize] * t[i];
    }
    out
}

/// Cotangent of the quaternion of a rotation, given that of what it turned.
#[cube]
pub(super) fn rotate_vjp(q: &Array<f32>, u: &Array<f32>, v: &Array<f32>) -> Array<f32> {
    let mut out = Array::<f32>::new(4usize);
    let mut n_u = 0.0f32;
    let mut v_n = 0.0f32;
    let mut v_u = 0.0f32;
    let mut v_w = 0.0f32;
    for k in 0..3usize {
        let (i, j) = ((k + 1usize) % 3usize, (k + 2usize) % 3usize);
        n_u += q[k + 1usize] * u[k];
        v_n += v[k] * q[k + 1usize];
        v_u += v[k] * u[k];
        v_w += v[k] * (q[i + 1usize] * u[j] - q[j + 1usize] * u[i]);
    }
    out[0usize] = 2.0f32 * v_w;
    for k in 0..3usize {
        let (i, j) = ((k + 1usize) % 3usize, (k + 2usize) % 3usize);
        let turned = q[0usize] * (u[i] * v[j] - u[j] * v[i]);
        out[k + 1usize] = 2.0f32 * (turned + v[k] * n_u + u[k] * v_n - 2.0f32 * q[k + 1usize] * v_u);
    }
    out
}

/// For the squared angle of a rotation vector: cos(θ/2), sin(θ/2)/θ and the derivative of the latter by θ,
/// divided by θ.
#[cube]
fn half_angle(squared: f32) -> Array<f32> {
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

#[cube]
fn squared_angle(values: &[f32], at: usize) -> f32 {
    values[at] * values[at]
        + values[at + 1usize] * values[at + 1usize]
        + values[at + 2usize] * values[at + 2usize]
}

/// The quaternion of the rotation vector at a place.
#[cube]
pub(super) fn exponential(values: &[f32], at: usize) -> Array<f32> {
    let half = half_angle(squared_angle(values, at));
    let mut q = Array::<f32>::new(4usize);
    q[0usize] = half[0usize];
    for k in 0..3usize {
        q[k + 1usize] = half[1usize] * values[at + k];
    }
    q
}

/// Cotangent of the rotation vector at a place, given that of its quaternion.
#[cube]
pub(super) fn exponential_vjp(values: &[f32], at: usize, v: &Array<f32>) -> Array<f32> {
    let half = half_angle(squared_angle(values, at));
    let mut dot = 0.0f32;
    for k in 0..3usize {
        dot += values[at + k] * v[k + 1usize];
    }
    let along = half[2usize] * dot - 0.5f32 * half[1usize] * v[0usize];
    let mut out = Array::<f32>::new(3usize);
    for k in 0..3usize {
        out[k] = half[1usize] * v[k + 1usize] + along * values[at + k];
    }
    out
}
