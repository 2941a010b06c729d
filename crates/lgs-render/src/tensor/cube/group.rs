//! A group of entries on the way back: its place, and the pixels of its tile that it changes.

use cubecl::prelude::*;

use super::blend::state_of;
use super::frame::{Frame, PIXELS, TILE, columns};
use super::lists::GROUP;

/// Floats of a pixel: cotangent of the colour, and before the group the transmittance and the cotangent's
/// product with the light behind.
pub(super) const PIXEL: usize = 5;
/// Pixels that a unit gathers.
const EACH: u32 = PIXELS / GROUP as u32;

/// The tile of a group.
#[cube]
fn tile_of(ranges: &[u32], group: u32) -> u32 {
    let mut low = 0u32;
    let mut high = (ranges.len() / 2usize) as u32 - 1u32;
    while low + 1u32 < high {
        let middle = (low + high) / 2u32;
        if ranges[2usize * middle as usize + 1usize] <= group {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
}

/// A group of entries: its tile's top left corner, where its list begins among all, the positions in the list
/// of its first entry and of the list's end, and its number among all groups.
#[derive(CubeType, Clone, Copy)]
pub(super) struct Group {
    pub(super) x: u32,
    pub(super) y: u32,
    pub(super) begin: u32,
    pub(super) first: u32,
    pub(super) length: u32,
    pub(super) number: u32,
}

#[cube]
pub(super) fn group_of(ranges: &[u32], number: u32, frame: &Frame) -> Group {
    let tile = tile_of(ranges, number);
    let at = 2usize * tile as usize;
    let columns = columns(frame);
    Group {
        x: (tile % columns) * TILE,
        y: (tile / columns) * TILE,
        begin: ranges[at],
        first: (number - ranges[at + 1usize]) * (GROUP as u32),
        length: ranges[at + 2usize] - ranges[at],
        number,
    }
}

/// The sum of the first `end` counts.
#[cube]
pub(super) fn sum_of(counts: &[u32], end: u32) -> u32 {
    let mut sum = 0u32;
    for unit in 0..GROUP {
        sum += select((unit as u32) < end, counts[unit], 0u32);
    }
    sum
}

/// Whether a pixel of the group's tile lies in the image, and its number there.
#[cube]
fn pixel_of(group: &Group, pixel: u32, frame: &Frame) -> (bool, usize) {
    let x = group.x + pixel % TILE;
    let y = group.y + pixel / TILE;
    let inside = x < frame.width && y < frame.height;
    (inside, select(inside, y * frame.width + x, 0u32) as usize)
}

/// Which of the unit's pixels the group changes: those open before it whose transmittance is less after it.
/// Where a pixel is open after the group, the state before the next one was kept; else the last is its own.
#[cube]
pub(super) fn changed(states: &[f32], packed: &[f32], group: &Group, unit: u32, frame: &Frame) -> u32 {
    let mut mask = 0u32;
    let before = state_of(group.number, frame) + 3usize * PIXELS as usize;
    let after = state_of(group.number + 1u32, frame) + 3usize * PIXELS as usize;
    for k in 0..EACH {
        let pixel = k * (GROUP as u32) + unit;
        let (inside, at) = pixel_of(group, pixel, frame);
        let stop = select(inside, states[at], 0.0f32) as u32;
        if stop > group.first {
            let mut last = packed[4usize * at + 3usize];
            if stop > group.first + GROUP as u32 {
                last = states[after + pixel as usize];
            }
            mask |= select(last < states[before + pixel as usize], 1u32 << k, 0u32);
        }
    }
    mask
}

/// Gathers those of the unit's pixels that the group changes, which begin at a place among those of all
/// units. A pixel's code is its number in the tile and, above eight bits, how many entries of the group it
/// sees.
#[cube]
pub(super) fn gather(
    states: &[f32],
    images: (&[f32], &[f32]),
    group: &Group,
    own: (u32, u32, u32),
    seen: &mut [f32],
    codes: &mut [u32],
    frame: &Frame,
) {
    let (packed, v_packed) = images;
    let (unit, mask, begin) = own;
    let mut to = begin as usize;
    for k in 0..EACH {
        if ((mask >> k) & 1u32) == 1u32 {
            let pixel = k * (GROUP as u32) + unit;
            let (_, at) = pixel_of(group, pixel, frame);
            let state = state_of(group.number, frame) + pixel as usize;
            let mut behind = v_packed[4usize * at + 3usize] * packed[4usize * at + 3usize];
            for channel in 0..3usize {
                let v = v_packed[4usize * at + channel];
                behind += v * (packed[4usize * at + channel] - states[state + channel * PIXELS as usize]);
                seen[channel * PIXELS as usize + to] = v;
            }
            seen[3usize * PIXELS as usize + to] = states[state + 3usize * PIXELS as usize];
            seen[4usize * PIXELS as usize + to] = behind;
            let sees = (states[at] as u32 - group.first).min(GROUP as u32);
            codes[to] = pixel + sees * PIXELS;
            to += 1usize;
        }
    }
}
