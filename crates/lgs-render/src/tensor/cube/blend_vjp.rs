//! The vector–Jacobian product of blending, entry by entry instead of pixel by pixel.
//!
//! A cube of units takes a group of entries, a unit each, and the pixels of the tile that the group changes
//! pass through the units as through a pipeline: unit u works on pixel s - u in step s, and hands on the
//! transmittance and the cotangent's product with the light that lies behind. Every unit sums its own entry
//! over the pixels in their order, so that nothing is reduced between units and no atomics are needed.
//!
//! Where the device's planes are as wide as a group, units hand on through the plane, without barriers; all
//! of them do so in every step, and the arithmetic has no branches that could part them.

use cubecl::prelude::*;

use crate::projected::ALPHA_MAX;

use super::blend::{SHARED, alpha};
use super::frame::{Frame, PIXELS, PROJECTED, TILE};
use super::group::{Group, PIXEL, changed, gather, group_of, sum_of};
use super::lists::GROUP;

/// Floats of an entry's cotangents: moments of the exponent's cotangent, and the colour's
/// (`project_vjp::ImageCotangent`).
pub(super) const COTANGENTS: usize = 9;

/// Cotangents `[entries, COTANGENTS]` of all entries, by number; with `has_planes` units hand on through the
/// plane.
#[cube(launch)]
pub(super) fn blend_vjp(
    projected: &[f32],
    members: &[u32],
    ranges: &[u32],
    states: &[f32],
    packed: &[f32],
    v_packed: &[f32],
    v_entries: &mut [f32],
    frame: Frame,
    #[comptime] has_planes: bool,
) {
    let number = CUBE_POS as u32;
    let groups = ranges[ranges.len() - 1usize];
    let unit = unit(has_planes);
    let mut seen = Shared::<[f32]>::new_slice(PIXELS as usize * PIXEL);
    let mut codes = Shared::<[u32]>::new_slice(PIXELS as usize);
    let mut counts = Shared::<[u32]>::new_slice(GROUP);
    if number < groups {
        let group = group_of(ranges, number, &frame);
        let mask = changed(states, packed, &group, unit, &frame);
        counts[unit as usize] = mask.count_ones();
        sync_cube();
        let begin = sum_of(&counts, unit);
        gather(states, (packed, v_packed), &group, (unit, mask, begin), &mut seen, &mut codes, &frame);
        let position = group.first + unit;
        let exists = position < group.length;
        let member = 2usize * (group.begin + select(exists, position, 0u32)) as usize;
        let own = own(projected, members[member], &group);
        let count = sum_of(&counts, GROUP as u32);
        sync_cube();
        let sum = passed(&own, &seen, &codes, (count, unit), has_planes);
        if exists {
            leave(&sum, v_entries, members[member + 1usize]);
        }
    } else {
        let behind = (number - groups) * (GROUP as u32) + unit;
        leave_none(members, ranges[ranges.len() - 2usize] + behind, v_entries);
    }
}

/// The unit's place in the pipeline.
#[cube]
fn unit(#[comptime] has_planes: bool) -> u32 {
    let mut unit = UNIT_POS;
    if comptime!(has_planes) {
        unit = UNIT_POS_PLANE;
    }
    unit
}

/// Cotangents of nothing.
#[cube]
pub(super) fn no_cotangents() -> Array<f32> {
    let mut sum = Array::<f32>::new(COTANGENTS);
    #[unroll]
    for k in 0..COTANGENTS {
        sum[k] = 0.0f32;
    }
    sum
}

/// Leaves the cotangents of an entry under its number.
#[cube]
fn leave(sum: &Array<f32>, v_entries: &mut [f32], entry: u32) {
    #[unroll]
    for k in 0..COTANGENTS {
        v_entries[entry as usize * COTANGENTS + k] = sum[k];
    }
}

/// Leaves that an entry of no tile has no cotangents.
#[cube]
fn leave_none(members: &[u32], position: u32, v_entries: &mut [f32]) {
    if (position as usize) < members.len() / 2usize {
        leave(&no_cotangents(), v_entries, members[2usize * position as usize + 1usize]);
    }
}

/// The unit's own entry, with its centre relative to the centre of the tile's first pixel.
#[cube]
fn own(projected: &[f32], gaussian: u32, group: &Group) -> Array<f32> {
    let g = gaussian as usize * PROJECTED;
    let mut own = Array::<f32>::new(SHARED);
    #[unroll]
    for k in 0..SHARED {
        own[k] = projected[g + k];
    }
    own[0usize] = own[0usize] - (group.x as f32 + 0.5f32);
    own[1usize] = own[1usize] - (group.y as f32 + 0.5f32);
    own
}

/// Cotangents of the unit's own entry from so many pixels, which pass through the pipeline.
#[cube]
fn passed(
    own: &Array<f32>,
    seen: &[f32],
    codes: &[u32],
    place: (u32, u32),
    #[comptime] has_planes: bool,
) -> Array<f32> {
    let (count, unit) = place;
    let mut pipe = Shared::<[f32]>::new_slice(comptime!(if has_planes { 1 } else { 4 * GROUP }));
    let mut sum = no_cotangents();
    let mut transmittance = 0.0f32;
    let mut behind = 0.0f32;
    let steps = select(count > 0u32, count + GROUP as u32 - 1u32, 0u32);
    for step in 0..steps {
        let light = (transmittance, behind);
        let (before, whole) = handed_on(light, step, unit, &mut pipe, has_planes);
        // Before the unit's first pixel numbers wrap around, which puts them behind the last one.
        let number = step - unit;
        let is_some = number < count;
        let at = select(is_some, number, 0u32) as usize;
        transmittance = select(unit == 0u32, seen[3usize * PIXELS as usize + at], before);
        behind = select(unit == 0u32, seen[4usize * PIXELS as usize + at], whole);
        let code = codes[at];
        let sees = is_some && unit < code / PIXELS;
        let dx = (code % TILE) as f32 - own[0usize];
        let dy = (code % PIXELS / TILE) as f32 - own[1usize];
        let raw = alpha((dx, dy), (own[2usize], own[3usize], own[4usize]), own[5usize]);
        let clamped = select(sees, raw, 0.0f32).min(ALPHA_MAX);
        let weight = clamped * transmittance;
        let v = (seen[at], seen[PIXELS as usize + at], seen[2usize * PIXELS as usize + at]);
        let light = weight * (own[6usize] * v.0 + own[7usize] * v.1 + own[8usize] * v.2);
        transmittance -= weight;
        behind -= light;
        // A clamped alpha does not see the exponent.
        let v_power = select(raw < ALPHA_MAX, light - clamped / (1.0f32 - clamped) * behind, 0.0f32);
        add_moments(&mut sum, v_power, dx, dy);
        add_colour(&mut sum, weight, v);
    }
    sum
}

/// What the unit before has left of the pixel that it worked on a step ago; anything for the first unit.
#[cube]
fn handed_on(
    light: (f32, f32),
    step: u32,
    unit: u32,
    pipe: &mut [f32],
    #[comptime] has_planes: bool,
) -> (f32, f32) {
    let mut before = light.0;
    let mut behind = light.1;
    if comptime!(has_planes) {
        before = plane_shuffle_up(before, 1u32);
        behind = plane_shuffle_up(behind, 1u32);
    } else {
        // Two buffers in turn, so that a barrier a step is enough.
        let here = (GROUP as u32 * (step % 2u32) + unit) as usize;
        pipe[here] = before;
        pipe[2usize * GROUP + here] = behind;
        sync_cube();
        let there = here - select(unit == 0u32, 0usize, 1usize);
        before = pipe[there];
        behind = pipe[2usize * GROUP + there];
    }
    (before, behind)
}

/// Adds the moments of an exponent's cotangent at a distance from the centre.
#[cube]
fn add_moments(sum: &mut Array<f32>, v: f32, dx: f32, dy: f32) {
    let (by_x, by_y) = (v * dx, v * dy);
    sum[0usize] = sum[0usize] + v;
    sum[1usize] = sum[1usize] + by_x;
    sum[2usize] = sum[2usize] + by_y;
    sum[3usize] = sum[3usize] + by_x * dx;
    sum[4usize] = sum[4usize] + by_x * dy;
    sum[5usize] = sum[5usize] + by_y * dy;
}

/// Adds a colour's cotangent.
#[cube]
fn add_colour(sum: &mut Array<f32>, weight: f32, v: (f32, f32, f32)) {
    sum[6usize] = sum[6usize] + weight * v.0;
    sum[7usize] = sum[7usize] + weight * v.1;
    sum[8usize] = sum[8usize] + weight * v.2;
}
