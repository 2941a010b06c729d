//! Products of matrices with what becomes of their sums, and the gradients of weights.
//!
//! A unit holds a square of sums, four particles by four columns that lie apart, so that neighbouring units
//! read neighbouring weights. Its sums go over all summands in order: nothing is reduced between units.

use cubecl::prelude::*;

use super::tables::*;

/// Edge of the square of sums that a unit holds.
pub(super) const TILE: u32 = 4;
/// The same, as a number of places.
const EDGE: usize = TILE as usize;

/// A number of the table.
#[cube]
fn entry(table: &[u32], at: usize) -> usize {
    table[at] as usize
}

/// Units of a product for so many particles.
#[cube]
fn units_of(table: &[u32], product: u32, rows: u32) -> u32 {
    table[PLACES + product as usize * PRODUCT + COLUMNS].div_ceil(TILE) * rows.div_ceil(TILE)
}

/// Runs a product, or two side by side, for so many particles.
#[cube(launch)]
pub(super) fn products(weights: &[f32], table: &[u32], tape: &mut [f32], first: u32, second: u32, rows: u32) {
    let unit = ABSOLUTE_POS as u32;
    let of_first = units_of(table, first, rows);
    let is_first = unit < of_first;
    let other = select(second == NONE, first, second);
    let of_second = select(second == NONE, 0u32, units_of(table, other, rows));
    if unit < of_first + of_second {
        let product = PLACES + select(is_first, first, other) as usize * PRODUCT;
        run(weights, table, tape, product, unit - select(is_first, 0u32, of_first), rows);
    }
}

/// One unit of a product.
#[cube]
fn run(weights: &[f32], table: &[u32], tape: &mut [f32], product: usize, unit: u32, rows: u32) {
    let columns = table[product + COLUMNS];
    let tiles = columns.div_ceil(TILE);
    let column = unit % tiles;
    let row = unit / tiles * TILE;
    let mut factors = Array::<u32>::new(EDGE);
    let mut columns_at = Array::<u32>::new(EDGE);
    #[unroll]
    for i in 0..EDGE {
        factors[i] = table[product + FACTORS] + (row + i as u32).min(rows - 1u32) * table[product + STRIDE];
        columns_at[i] = (column + i as u32 * tiles).min(columns - 1u32);
    }
    let mut sums = begin(weights, table, &columns_at, product);
    let inner = table[product + INNER];
    let stride = table[product + WEIGHTS_STRIDE];
    let mut at = table[product + WEIGHTS];
    for k in 0..inner {
        #[unroll]
        for j in 0..EDGE {
            let weight = weights[(at + columns_at[j]) as usize];
            #[unroll]
            for i in 0..EDGE {
                sums[EDGE * i + j] += tape[(factors[i] + k) as usize] * weight;
            }
        }
        at += stride;
    }
    #[unroll]
    for i in 0..EDGE {
        #[unroll]
        for j in 0..EDGE {
            if row + (i as u32) < rows && column + (j as u32) * tiles < columns {
                let at = (row + i as u32) * columns + columns_at[j];
                end(weights, table, tape, product, at as usize, columns_at[j] as usize, sums[EDGE * i + j]);
            }
        }
    }
}

/// The biases of a unit's columns, or zeros.
#[cube]
fn begin(weights: &[f32], table: &[u32], columns_at: &Array<u32>, product: usize) -> Array<f32> {
    let mut sums = Array::<f32>::new(EDGE * EDGE);
    let biases = table[product + BIASES];
    let has_biases = biases != NONE;
    #[unroll]
    for j in 0..EDGE {
        let at = select(has_biases, biases, 0u32) + columns_at[j];
        let bias = select(has_biases, weights[at as usize], 0.0f32);
        #[unroll]
        for i in 0..EDGE {
            sums[EDGE * i + j] = bias;
        }
    }
    sums
}

/// What becomes of a sum at a place of the particles' arrays.
#[cube]
fn end(weights: &[f32], table: &[u32], tape: &mut [f32], product: usize, at: usize, column: usize, sum: f32) {
    let kind = table[product + END];
    let first = entry(table, product + FIRST) + at;
    if kind == PLAIN {
        tape[first] = sum;
    } else {
        let arguments = entry(table, product + ARGUMENTS) + at;
        let has_arguments = kind == HIDDEN || kind == TOP;
        if has_arguments {
            tape[arguments] = sum;
        }
        let z = tape[arguments];
        let s = sigmoid(z);
        let slope = s * (1.0f32 + z * (1.0f32 - s));
        if kind == HIDDEN {
            tape[first] = z * s;
        } else if kind == DOWN {
            tape[first] = tape[first] + slope * sum;
        } else {
            // A chain begins with the weights of the output.
            let head = select(kind == TOP, table[product + HEAD], 0u32) as usize + column;
            let factor = select(kind == TOP, weights[head], sum);
            tape[first] = slope * factor;
            let second = select(kind == BACK, first, entry(table, product + SECOND) + at);
            if kind == UP {
                tape[second] = tape[second] * sum;
            } else if kind != BACK {
                let curvature = s * (1.0f32 - s) * (2.0f32 + z * (1.0f32 - 2.0f32 * s));
                tape[second] = curvature * factor;
            }
        }
    }
}

/// `1 / (1 + exp(−z))`, by the exponential that does not overflow.
#[cube]
pub(super) fn sigmoid(z: f32) -> f32 {
    let e = (-z.abs()).exp();
    select(z >= 0.0f32, 1.0f32, e) / (1.0f32 + e)
}

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

/// The weights as they are, and behind them transposed, layer by layer.
#[cube(launch)]
pub(super) fn transpose(params: &[f32], layers: &[u32], weights: &mut [f32]) {
    if ABSOLUTE_POS < params.len() {
        let place = ABSOLUTE_POS as u32;
        let value = params[ABSOLUTE_POS];
        weights[ABSOLUTE_POS] = value;
        for layer in 0..layers.len() / 3usize {
            let (begin, inputs) = (layers[3usize * layer], layers[3usize * layer + 1usize]);
            let outputs = layers[3usize * layer + 2usize];
            if place >= begin && place < begin + inputs * outputs {
                let (output, input) = ((place - begin) / inputs, (place - begin) % inputs);
                let to = params.len() as u32 + begin + input * outputs + output;
                weights[to as usize] = value;
            }
        }
    }
}
