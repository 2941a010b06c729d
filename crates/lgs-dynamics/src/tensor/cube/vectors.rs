//! Vectors, matrices (row by row) and quaternions (w first) in kernels: small arrays in registers. What
//! kernels of other crates need as well is in [`lgs_tensor::cube::quaternions`].

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

/// Adds what stretches of owners sent to member number `i`, so many numbers each, in their order.
#[cube]
pub(super) fn add_arrived(
    sums: &mut Array<f32>,
    arrived: &[f32],
    begins: &[u32],
    i: usize,
    #[comptime] count: usize,
) {
    for stretch in begins[i]..begins[i + 1usize] {
        #[unroll]
        for k in 0..count {
            sums[k] = sums[k] + arrived[stretch as usize * count + k];
        }
    }
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
