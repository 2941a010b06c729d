//! Raw quaternions and rotation vectors in kernels: arrays of four numbers, w first, and of three.

use cubecl::prelude::*;
use lgs_tensor::cube::quaternions::{half_angle, squared_angle};
use lgs_tensor::cube::vectors::write;

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
    write(out, at, &unit_vjp(q, v), 4usize);
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
