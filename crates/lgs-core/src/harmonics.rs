//! Real spherical harmonics to degree 3, in the order of 3D Gaussian splatting (method §2.3).

/// The zeroth real spherical harmonic, which turns a DC coefficient into a colour: `rgb = 0.5 + SH_C0 · dc`.
pub const SH_C0: f32 = 0.282_094_79;
/// Constant of the functions of degree 1.
pub const SH_C1: f32 = 0.488_602_52;
/// Constants of the functions of degree 2.
pub const SH_C2: [f32; 5] = [1.092_548_5, -1.092_548_5, 0.315_391_57, -1.092_548_5, 0.546_274_24];
/// Constants of the functions of degree 3.
pub const SH_C3: [f32; 7] =
    [-0.590_043_6, 2.890_611_4, -0.457_045_8, 0.373_176_34, -0.457_045_8, 1.445_305_7, -0.590_043_6];

/// Values of the 16 basis functions at a unit direction; those above `degree` are zero.
#[inline(always)]
#[must_use]
pub fn sh_basis([x, y, z]: [f32; 3], degree: usize) -> [f32; 16] {
    let mut b = [0.0; 16];
    b[0] = SH_C0;
    if degree >= 1 {
        (b[1], b[2], b[3]) = (-SH_C1 * y, SH_C1 * z, -SH_C1 * x);
    }
    let (xx, yy, zz) = (x * x, y * y, z * z);
    if degree >= 2 {
        b[4] = SH_C2[0] * x * y;
        b[5] = SH_C2[1] * y * z;
        b[6] = SH_C2[2] * (2.0 * zz - xx - yy);
        b[7] = SH_C2[3] * x * z;
        b[8] = SH_C2[4] * (xx - yy);
    }
    if degree >= 3 {
        b[9] = SH_C3[0] * y * (3.0 * xx - yy);
        b[10] = SH_C3[1] * x * y * z;
        b[11] = SH_C3[2] * y * (4.0 * zz - xx - yy);
        b[12] = SH_C3[3] * z * (2.0 * zz - 3.0 * xx - 3.0 * yy);
        b[13] = SH_C3[4] * x * (4.0 * zz - xx - yy);
        b[14] = SH_C3[5] * z * (xx - yy);
        b[15] = SH_C3[6] * x * (xx - 3.0 * yy);
    }
    b
}
