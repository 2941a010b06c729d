//! The vector–Jacobian product of a Gaussian's colour.

use cubecl::prelude::*;

use super::chain::direction;
use super::frame::{Frame, PROJECTED};
use super::harmonics::{basis, basis_by_x, basis_by_y, basis_by_z};

/// Writes cotangents of the harmonics, and gives that of the centre through the direction.
#[cube]
pub(super) fn color_vjp(
    packed: &[f32],
    inputs: (&[f32], &[f32]),
    i: usize,
    v: &Array<f32>,
    v_sh: &mut [f32],
    frame: &Frame,
    #[comptime] degree: u32,
) -> Array<f32> {
    let (sh, projected) = inputs;
    let d = direction(packed, i);
    let b = basis(d[0usize], d[1usize], d[2usize], degree);
    let mut v_basis = Array::<f32>::new(16usize);
    for k in 0..16usize {
        v_basis[k] = 0.0f32;
    }
    let first = i * frame.coefficients as usize * 3usize;
    for channel in 0..3usize {
        // Zero marks a clamped channel.
        let lit = projected[i * PROJECTED + 6usize + channel] > 0.0f32;
        let v_channel = select(lit, v[6usize + channel], 0.0f32);
        for k in 0..comptime!(((degree + 1) * (degree + 1)) as usize) {
            let at = first + 3usize * k + channel;
            v_sh[at] = v_channel * b[k];
            v_basis[k] = v_basis[k] + v_channel * sh[at];
        }
    }
    for k in comptime!(((degree + 1) * (degree + 1) * 3) as usize)..frame.coefficients as usize * 3usize {
        v_sh[first + k] = 0.0f32;
    }
    direction_vjp(&d, &v_basis, degree)
}

/// Cotangent of the centre through the direction, with the distance in its fourth place, given that of the
/// basis.
#[cube]
fn direction_vjp(d: &Array<f32>, v_basis: &Array<f32>, #[comptime] degree: u32) -> Array<f32> {
    let by_x = basis_by_x(d[0usize], d[1usize], d[2usize], v_basis, degree);
    let by_y = basis_by_y(d[0usize], d[1usize], d[2usize], v_basis, degree);
    let by_z = basis_by_z(d[0usize], d[1usize], d[2usize], v_basis, degree);
    let along = by_x * d[0usize] + by_y * d[1usize] + by_z * d[2usize];
    let inverse = 1.0f32 / d[3usize];
    let mut v_direction = Array::<f32>::new(3usize);
    v_direction[0usize] = (by_x - along * d[0usize]) * inverse;
    v_direction[1usize] = (by_y - along * d[1usize]) * inverse;
    v_direction[2usize] = (by_z - along * d[2usize]) * inverse;
    v_direction
}
