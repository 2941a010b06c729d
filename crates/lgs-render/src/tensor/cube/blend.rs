//! Front-to-back blending: a cube of units per tile, a unit per pixel.
//!
//! Before every group of entries each pixel's transmittance and colour are kept: what the backward pass
//! starts from.

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

/// Opacity times Gaussian at a pixel centre, before it is clamped; 0 below 1/255. `g` is where the Gaussian
/// begins in `splats`.
#[cube]
pub(super) fn alpha(splats: &[f32], g: usize, x: f32, y: f32) -> f32 {
    let dx = x - splats[g];
    let dy = y - splats[g + 1usize];
    let u = splats[g + 2usize] * dx + splats[g + 3usize] * dy;
    let w = splats[g + 4usize] * dy;
    let log2_alpha = splats[g + 5usize] - w * w - u * u;
    select(log2_alpha >= LOG2_ALPHA_MIN, (log2_alpha * LN_2).exp(), 0.0f32)
}

/// Blends every tile: image and transmittance `[H, W, 4]`, the position in its list of the entry that closed
/// each pixel (the list's length if none did), and the states before groups.
#[cube(launch)]
pub(super) fn blend(
    projected: &[f32],
    members: &[u32],
    ranges: &[u32],
    background: &[f32],
    states: &mut [f32],
    packed: &mut [f32],
    stops: &mut [u32],
    frame: Frame,
) {
    let tile = CUBE_POS;
    let mut splats = Shared::<[f32]>::new_slice(GROUP * SHARED);
    if tile + 1usize < ranges.len() / 2usize {
        let columns = columns(&frame);
        let x = (tile as u32 % columns) * TILE + UNIT_POS_X;
        let y = (tile as u32 / columns) * TILE + UNIT_POS_Y;
        let inside = x < frame.width && y < frame.height;
        let begin = ranges[2usize * tile];
        let length = ranges[2usize * tile + 2usize] - begin;
        let first_group = ranges[2usize * tile + 1usize];
        let groups = ranges[2usize * tile + 3usize] - first_group;
        let mut light = dark();
        let mut stop = select(inside, length, 0u32);
        for group in 0..groups {
            keep(states, first_group + group, &light);
            let first = group * (GROUP as u32);
            let count = (length - first).min(GROUP as u32);
            sync_cube();
            load(projected, members, begin + first, count, &mut splats);
            sync_cube();
            let pixel = (x as f32 + 0.5f32, y as f32 + 0.5f32);
            stop = add_group(&splats, pixel, (first, count), stop, &mut light);
        }
        if inside {
            let pixel = (y * frame.width + x) as usize;
            write(packed, pixel, &light, background);
            stops[pixel] = stop;
        }
    }
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

/// Writes a pixel's light over the background, and its transmittance.
#[cube]
fn write(packed: &mut [f32], pixel: usize, light: &Array<f32>, background: &[f32]) {
    for channel in 0..3usize {
        packed[4usize * pixel + channel] = light[channel] + light[3usize] * background[24usize + channel];
    }
    packed[4usize * pixel + 3usize] = light[3usize];
}

/// Keeps the state of the unit's pixel before a group.
#[cube]
fn keep(states: &mut [f32], group: u32, light: &Array<f32>) {
    let at = 4usize * (group as usize * PIXELS as usize + UNIT_POS as usize);
    states[at] = light[0usize];
    states[at + 1usize] = light[1usize];
    states[at + 2usize] = light[2usize];
    states[at + 3usize] = light[3usize];
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
        let raw = alpha(splats, g, pixel.0, pixel.1);
        if raw > 0.0f32 && first + j < stop {
            let before = light[3usize];
            let weight = raw.min(ALPHA_MAX) * before;
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
