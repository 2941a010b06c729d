//! Front-to-back blending: a cube of units per tile, a unit per pixel.
//!
//! Before every group of entries that a pixel of the tile still sees, each pixel's transmittance and colour
//! are kept: what the backward pass starts from.

use cubecl::prelude::*;

use crate::projected::{ALPHA_MAX, TRANSMITTANCE_STOP};

use super::frame::{Frame, PIXELS, PROJECTED, TILE, columns};
use super::lists::GROUP;

/// `log2(1/255)`, the least alpha.
const LOG2_ALPHA_MIN: f32 = -crate::projected::LOG2_255;
/// `ln 2`.
const LN_2: f32 = std::f32::consts::LN_2;
/// Floats of a Gaussian in a group: the first of a projected one, to its colour.
pub(super) const SHARED: usize = 9;
/// Floats of a tile's state before a group: channel by channel, transmittance last.
pub(super) const STATE: usize = 4 * PIXELS as usize;

/// `log2` of opacity times Gaussian at a distance from its centre.
#[cube]
fn log2_alpha(distance: (f32, f32), factors: (f32, f32, f32), log2_opacity: f32) -> f32 {
    let (dx, dy) = distance;
    let (f0, f1, f2) = factors;
    let u = f0 * dx + f1 * dy;
    let w = f2 * dy;
    log2_opacity - w * w - u * u
}

/// Opacity times Gaussian at a distance from its centre, before it is clamped; 0 below 1/255.
#[cube]
pub(super) fn alpha(distance: (f32, f32), factors: (f32, f32, f32), log2_opacity: f32) -> f32 {
    let log2_alpha = log2_alpha(distance, factors, log2_opacity);
    select(log2_alpha >= LOG2_ALPHA_MIN, (log2_alpha * LN_2).exp(), 0.0f32)
}

/// Where in `states` the state before a group begins, behind the stops of all pixels of the image.
#[cube]
pub(super) fn state_of(group: u32, frame: &Frame) -> usize {
    (frame.width * frame.height) as usize + group as usize * STATE
}

/// Blends every tile: image and transmittance `[H, W, 4]`; and in `states` the position in its list of the
/// entry that closed each pixel (the list's length if none did, 0 where the lists had no room for all
/// entries, which leaves the image without a gradient), then the states before groups.
#[cube(launch)]
pub(super) fn blend(
    projected: &[f32],
    members: &[u32],
    ranges: &[u32],
    places: &[u32],
    background: &[f32],
    states: &mut [f32],
    packed: &mut [f32],
    room: u32,
    frame: Frame,
) {
    let tile = CUBE_POS;
    if tile + 1usize < ranges.len() / 2usize {
        let pixel = own_pixel(tile as u32, &frame);
        let mut light = dark();
        let stop = add_list(projected, members, ranges, &pixel, states, &mut light, &frame);
        if pixel.inside {
            let at = (pixel.y * frame.width + pixel.x) as usize;
            write(packed, at, &light, background);
            let fits = places[places.len() - 1usize] <= room;
            states[at] = select(fits, stop, 0u32) as f32;
        }
    }
}

/// A pixel of the image, and its number in its tile, row by row.
#[derive(CubeType, Clone, Copy)]
struct Pixel {
    x: u32,
    y: u32,
    in_tile: u32,
    inside: bool,
}

/// The unit's own pixel. 32 units, which run together on most devices, take 8 × 4 pixels: a small Gaussian
/// reaches none of most such blocks.
#[cube]
fn own_pixel(tile: u32, frame: &Frame) -> Pixel {
    let columns = columns(frame);
    let block = UNIT_POS / 32u32;
    let column = UNIT_POS % 8u32 + block % 2u32 * 8u32;
    let row = UNIT_POS / 8u32 % 4u32 + block / 2u32 * 4u32;
    let x = tile % columns * TILE + column;
    let y = tile / columns * TILE + row;
    Pixel { x, y, in_tile: row * TILE + column, inside: x < frame.width && y < frame.height }
}

/// Blends the list of the cube's tile into the unit's pixel and keeps the states before groups, until all
/// pixels of the tile are closed; gives the position at which the pixel is.
#[cube]
fn add_list(
    projected: &[f32],
    members: &[u32],
    ranges: &[u32],
    pixel: &Pixel,
    states: &mut [f32],
    light: &mut Array<f32>,
    frame: &Frame,
) -> u32 {
    let mut splats = Shared::<[f32]>::new_slice(GROUP * SHARED);
    let mut open = Shared::<[u32]>::new_slice(PIXELS as usize);
    let mut rows = Shared::<[u32]>::new_slice(TILE as usize);
    let begin = ranges[2usize * CUBE_POS];
    let length = ranges[2usize * CUBE_POS + 2usize] - begin;
    let mut group = ranges[2usize * CUBE_POS + 1usize];
    let mut stop = select(pixel.inside, length, 0u32);
    let mut first = 0u32;
    let mut end = length;
    while first < end {
        open[UNIT_POS as usize] = select(first < stop, 1u32, 0u32);
        sync_cube();
        let count = (length - first).min(GROUP as u32);
        load(projected, members, begin + first, count, &mut splats);
        count_open(&open, &mut rows);
        sync_cube();
        // All units agree on whether a pixel is open.
        if is_any(&rows) {
            keep(states, state_of(group, frame) + pixel.in_tile as usize, light);
            let centre = (pixel.x as f32 + 0.5f32, pixel.y as f32 + 0.5f32);
            stop = add_group(&splats, centre, (first, count), stop, light);
            first += GROUP as u32;
            group += 1u32;
        } else {
            end = first;
        }
    }
    stop
}

/// No colour, all transmittance.
#[cube]
fn dark() -> Array<f32> {
    let mut light = Array::<f32>::new(4usize);
    for channel in 0..3usize {
        light[channel] = 0.0f32;
    }
    light[3usize] = 1.0f32;
    light
}

/// Loads a group of entries, a unit each.
#[cube]
fn load(projected: &[f32], members: &[u32], first: u32, count: u32, splats: &mut [f32]) {
    if UNIT_POS < count {
        let g = members[2usize * (first + UNIT_POS) as usize] as usize * PROJECTED;
        for k in 0..SHARED {
            splats[UNIT_POS as usize * SHARED + k] = projected[g + k];
        }
    }
}

/// Counts the open pixels of every row, a unit each.
#[cube]
fn count_open(open: &[u32], rows: &mut [u32]) {
    if UNIT_POS < TILE {
        let mut count = 0u32;
        for x in 0..TILE {
            count += open[(UNIT_POS * TILE + x) as usize];
        }
        rows[UNIT_POS as usize] = count;
    }
}

/// Whether a row has an open pixel.
#[cube]
fn is_any(rows: &[u32]) -> bool {
    let mut count = 0u32;
    for row in 0..TILE {
        count += rows[row as usize];
    }
    count > 0u32
}

/// Writes a pixel's light over the background, and its transmittance.
#[cube]
fn write(packed: &mut [f32], pixel: usize, light: &Array<f32>, background: &[f32]) {
    for channel in 0..3usize {
        packed[4usize * pixel + channel] = light[channel] + light[3usize] * background[24usize + channel];
    }
    packed[4usize * pixel + 3usize] = light[3usize];
}

/// Keeps the state of a pixel, channel by channel.
#[cube]
fn keep(states: &mut [f32], at: usize, light: &mut Array<f32>) {
    for channel in 0..4usize {
        states[at + channel * PIXELS as usize] = light[channel];
    }
}

/// Blends a group, which begins at a position and has so many entries, into a pixel; gives the position at
/// which the pixel is closed.
#[cube]
fn add_group(
    splats: &[f32],
    pixel: (f32, f32),
    entries: (u32, u32),
    closed: u32,
    light: &mut Array<f32>,
) -> u32 {
    let (first, count) = entries;
    let mut stop = closed;
    // No entry where the pixel is closed before the group.
    for j in 0..select(first < closed, count, 0u32) {
        let g = j as usize * SHARED;
        let distance = (pixel.0 - splats[g], pixel.1 - splats[g + 1usize]);
        let factors = (splats[g + 2usize], splats[g + 3usize], splats[g + 4usize]);
        let log2_alpha = log2_alpha(distance, factors, splats[g + 5usize]);
        if log2_alpha >= LOG2_ALPHA_MIN && first + j < stop {
            let before = light[3usize];
            let weight = (log2_alpha * LN_2).exp().min(ALPHA_MAX) * before;
            let after = before - weight;
            if after < TRANSMITTANCE_STOP {
                stop = first + j;
            } else {
                light[0usize] = light[0usize] + weight * splats[g + 6usize];
                light[1usize] = light[1usize] + weight * splats[g + 7usize];
                light[2usize] = light[2usize] + weight * splats[g + 8usize];
                light[3usize] = after;
            }
        }
    }
    stop
}
