//! Colour from real spherical harmonics up to degree 3, in the order of the INRIA rasterizer
//! (method §2.3).
//!
//! `colour = max(0, Σ_k basis_k(direction) · coefficient_k + 1/2)` per channel, the direction running from
//! the camera to the mean. A channel clamped at zero has zero gradient. The basis polynomials are
//! differentiated as polynomials of (x, y, z); the projection on the unit sphere removes what that adds along
//! the direction.

use crate::simd::{Lanes, V, splat};
use lgs_core::SH_C0;
pub(crate) use lgs_core::harmonics::{SH_C1 as C1, SH_C2 as C2, SH_C3 as C3, sh_basis as basis};
use lgs_core::linear::{dot, norm, scale, sub};
use pulp::Simd;

/// Values of the basis functions of a block of Gaussians: `[function][lane]`.
pub(crate) struct Basis([Lanes; 16]);

impl Basis {
    pub(crate) const ZERO: Self = Self([Lanes::ZERO; 16]);

    /// Fills vector number `index`, given the offsets (not zero) of the means from the camera centre.
    #[inline(always)]
    pub(crate) fn evaluate<S: Simd>(&mut self, simd: S, index: usize, [x, y, z]: [V<S>; 3], degree: usize) {
        let b = &mut self.0;
        b[0].set(index, splat(simd, SH_C0));
        if degree == 0 {
            return;
        }
        let length = (x * x + y * y + z * z).sqrt();
        let inverse = splat(simd, 1.0) / length;
        let (x, y, z) = (x * inverse, y * inverse, z * inverse);
        let (xx, yy, zz) = (x * x, y * y, z * z);
        b[1].set(index, splat(simd, -C1) * y);
        b[2].set(index, splat(simd, C1) * z);
        b[3].set(index, splat(simd, -C1) * x);
        if degree >= 2 {
            b[4].set(index, splat(simd, C2[0]) * x * y);
            b[5].set(index, splat(simd, C2[1]) * y * z);
            b[6].set(index, splat(simd, C2[2]) * (zz + zz - xx - yy));
            b[7].set(index, splat(simd, C2[3]) * x * z);
            b[8].set(index, splat(simd, C2[4]) * (xx - yy));
        }
        if degree >= 3 {
            let (three, four) = (splat(simd, 3.0), splat(simd, 4.0));
            b[9].set(index, splat(simd, C3[0]) * y * (three * xx - yy));
            b[10].set(index, splat(simd, C3[1]) * x * y * z);
            b[11].set(index, splat(simd, C3[2]) * y * (four * zz - xx - yy));
            b[12].set(index, splat(simd, C3[3]) * z * (zz + zz - three * (xx + yy)));
            b[13].set(index, splat(simd, C3[4]) * x * (four * zz - xx - yy));
            b[14].set(index, splat(simd, C3[5]) * z * (xx - yy));
            b[15].set(index, splat(simd, C3[6]) * x * (xx - three * yy));
        }
    }

    /// The colour of a lane; `coefficients` is `[K, 3]` flattened.
    #[inline(always)]
    pub(crate) fn color(&self, coefficients: &[f32], degree: usize, lane: usize) -> [f32; 3] {
        let mut rgb = [0.5_f32; 3];
        for (weights, c) in
            self.0.iter().zip(coefficients.as_chunks::<3>().0).take((degree + 1) * (degree + 1))
        {
            for channel in 0..3 {
                rgb[channel] = weights.0[lane].mul_add(c[channel], rgb[channel]);
            }
        }
        // Not `max`, which would turn NaN into zero.
        for value in &mut rgb {
            *value = if *value < 0.0 { 0.0 } else { *value };
        }
        rgb
    }
}

/// Derivatives of [`basis`] by x, y and z, contracted with a cotangent of the basis.
#[inline(always)]
fn basis_vjp([x, y, z]: [f32; 3], degree: usize, v: &[f32; 16]) -> [f32; 3] {
    let mut out = [0.0; 3];
    if degree >= 1 {
        out = [-C1 * v[3], -C1 * v[1], C1 * v[2]];
    }
    let (xx, yy, zz) = (x * x, y * y, z * z);
    if degree >= 2 {
        out[0] += C2[0] * y * v[4] - 2.0 * C2[2] * x * v[6] + C2[3] * z * v[7] + 2.0 * C2[4] * x * v[8];
        out[1] += C2[0] * x * v[4] + C2[1] * z * v[5] - 2.0 * C2[2] * y * v[6] - 2.0 * C2[4] * y * v[8];
        out[2] += C2[1] * y * v[5] + 4.0 * C2[2] * z * v[6] + C2[3] * x * v[7];
    }
    if degree >= 3 {
        out[0] += C3[0] * 6.0 * x * y * v[9] + C3[1] * y * z * v[10]
            - C3[2] * 2.0 * x * y * v[11]
            - C3[3] * 6.0 * x * z * v[12]
            + C3[4] * (4.0 * zz - 3.0 * xx - yy) * v[13]
            + C3[5] * 2.0 * x * z * v[14]
            + C3[6] * 3.0 * (xx - yy) * v[15];
        out[1] += C3[0] * 3.0 * (xx - yy) * v[9]
            + C3[1] * x * z * v[10]
            + C3[2] * (4.0 * zz - xx - 3.0 * yy) * v[11]
            - C3[3] * 6.0 * y * z * v[12]
            - C3[4] * 2.0 * x * y * v[13]
            - C3[5] * 2.0 * y * z * v[14]
            - C3[6] * 6.0 * x * y * v[15];
        out[2] += C3[1] * x * y * v[10]
            + C3[2] * 8.0 * y * z * v[11]
            + C3[3] * (6.0 * zz - 3.0 * xx - 3.0 * yy) * v[12]
            + C3[4] * 8.0 * x * z * v[13]
            + C3[5] * (xx - yy) * v[14];
    }
    out
}

/// The direction from the camera centre to a mean, and the distance; at the camera itself the direction is z.
#[inline(always)]
fn direction(mean: [f32; 3], camera_center: [f32; 3]) -> ([f32; 3], f32) {
    let offset = sub(mean, camera_center);
    let length = norm(offset);
    if length > 1e-12 { (scale(offset, 1.0 / length), length) } else { ([0.0, 0.0, 1.0], f32::INFINITY) }
}

/// Cotangent of the mean; that of the coefficients is written to `v_coefficients` (`[K, 3]`, zero on entry).
///
/// `color` is the forward result: zero there marks a clamped channel.
#[inline(always)]
pub(crate) fn color_vjp(
    (mean, camera_center): ([f32; 3], [f32; 3]),
    (coefficients, degree): (&[f32], usize),
    color: [f32; 3],
    v_color: [f32; 3],
    v_coefficients: &mut [f32],
) -> [f32; 3] {
    let v: [f32; 3] = std::array::from_fn(|i| if color[i] > 0.0 { v_color[i] } else { 0.0 });
    let (unit, length) = direction(mean, camera_center);
    let b = basis(unit, degree);
    let mut v_basis = [0.0; 16];
    let rows = coefficients.as_chunks::<3>().0.iter().zip(v_coefficients.as_chunks_mut::<3>().0);
    for (k, (c, v_c)) in rows.enumerate().take((degree + 1) * (degree + 1)) {
        *v_c = scale(v, b[k]);
        v_basis[k] = dot(*c, v);
    }
    let v_unit = basis_vjp(unit, degree, &v_basis);
    scale(sub(v_unit, scale(unit, dot(unit, v_unit))), 1.0 / length)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The colour of a Gaussian seen from `camera_center`; `coefficients` is `[K, 3]` flattened.
    fn color(mean: [f32; 3], camera_center: [f32; 3], coefficients: &[f32], degree: usize) -> [f32; 3] {
        let b = basis(direction(mean, camera_center).0, degree);
        let mut rgb = [0.5; 3];
        for (weight, c) in b.iter().zip(coefficients.as_chunks::<3>().0).take((degree + 1) * (degree + 1)) {
            for channel in 0..3 {
                rgb[channel] = weight.mul_add(c[channel], rgb[channel]);
            }
        }
        rgb.map(|v| v.max(0.0))
    }

    #[test]
    fn gradients_of_color_match_finite_differences() {
        let coefficients: Vec<f32> = (0..48).map(|i| ((i * 7919 % 101) as f32 / 101.0 - 0.5) * 0.4).collect();
        let (mean, center, weights) = ([0.4, -0.9, 0.7], [-0.3, 0.2, -0.5], [0.7, -1.1, 0.4]);
        let loss = |m: [f32; 3], c: &[f32]| dot(color(m, center, c, 3), weights);
        let mut v_coefficients = vec![0.0; 48];
        let rgb = color(mean, center, &coefficients, 3);
        assert!(rgb.iter().all(|&c| c > 0.0), "no channel is clamped here");
        let v_mean = color_vjp((mean, center), (&coefficients, 3), rgb, weights, &mut v_coefficients);
        for (axis, &found) in v_mean.iter().enumerate() {
            let moved = |d: f32| std::array::from_fn(|i| mean[i] + if i == axis { d } else { 0.0 });
            let slope = (loss(moved(1e-2), &coefficients) - loss(moved(-1e-2), &coefficients)) / 2e-2;
            assert!((slope - found).abs() < 2e-3, "axis {axis}: {slope} {found}");
        }
        for (k, &found) in v_coefficients.iter().enumerate() {
            let moved =
                |d: f32| (0..48).map(|i| coefficients[i] + if i == k { d } else { 0.0 }).collect::<Vec<_>>();
            let slope = (loss(mean, &moved(0.05)) - loss(mean, &moved(-0.05))) / 0.1;
            assert!((slope - found).abs() < 1e-3, "coefficient {k}");
        }
    }

    #[test]
    fn a_clamped_channel_has_no_gradient() {
        let mut v_coefficients = [0.0; 3];
        let rgb = color([0.0, 0.0, 1.0], [0.0; 3], &[-4.0, 0.0, 0.0], 0);
        assert_eq!(rgb[0], 0.0);
        color_vjp(([0.0, 0.0, 1.0], [0.0; 3]), (&[-4.0, 0.0, 0.0], 0), rgb, [1.0; 3], &mut v_coefficients);
        assert_eq!(v_coefficients, [0.0, SH_C0, SH_C0]);
    }
}
