//! Extents of ellipses on the device: `crate::extent`, value by value.

use cubecl::prelude::*;

use crate::extent::{MARGIN, SLACK};

use super::frame::{Frame, PROJECTED, TILE};

/// Whole numbers from `begin` to before `end`.
#[derive(CubeType, Clone, Copy)]
pub(super) struct Span {
    pub(super) begin: u32,
    pub(super) end: u32,
}

/// The pixels whose centres lie in `[low, high]`, within `0..size`; none where a value is NaN.
#[cube]
fn pixel_range(low: f32, high: f32, size: u32) -> Span {
    let first = (low - 0.5f32 - MARGIN).ceil().max(0.0f32);
    let last = (high - 0.5f32 + MARGIN).floor().min(size as f32 - 1.0f32);
    let is_some = first <= last;
    Span { begin: select(is_some, first as u32, 0u32), end: select(is_some, last as u32 + 1u32, 0u32) }
}

/// Columns of pixels of the bounding box of Gaussian number `i`.
#[cube]
pub(super) fn box_columns(projected: &[f32], i: usize, frame: &Frame) -> Span {
    let (mean, half) = (projected[i * PROJECTED], projected[i * PROJECTED + 11usize]);
    pixel_range(mean - half, mean + half, frame.width)
}

/// Rows of pixels of the bounding box of Gaussian number `i`.
#[cube]
pub(super) fn box_rows(projected: &[f32], i: usize, frame: &Frame) -> Span {
    let (mean, half) = (projected[i * PROJECTED + 1usize], projected[i * PROJECTED + 12usize]);
    pixel_range(mean - half, mean + half, frame.height)
}

/// Columns of pixels that the ellipse of Gaussian number `i` reaches between the heights `top` and `bottom`.
#[cube]
fn pixel_columns(projected: &[f32], i: usize, top: f32, bottom: f32, width: u32) -> Span {
    let g = i * PROJECTED;
    let half = projected[g + 12usize] + MARGIN;
    let low = (top - projected[g + 1usize]).max(-half);
    let high = (bottom - projected[g + 1usize]).min(half);
    let inverse = 1.0f32 / projected[g + 2usize];
    let slope = projected[g + 3usize] * inverse;
    let f2 = projected[g + 4usize];
    let reach = projected[g + 10usize] * SLACK;
    let rightmost = projected[g + 13usize];
    let d_right = rightmost.max(low).min(high);
    let d_left = (-rightmost).max(low).min(high);
    let right = half_width(reach, f2 * d_right) * inverse - slope * d_right;
    let left = -half_width(reach, f2 * d_left) * inverse - slope * d_left;
    let slack = 1e-5f32 * (right - left).abs();
    let mean = projected[g];
    pixel_range(mean + left - slack, mean + right + slack, width)
}

#[cube]
fn half_width(reach: f32, w: f32) -> f32 {
    (reach - w * w).max(0.0f32).sqrt()
}

/// Columns of tiles that Gaussian number `i` reaches in a row of tiles; `rows` is its bounding box.
#[cube]
pub(super) fn tile_columns(projected: &[f32], i: usize, row: u32, rows: &Span, frame: &Frame) -> Span {
    let top = (row * TILE).max(rows.begin);
    let last = (row * TILE + TILE).min(rows.end) - 1u32;
    let exact = pixel_columns(projected, i, top as f32 + 0.5f32, last as f32 + 0.5f32, frame.width);
    let whole = box_columns(projected, i, frame);
    let begin = exact.begin.max(whole.begin);
    let end = exact.end.min(whole.end);
    let is_some = begin < end;
    Span {
        begin: select(is_some, begin / TILE, 0u32),
        end: select(is_some, (end + TILE - 1u32) / TILE, 0u32),
    }
}
