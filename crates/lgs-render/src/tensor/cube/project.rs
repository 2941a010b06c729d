//! Projection of Gaussians: `crate::project`, a unit per Gaussian.

use cubecl::prelude::*;

use crate::projected::{LEAST_ENERGY, LOG2_255};

use super::chain::{Chain, chain, direction, dot, normal, parameters};
use super::extent::{Span, box_columns, box_rows, tile_columns};
use super::frame::{Frame, PROJECTED, TILE};
use super::harmonics::basis;

/// `√(½ log2 e)`: the conic's factors in base 2.
const BASE_2: f32 = 0.849_321_8;
/// `2 ln 2`, and `log2 e`.
const TWICE_LN_2: f32 = 2.0 * std::f32::consts::LN_2;
const LOG2_E: f32 = std::f32::consts::LOG2_E;
/// Above this a number counts as infinite.
const FINITE: f32 = 3.0e38;

/// Projects every Gaussian; the radius of one that cannot be seen, wherever it lies in the image, is 0.
#[cube(launch)]
pub(super) fn project(
    packed: &[f32],
    sh: &[f32],
    projected: &mut [f32],
    frame: Frame,
    #[comptime] degree: u32,
) {
    let i = ABSOLUTE_POS;
    if i < frame.gaussians as usize {
        let chain = chain(packed, i);
        let radius = place(packed, i, &chain, projected);
        shade(packed, sh, i, projected, &frame, degree);
        let g = i * PROJECTED;
        let representable = projected[g + 2usize] > 0.0f32
            && projected[g + 3usize].abs() < FINITE
            && projected[g + 4usize] > 0.0f32
            && projected[g + 10usize] > 0.0f32;
        let colored = projected[g + 6usize] < FINITE
            && projected[g + 7usize] < FINITE
            && projected[g + 8usize] < FINITE;
        let visible = chain.camera[2usize] > packed[21usize] && representable && colored && radius < FINITE;
        projected[g + 14usize] = select(visible, radius.ceil().max(1.0f32), 0.0f32);
    }
}

/// Counts the tiles that each Gaussian touches, and notes its radius; 0 for what is invisible.
#[cube(launch)]
pub(super) fn count_tiles(projected: &[f32], counts: &mut [u32], radii: &mut [i32], frame: Frame) {
    let i = ABSOLUTE_POS;
    if i < counts.len() {
        let radius = projected[i * PROJECTED + 14usize];
        let columns = box_columns(projected, i, &frame);
        let rows = box_rows(projected, i, &frame);
        let seen = radius > 0.0f32 && columns.begin < columns.end && rows.begin < rows.end;
        let tiles = touched(projected, i, &frame);
        counts[i] = select(seen, tiles, 0u32);
        radii[i] = select(seen, radius as i32, 0i32);
    }
}

/// Writes the ellipse of Gaussian number `i`; gives three standard deviations, pixels.
#[cube]
fn place(packed: &[f32], i: usize, chain: &Chain, projected: &mut [f32]) -> f32 {
    let (m, blur) = (&chain.m, packed[22usize]);
    let m0 = dot(m, 0usize, m, 0usize);
    let m1 = dot(m, 3usize, m, 3usize);
    let (a, b, c) = (m0 + blur, dot(m, 0usize, m, 3usize), m1 + blur);
    let n = normal(m);
    let area = dot(&n, 0usize, &n, 0usize);
    let determinant = area + blur * (m0 + m1) + blur * blur;
    let along = BASE_2 * (c / determinant).sqrt();
    let peak = -((1.0f32 + (-packed[parameters(i) + 10usize]).exp()).ln() * LOG2_E);
    let energy = (area / determinant).max(LEAST_ENERGY).ln() * (0.5f32 * LOG2_E);
    let log2_opacity = peak + packed[23usize] * energy;
    let reach = (log2_opacity + LOG2_255).max(0.0f32) * TWICE_LN_2;
    let g = i * PROJECTED;
    let z = chain.camera[2usize];
    projected[g] = chain.camera[0usize] / z * packed[12usize] + packed[14usize];
    projected[g + 1usize] = chain.camera[1usize] / z * packed[13usize] + packed[15usize];
    projected[g + 2usize] = along;
    projected[g + 3usize] = -(along * b / c);
    projected[g + 4usize] = BASE_2 / c.sqrt();
    projected[g + 5usize] = log2_opacity;
    projected[g + 9usize] = z;
    projected[g + 10usize] = log2_opacity + LOG2_255;
    projected[g + 11usize] = (reach * a).sqrt() * 1.00001f32;
    projected[g + 12usize] = (reach * c).sqrt() * 1.00001f32;
    projected[g + 13usize] = b * (reach / a).sqrt();
    let half_trace = 0.5f32 * (a + c);
    let longest = half_trace + (half_trace * half_trace - determinant).max(0.1f32).sqrt();
    select(determinant < FINITE, 3.0f32 * longest.sqrt(), FINITE)
}

/// Writes the colour of Gaussian number `i`.
#[cube]
fn shade(
    packed: &[f32],
    sh: &[f32],
    i: usize,
    projected: &mut [f32],
    frame: &Frame,
    #[comptime] degree: u32,
) {
    let d = direction(packed, i);
    let b = basis(d[0usize], d[1usize], d[2usize], degree);
    let first = i * frame.coefficients as usize * 3usize;
    for channel in 0..3usize {
        let mut sum = 0.5f32;
        for k in 0..comptime!(((degree + 1) * (degree + 1)) as usize) {
            sum += b[k] * sh[first + 3usize * k + channel];
        }
        projected[i * PROJECTED + 6usize + channel] = select(sum < 0.0f32, 0.0f32, sum);
    }
}

/// Number of tiles that the ellipse of Gaussian number `i` touches.
#[cube]
fn touched(projected: &[f32], i: usize, frame: &Frame) -> u32 {
    let rows = box_rows(projected, i, frame);
    let mut tiles = 0u32;
    let mut row = rows.begin / TILE;
    while row * TILE < rows.end {
        let span: Span = tile_columns(projected, i, row, &rows, frame);
        tiles += span.end - span.begin;
        row += 1u32;
    }
    tiles
}
