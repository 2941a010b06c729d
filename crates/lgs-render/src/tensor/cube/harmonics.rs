//! Spherical harmonics on the device: `crate::sh`, value by value.

use cubecl::prelude::*;
use lgs_core::SH_C0;

use crate::sh::C1;

/// `crate::sh::C2` and `C3` as single constants, which kernels can name.
const D0: f32 = crate::sh::C2[0];
const D2: f32 = crate::sh::C2[2];
const D4: f32 = crate::sh::C2[4];
const E0: f32 = crate::sh::C3[0];
const E1: f32 = crate::sh::C3[1];
const E2: f32 = crate::sh::C3[2];
const E3: f32 = crate::sh::C3[3];
const E5: f32 = crate::sh::C3[5];

/// Values of the 16 basis functions at a unit direction; those above `degree` are zero.
#[cube]
pub(super) fn basis(x: f32, y: f32, z: f32, #[comptime] degree: u32) -> Array<f32> {
    let mut b = Array::<f32>::new(16usize);
    for k in 0..16usize {
        b[k] = 0.0f32;
    }
    b[0usize] = SH_C0;
    if comptime!(degree >= 1) {
        b[1usize] = -(C1 * y);
        b[2usize] = C1 * z;
        b[3usize] = -(C1 * x);
    }
    if comptime!(degree >= 2) {
        b[4usize] = D0 * x * y;
        b[5usize] = -(D0 * y * z);
        b[6usize] = D2 * (2.0f32 * z * z - x * x - y * y);
        b[7usize] = -(D0 * x * z);
        b[8usize] = D4 * (x * x - y * y);
    }
    if comptime!(degree >= 3) {
        b[9usize] = E0 * y * (3.0f32 * x * x - y * y);
        b[10usize] = E1 * x * y * z;
        b[11usize] = E2 * y * (4.0f32 * z * z - x * x - y * y);
        b[12usize] = E3 * z * (2.0f32 * z * z - 3.0f32 * x * x - 3.0f32 * y * y);
        b[13usize] = E2 * x * (4.0f32 * z * z - x * x - y * y);
        b[14usize] = E5 * z * (x * x - y * y);
        b[15usize] = E0 * x * (x * x - 3.0f32 * y * y);
    }
    b
}

/// Derivative of the basis by x, contracted with a cotangent of it.
#[cube]
pub(super) fn basis_by_x(x: f32, y: f32, z: f32, v: &Array<f32>, #[comptime] degree: u32) -> f32 {
    let mut out = 0.0f32;
    if comptime!(degree >= 1) {
        out -= C1 * v[3usize];
    }
    if comptime!(degree >= 2) {
        out += D0 * y * v[4usize] - 2.0f32 * D2 * x * v[6usize] - D0 * z * v[7usize]
            + 2.0f32 * D4 * x * v[8usize];
    }
    if comptime!(degree >= 3) {
        out += E0 * 6.0f32 * x * y * v[9usize] + E1 * y * z * v[10usize]
            - E2 * 2.0f32 * x * y * v[11usize]
            - E3 * 6.0f32 * x * z * v[12usize]
            + E2 * (4.0f32 * z * z - 3.0f32 * x * x - y * y) * v[13usize]
            + E5 * 2.0f32 * x * z * v[14usize]
            + E0 * 3.0f32 * (x * x - y * y) * v[15usize];
    }
    out
}

/// Derivative of the basis by y, contracted with a cotangent of it.
#[cube]
pub(super) fn basis_by_y(x: f32, y: f32, z: f32, v: &Array<f32>, #[comptime] degree: u32) -> f32 {
    let mut out = 0.0f32;
    if comptime!(degree >= 1) {
        out -= C1 * v[1usize];
    }
    if comptime!(degree >= 2) {
        out += D0 * x * v[4usize]
            - D0 * z * v[5usize]
            - 2.0f32 * D2 * y * v[6usize]
            - 2.0f32 * D4 * y * v[8usize];
    }
    if comptime!(degree >= 3) {
        out += E0 * 3.0f32 * (x * x - y * y) * v[9usize]
            + E1 * x * z * v[10usize]
            + E2 * (4.0f32 * z * z - x * x - 3.0f32 * y * y) * v[11usize]
            - E3 * 6.0f32 * y * z * v[12usize]
            - E2 * 2.0f32 * x * y * v[13usize]
            - E5 * 2.0f32 * y * z * v[14usize]
            - E0 * 6.0f32 * x * y * v[15usize];
    }
    out
}

/// Derivative of the basis by z, contracted with a cotangent of it.
#[cube]
pub(super) fn basis_by_z(x: f32, y: f32, z: f32, v: &Array<f32>, #[comptime] degree: u32) -> f32 {
    let mut out = 0.0f32;
    if comptime!(degree >= 1) {
        out += C1 * v[2usize];
    }
    if comptime!(degree >= 2) {
        out += 4.0f32 * D2 * z * v[6usize] - D0 * y * v[5usize] - D0 * x * v[7usize];
    }
    if comptime!(degree >= 3) {
        out += E1 * x * y * v[10usize]
            + E2 * 8.0f32 * y * z * v[11usize]
            + E3 * (6.0f32 * z * z - 3.0f32 * x * x - 3.0f32 * y * y) * v[12usize]
            + E2 * 8.0f32 * x * z * v[13usize]
            + E5 * (x * x - y * y) * v[14usize];
    }
    out
}
