//! Matrices (row by row) in kernels, and sums of what arrives: small arrays in registers. What kernels of
//! other crates need as well is in [`lgs_tensor::cube::vectors`] and [`lgs_tensor::cube::quaternions`].

use cubecl::prelude::*;

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

/// So many of some numbers, from a place on.
#[cube]
pub(super) fn taken(values: &Array<f32>, #[comptime] at: usize, #[comptime] count: usize) -> Array<f32> {
    let mut out = Array::<f32>::new(count);
    #[unroll]
    for k in 0..count {
        out[k] = values[at + k];
    }
    out
}

/// Three of some numbers.
#[cube]
pub(super) fn part(values: &Array<f32>, #[comptime] at: usize) -> Array<f32> {
    taken(values, at, 3usize)
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
