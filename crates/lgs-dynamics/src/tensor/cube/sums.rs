//! Gradients of weights: sums over particles of the outer products of cotangents with what goes into layers.
//!
//! A group of particles sums by itself, a unit a square of weights, over its particles in order; the groups'
//! sums are added in order at the end.

use cubecl::prelude::*;

use super::products::{EDGE, TILE};
use super::tables::*;

/// Adds the gradients of all weights, summed over each group of particles by itself, to those of the group's.
#[cube(launch)]
pub(super) fn outer_sums(
    table: &[u32],
    tape: &[f32],
    partials: &mut [f32],
    layers: OuterLayers,
    rows: u32,
    group_rows: u32,
    width: u32,
) {
    let mut unit = ABSOLUTE_POS as u32 % layers.units;
    let group = ABSOLUTE_POS as u32 / layers.units;
    let begin = group * group_rows;
    if begin < rows {
        let mut layer = layers.first as usize;
        for _ in 1..layers.count {
            let units = outer_units(table, layer);
            if unit >= units {
                unit -= units;
                layer += OUTER;
            } else {
                break;
            }
        }
        let end = (begin + group_rows).min(rows);
        let sums = outer_sum(table, tape, layer, unit, (begin, end));
        add_sums(table, partials, layer, unit, group * width, &sums);
    }
}

/// Where the sums are in the table, how many, and all their units.
#[derive(CubeType, CubeLaunch, Clone, Copy)]
pub(super) struct OuterLayers {
    pub(super) first: u32,
    pub(super) count: u32,
    pub(super) units: u32,
}

#[cube]
fn outer_units(table: &[u32], layer: usize) -> u32 {
    table[layer + OUTPUTS].div_ceil(TILE) * (table[layer + INPUTS] + 1u32).div_ceil(TILE)
}

/// The square of sums of a unit over a range of particles.
#[cube]
fn outer_sum(table: &[u32], tape: &[f32], layer: usize, unit: u32, range: (u32, u32)) -> Array<f32> {
    let (outputs, inputs) = (table[layer + OUTPUTS], table[layer + INPUTS]);
    let tiles = (inputs + 1u32).div_ceil(TILE);
    let (output, input) = (unit / tiles * TILE, unit % tiles);
    let has_first = table[layer + LEFT_1] != NONE;
    let mut sums = Array::<f32>::new(EDGE * EDGE);
    #[unroll]
    for i in 0..EDGE * EDGE {
        sums[i] = 0.0f32;
    }
    for row in range.0..range.1 {
        let left = table[layer + LEFT_2] + row * outputs;
        let right = table[layer + RIGHT_2] + row * table[layer + RIGHT_2_STRIDE];
        add_outer(tape, (left, right), (output, outputs), (input, inputs, tiles), 1.0f32, &mut sums);
        if has_first {
            let left = table[layer + LEFT_1] + row * outputs;
            let right = table[layer + RIGHT_1] + row * table[layer + RIGHT_1_STRIDE];
            add_outer(tape, (left, right), (output, outputs), (input, inputs, tiles), 0.0f32, &mut sums);
        }
    }
    sums
}

/// Adds `left ⊗ (right, last)` of one particle.
#[cube]
fn add_outer(
    tape: &[f32],
    places: (u32, u32),
    of_outputs: (u32, u32),
    of_inputs: (u32, u32, u32),
    last: f32,
    sums: &mut Array<f32>,
) {
    let (output, outputs) = of_outputs;
    let (input, inputs, tiles) = of_inputs;
    #[unroll]
    for j in 0..EDGE {
        let column = input + j as u32 * tiles;
        let is_last = column >= inputs;
        let read = tape[(places.1 + select(is_last, 0u32, column)) as usize];
        let right = select(is_last, last, read);
        #[unroll]
        for i in 0..EDGE {
            let left = tape[(places.0 + (output + i as u32).min(outputs - 1u32)) as usize];
            sums[EDGE * i + j] += left * right;
        }
    }
}

/// Adds a unit's sums to those of a group, which begin at a place.
#[cube]
fn add_sums(table: &[u32], partials: &mut [f32], layer: usize, unit: u32, group: u32, sums: &Array<f32>) {
    let (outputs, inputs) = (table[layer + OUTPUTS], table[layer + INPUTS]);
    let tiles = (inputs + 1u32).div_ceil(TILE);
    let (output, input) = (unit / tiles * TILE, unit % tiles);
    #[unroll]
    for i in 0..EDGE {
        #[unroll]
        for j in 0..EDGE {
            let (row, column) = (output + i as u32, input + j as u32 * tiles);
            if row < outputs && column <= inputs {
                let weight = table[layer + TO] + row * inputs + column;
                let to = group + select(column == inputs, table[layer + ONES_TO] + row, weight);
                partials[to as usize] = partials[to as usize] + sums[EDGE * i + j];
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
