//! Gradients of weights: sums over particles of the outer products of cotangents with what goes into layers.
//!
//! A group of particles sums by itself, a cube of units a tile of weights, over its particles in order; the
//! groups' sums are added in order at the end.

use cubecl::prelude::*;

use super::tables::*;
use super::tiles::{
    COLUMNS as TILE_COLUMNS, FACTORS_OF_UNIT, LANES, NARROW, ROW_FACTORS, ROWS, SHARED, SLICE, SUMS,
    UNIT_COLUMNS, UNIT_ROWS, UNITS, add_slice, first_column, first_row, stage,
};

/// Particles whose factors a unit of narrow sums reads at once.
const BATCH: u32 = 4;

/// Where the sums are in the table and how many, and the groups of particles.
#[derive(CubeType, CubeLaunch, Clone, Copy)]
pub(super) struct Outer {
    pub(super) first: u32,
    pub(super) count: u32,
    /// The tiles of all sums.
    pub(super) tiles: u32,
    pub(super) groups: u32,
    /// Particles of a group, and all.
    pub(super) group_rows: u32,
    pub(super) rows: u32,
    /// Floats of a group's gradients.
    pub(super) width: u32,
}

/// Adds the gradients of all weights, summed over each group of particles by itself, to those of the group's.
#[cube(launch)]
pub(super) fn outer_sums(table: &[u32], tape: &[f32], partials: &mut [f32], outer: Outer) {
    let cube = CUBE_POS as u32;
    let mut shared = Shared::<[f32]>::new_slice(SHARED);
    if cube < outer.tiles * outer.groups {
        let (tile, group) = (cube / outer.groups, cube % outer.groups);
        let mut layer = outer.first as usize;
        for i in 1..outer.count {
            let other = outer.first as usize + i as usize * OUTER;
            layer = select(tile >= table[other + BEGIN], other, layer);
        }
        let begin = group * outer.group_rows;
        let range = (begin, (begin + outer.group_rows).min(outer.rows));
        let own = tile - table[layer + BEGIN];
        if table[layer + INPUTS] <= NARROW {
            narrow(table, tape, partials, layer, own * UNITS + UNIT_POS, (range, group * outer.width));
        } else {
            wide(table, tape, partials, &mut shared, (layer, own), (range, group * outer.width));
        }
    }
}

/// A tile of the weights of a layer, over a range of particles, for the group whose sums begin at a place.
#[cube]
fn wide(
    table: &[u32],
    tape: &[f32],
    partials: &mut [f32],
    shared: &mut [f32],
    tile: (usize, u32),
    group: ((u32, u32), u32),
) {
    let (layer, number) = tile;
    let (range, to) = group;
    let tiles = table[layer + INPUTS].div_ceil(TILE_COLUMNS);
    let (output, input) = (number / tiles * ROWS, number % tiles * TILE_COLUMNS);
    let mut sums = Array::<f32>::new(SUMS);
    #[unroll]
    for i in 0..SUMS {
        sums[i] = 0.0f32;
    }
    let mut factors = Array::<f32>::new(FACTORS_OF_UNIT);
    for term in 0..select(table[layer + TERM + LEFT] == NONE, 1u32, 2u32) {
        let of_term = layer + term as usize * TERM;
        let outputs = table[layer + OUTPUTS];
        let left = table[of_term + LEFT] + (output + UNIT_POS % ROWS).min(outputs - 1u32);
        let right = table[of_term + RIGHT] + (input + UNIT_POS).min(table[layer + INPUTS] - 1u32);
        let strides = (table[layer + LEFT_STRIDE], table[of_term + RIGHT_STRIDE]);
        fetch(tape, (left, right), strides, (range.0, range.1), &mut factors);
        for slice in 0..(range.1 - range.0).div_ceil(SLICE) {
            stage(&factors, shared);
            let next = range.0 + (slice + 1u32) * SLICE;
            fetch(tape, (left, right), strides, (next, range.1), &mut factors);
            add_slice(&*shared, &mut sums, 1u32, ROWS);
        }
    }
    add_sums(table, partials, layer, (output, input), to, &mut sums);
}

/// Reads a unit's numbers of the slice of particles that begins with one: zeros behind the last.
#[cube]
fn fetch(tape: &[f32], places: (u32, u32), strides: (u32, u32), range: (u32, u32), factors: &mut Array<f32>) {
    let (begin, end) = range;
    if begin < end {
        #[unroll]
        for i in 0..ROW_FACTORS {
            let row = begin + UNIT_POS / ROWS + i as u32 * (UNITS / ROWS);
            let left = tape[(places.0 + row.min(end - 1u32) * strides.0) as usize];
            factors[i] = select(row < end, left, 0.0f32);
        }
        #[unroll]
        for i in 0..SLICE as usize {
            let row = begin + i as u32;
            let right = tape[(places.1 + row.min(end - 1u32) * strides.1) as usize];
            factors[ROW_FACTORS + i] = select(row < end, right, 0.0f32);
        }
    }
}

/// Adds a unit's sums to those of a group, which begin at a place; all are read before any is written.
#[cube]
fn add_sums(
    table: &[u32],
    partials: &mut [f32],
    layer: usize,
    place: (u32, u32),
    group: u32,
    sums: &mut Array<f32>,
) {
    let (outputs, inputs) = (table[layer + OUTPUTS], table[layer + INPUTS]);
    let (row, column) = (place.0 + first_row(), place.1 + first_column());
    let to = group + table[layer + TO];
    #[unroll]
    for i in 0..UNIT_ROWS {
        #[unroll]
        for j in 0..UNIT_COLUMNS {
            let of_row = (row + i as u32).min(outputs - 1u32) * table[layer + TO_ROW];
            let at = to + of_row + (column + j as u32 * LANES).min(inputs - 1u32) * table[layer + TO_COLUMN];
            sums[UNIT_COLUMNS * i + j] = partials[at as usize] + sums[UNIT_COLUMNS * i + j];
        }
    }
    #[unroll]
    for i in 0..UNIT_ROWS {
        #[unroll]
        for j in 0..UNIT_COLUMNS {
            let (own_row, own_column) = (row + i as u32, column + j as u32 * LANES);
            if own_row < outputs && own_column < inputs {
                let at = to + own_row * table[layer + TO_ROW] + own_column * table[layer + TO_COLUMN];
                partials[at as usize] = sums[UNIT_COLUMNS * i + j];
            }
        }
    }
}

/// The few weights of an output over a range of particles, by one unit, for the group whose sums begin at a
/// place.
#[cube]
fn narrow(
    table: &[u32],
    tape: &[f32],
    partials: &mut [f32],
    layer: usize,
    output: u32,
    group: ((u32, u32), u32),
) {
    let (range, to) = group;
    let (outputs, inputs) = (table[layer + OUTPUTS], table[layer + INPUTS]);
    let mut sums = Array::<f32>::new(NARROW as usize);
    #[unroll]
    for j in 0..NARROW as usize {
        sums[j] = 0.0f32;
    }
    if output < outputs {
        for term in 0..select(table[layer + TERM + LEFT] == NONE, 1u32, 2u32) {
            let of_term = layer + term as usize * TERM;
            for batch in 0..(range.1 - range.0).div_ceil(BATCH) {
                add_batch(table, tape, layer, of_term, output, (range.0 + batch * BATCH, range.1), &mut sums);
            }
        }
        #[unroll]
        for j in 0..NARROW {
            if j < inputs {
                let of_output = to + table[layer + TO] + output * table[layer + TO_ROW];
                let at = (of_output + j * table[layer + TO_COLUMN]) as usize;
                partials[at] = partials[at] + sums[j as usize];
            }
        }
    }
}

/// Adds what a batch of particles gives to the narrow sums of an output.
#[cube]
fn add_batch(
    table: &[u32],
    tape: &[f32],
    layer: usize,
    of_term: usize,
    output: u32,
    range: (u32, u32),
    sums: &mut Array<f32>,
) {
    let (inputs, right_at) = (table[layer + INPUTS], table[of_term + RIGHT]);
    let mut left = Array::<f32>::new(BATCH as usize);
    #[unroll]
    for i in 0..BATCH {
        let row = (range.0 + i).min(range.1 - 1u32);
        let read = tape[(table[of_term + LEFT] + row * table[layer + LEFT_STRIDE] + output) as usize];
        left[i as usize] = select(range.0 + i < range.1, read, 0.0f32);
    }
    #[unroll]
    for i in 0..BATCH {
        if right_at == ONES {
            sums[0usize] += left[i as usize];
        } else {
            let row = (range.0 + i).min(range.1 - 1u32);
            #[unroll]
            for j in 0..NARROW {
                if j < inputs && range.0 + i < range.1 {
                    let right = tape[(right_at + row * table[of_term + RIGHT_STRIDE] + j) as usize];
                    sums[j as usize] += left[i as usize] * right;
                }
            }
        }
    }
}

/// Gradients of parameters: the groups' sums, added in order.
#[cube(launch)]
pub(super) fn sum_groups(
    partials: &[f32],
    gradient: &mut [f32],
    width: u32,
    groups: u32,
    quadratic: u32,
    #[comptime] has_quadratic: bool,
) {
    if ABSOLUTE_POS < gradient.len() {
        let place = ABSOLUTE_POS as u32;
        let mut one = place;
        let mut other = place;
        if comptime!(has_quadratic) {
            // Of the coefficients xx, yy, zz, xy, xz, yz; the linear ones come before.
            let begin = quadratic + 3u32;
            if place >= begin && place < begin + 6u32 {
                let slot = place - begin;
                let moments = gradient.len() as u32;
                let mixed = slot >= 3u32;
                let i = select(mixed, slot / 5u32, slot);
                let j = select(mixed, slot / 2u32, slot);
                one = moments + 3u32 * i + j;
                other = moments + 3u32 * j + i;
            }
        }
        let mut sum = 0.0f32;
        for group in 0..groups {
            sum += partials[(group * width + one) as usize];
            if other != one {
                sum += partials[(group * width + other) as usize];
            }
        }
        gradient[ABSOLUTE_POS] = sum;
    }
}
