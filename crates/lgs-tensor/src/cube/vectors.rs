//! Vectors in kernels: small arrays of numbers in registers.
#![allow(missing_docs, reason = "those of what the language's macro writes beside a function")]

use burn_cubecl::cubecl::{self, prelude::*};

/// So many numbers at a place.
#[cube]
pub fn numbers(values: &[f32], at: usize, #[comptime] count: usize) -> Array<f32> {
    let mut out = Array::<f32>::new(count);
    #[unroll]
    for k in 0..count {
        out[k] = values[at + k];
    }
    out
}

/// Writes so many numbers to a place.
#[cube]
pub fn write(values: &mut [f32], at: usize, from: &Array<f32>, #[comptime] count: usize) {
    #[unroll]
    for k in 0..count {
        values[at + k] = from[k];
    }
}

/// So many zeros.
#[cube]
pub fn zeros(#[comptime] count: usize) -> Array<f32> {
    let mut out = Array::<f32>::new(count);
    #[unroll]
    for k in 0..count {
        out[k] = 0.0f32;
    }
    out
}

/// `a + h b` of vectors.
#[cube]
pub fn plus(a: &Array<f32>, b: &Array<f32>, h: f32) -> Array<f32> {
    let mut out = Array::<f32>::new(3usize);
    #[unroll]
    for k in 0..3usize {
        out[k] = a[k] + h * b[k];
    }
    out
}

/// `a · b` of vectors.
#[cube]
pub fn dot(a: &Array<f32>, b: &Array<f32>) -> f32 {
    a[0usize] * b[0usize] + a[1usize] * b[1usize] + a[2usize] * b[2usize]
}

/// `a × b`.
#[cube]
pub fn cross(a: &Array<f32>, b: &Array<f32>) -> Array<f32> {
    let mut out = Array::<f32>::new(3usize);
    out[0usize] = a[1usize] * b[2usize] - a[2usize] * b[1usize];
    out[1usize] = a[2usize] * b[0usize] - a[0usize] * b[2usize];
    out[2usize] = a[0usize] * b[1usize] - a[1usize] * b[0usize];
    out
}
