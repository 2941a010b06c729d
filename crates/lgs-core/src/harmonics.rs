//! Constants of spherical harmonics.

/// The zeroth real spherical harmonic, which turns a DC coefficient into a colour: `rgb = 0.5 + SH_C0 · dc`.
pub const SH_C0: f32 = 0.282_094_79;
