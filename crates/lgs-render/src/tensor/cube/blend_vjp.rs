//! The vector–Jacobian product of blending, entry by entry instead of pixel by pixel.
//!
//! A cube of units takes a group of entries, a unit each, and the pixels of the tile pass through the units
//! as through a pipeline: unit u works on pixel s - u in step s, and hands on the transmittance and the
//! cotangent's product with the colour so far. What lies behind an entry is the whole less that. Every unit
//! sums its own entry over the pixels in their order, so that nothing is reduced between units and no atomics
//! are needed.

use cubecl::prelude::*;

use crate::projected::ALPHA_MAX;

use super::blend::{SHARED, alpha};
use super::frame::{Frame, PIXELS, PROJECTED, TILE, columns};
use super::lists::GROUP;

/// Floats of a pixel: cotangent of the colour, its product with all light, and the stop.
const PIXEL: usize = 5;
/// Floats of an entry's cotangents: moments of the exponent's cotangent, and the colour's
/// (`project_vjp::ImageCotangent`).
pub(super) const COTANGENTS: usize = 9;

/// Collects what pixels bring along: nothing where the lists had no room for all entries.
#[cube(launch)]
pub(super) fn collect(
    packed: &[f32],
    v_packed: &[f32],
    stops: &[u32],
    places: &[u32],
    pixels: &mut [f32],
    room: u32,
) {
    let pixel = ABSOLUTE_POS;
    if pixel < stops.len() {
        let fits = places[places.len() - 1usize] <= room;
        let v_transmittance = select(fits, v_packed[4usize * pixel + 3usize], 0.0f32);
        let mut light = v_transmittance * packed[4usize * pixel + 3usize];
        for channel in 0..3usize {
            let v = select(fits, v_packed[4usize * pixel + channel], 0.0f32);
            pixels[PIXEL * pixel + channel] = v;
            light += v * packed[4usize * pixel + channel];
        }
        pixels[PIXEL * pixel + 3usize] = light;
        pixels[PIXEL * pixel + 4usize] = stops[pixel] as f32;
    }
}

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

/// A group of entries: its tile's top left corner, where its list begins among all, and the positions in the
/// list of its first entry and of the list's end.
#[derive(CubeType, Clone, Copy)]
struct Group {
    x: u32,
    y: u32,
    begin: u32,
    first: u32,
    length: u32,
}

#[cube]
fn group_of(ranges: &[u32], group: u32, frame: &Frame) -> Group {
    let tile = tile_of(ranges, group);
    let at = 2usize * tile as usize;
    let columns = columns(frame);
    Group {
        x: (tile % columns) * TILE,
        y: (tile / columns) * TILE,
        begin: ranges[at],
        first: (group - ranges[at + 1usize]) * (GROUP as u32),
        length: ranges[at + 2usize] - ranges[at],
    }
}

/// Cotangents `[entries, COTANGENTS]` of all entries, by number.
#[cube(launch)]
pub(super) fn blend_vjp(
    projected: &[f32],
    members: &[u32],
    ranges: &[u32],
    states: &[f32],
    pixels: &[f32],
    v_entries: &mut [f32],
    frame: Frame,
) {
    let number = CUBE_POS as u32;
    let mut splats = Shared::<[f32]>::new_slice(GROUP * SHARED);
    let mut seen = Shared::<[f32]>::new_slice(PIXELS as usize * PIXEL);
    let mut pipe = Shared::<[f32]>::new_slice(4usize * GROUP);
    let mut stops = Shared::<[f32]>::new_slice(GROUP);
    if number < ranges[ranges.len() - 1usize] {
        let group = group_of(ranges, number, &frame);
        let position = group.first + UNIT_POS;
        let exists = position < group.length;
        let member = 2usize * (group.begin + select(exists, position, 0u32)) as usize;
        stops[UNIT_POS as usize] = look(pixels, &group, &mut seen, &frame);
        own(projected, members[member], &mut splats);
        sync_cube();
        let mut sum = no_cotangents();
        // No step where all pixels are closed before the group.
        let steps = select((group.first as f32) < furthest(&stops), PIXELS + GROUP as u32, 0u32);
        for step in 0..steps {
            let pixel = step - UNIT_POS.min(step);
            if UNIT_POS <= step && pixel < PIXELS {
                take(states, number, (pixel, step), &mut pipe, &seen);
                pass(&splats, &group, (pixel, step), &mut pipe, &seen, &mut sum);
            }
            sync_cube();
        }
        if exists {
            leave(&sum, v_entries, members[member + 1usize]);
        }
    }
}

/// Cotangents of nothing.
#[cube]
pub(super) fn no_cotangents() -> Array<f32> {
    let mut sum = Array::<f32>::new(COTANGENTS);
    for k in 0..COTANGENTS {
        sum[k] = 0.0f32;
    }
    sum
}

/// Leaves the cotangents of an entry under its number.
#[cube]
fn leave(sum: &Array<f32>, v_entries: &mut [f32], entry: u32) {
    for k in 0..COTANGENTS {
        v_entries[entry as usize * COTANGENTS + k] = sum[k];
    }
}

/// Loads the unit's own entry.
#[cube]
fn own(projected: &[f32], gaussian: u32, splats: &mut [f32]) {
    for k in 0..SHARED {
        splats[UNIT_POS as usize * SHARED + k] = projected[gaussian as usize * PROJECTED + k];
    }
}

/// The last stop of all units' pixels.
#[cube]
fn furthest(stops: &[f32]) -> f32 {
    let mut last = 0.0f32;
    for unit in 0..GROUP {
        last = last.max(stops[unit]);
    }
    last
}

/// Loads the pixels of the tile, of which those outside of the image are closed from the start; gives the
/// last stop of those that the unit loads.
#[cube]
fn look(pixels: &[f32], group: &Group, seen: &mut [f32], frame: &Frame) -> f32 {
    let mut last = 0.0f32;
    let mut pixel = UNIT_POS;
    while pixel < PIXELS {
        let x = group.x + pixel % TILE;
        let y = group.y + pixel / TILE;
        let inside = x < frame.width && y < frame.height;
        let from = select(inside, y * frame.width + x, 0u32) as usize * PIXEL;
        for k in 0..PIXEL {
            seen[pixel as usize * PIXEL + k] = select(inside, pixels[from + k], 0.0f32);
        }
        last = last.max(seen[pixel as usize * PIXEL + 4usize]);
        pixel += GROUP as u32;
    }
    last
}

/// Takes a pixel over from the unit before, which worked on it a step ago: transmittance, and the cotangent's
/// product with the colour so far. The first unit takes the state before the group.
#[cube]
fn take(states: &[f32], group: u32, place: (u32, u32), pipe: &mut [f32], seen: &[f32]) {
    let (pixel, step) = place;
    let here = 2usize * (GROUP as u32 * (step % 2u32) + UNIT_POS) as usize;
    if UNIT_POS == 0u32 {
        let at = 4usize * (group as usize * PIXELS as usize + pixel as usize);
        let v = pixel as usize * PIXEL;
        pipe[here] = states[at + 3usize];
        pipe[here + 1usize] = seen[v] * states[at]
            + seen[v + 1usize] * states[at + 1usize]
            + seen[v + 2usize] * states[at + 2usize];
    } else {
        let before = 2usize * (GROUP as u32 * ((step + 1u32) % 2u32) + UNIT_POS - 1u32) as usize;
        pipe[here] = pipe[before];
        pipe[here + 1usize] = pipe[before + 1usize];
    }
}

/// Puts the unit's entry between a pixel's light so far and what is behind, and sums its cotangents.
#[cube]
fn pass(
    splats: &[f32],
    group: &Group,
    place: (u32, u32),
    pipe: &mut [f32],
    seen: &[f32],
    sum: &mut Array<f32>,
) {
    let (pixel, step) = place;
    let position = group.first + UNIT_POS;
    let here = 2usize * (GROUP as u32 * (step % 2u32) + UNIT_POS) as usize;
    let g = UNIT_POS as usize * SHARED;
    let v = pixel as usize * PIXEL;
    let x = (group.x + pixel % TILE) as f32 + 0.5f32;
    let y = (group.y + pixel / TILE) as f32 + 0.5f32;
    let raw = alpha(splats, g, x, y);
    if raw > 0.0f32 && (position as f32) < seen[v + 4usize] {
        let clamped = raw.min(ALPHA_MAX);
        let before = pipe[here];
        let weight = clamped * before;
        let shade = splats[g + 6usize] * seen[v]
            + splats[g + 7usize] * seen[v + 1usize]
            + splats[g + 8usize] * seen[v + 2usize];
        let light = weight * shade;
        let so_far = pipe[here + 1usize] + light;
        let behind = seen[v + 3usize] - so_far;
        let odds = clamped / (1.0f32 - clamped);
        // A clamped alpha does not see the exponent.
        let v_power = select(raw < ALPHA_MAX, light - odds * behind, 0.0f32);
        add_moments(sum, v_power, x - splats[g], y - splats[g + 1usize]);
        for channel in 0..3usize {
            sum[6usize + channel] = sum[6usize + channel] + weight * seen[v + channel];
        }
        pipe[here] = before - weight;
        pipe[here + 1usize] = so_far;
    }
}

/// Adds the moments of an exponent's cotangent at a distance from the centre.
#[cube]
fn add_moments(sum: &mut Array<f32>, v: f32, dx: f32, dy: f32) {
    sum[0usize] = sum[0usize] + v;
    sum[1usize] = sum[1usize] + v * dx;
    sum[2usize] = sum[2usize] + v * dy;
    sum[3usize] = sum[3usize] + v * dx * dx;
    sum[4usize] = sum[4usize] + v * dx * dy;
    sum[5usize] = sum[5usize] + v * dy * dy;
}
