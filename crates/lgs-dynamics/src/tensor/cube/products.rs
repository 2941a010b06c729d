//! Products of matrices with what becomes of their sums.
//!
//! A unit holds a square of sums, four particles by four columns that lie apart, so that neighbouring units
//! read neighbouring weights. Its sums go over all summands in order: nothing is reduced between units.

use cubecl::prelude::*;

use super::tables::*;

/// Edge of the square of sums that a unit holds.
pub(super) const TILE: u32 = 4;
/// The same, as a number of places.
pub(super) const EDGE: usize = TILE as usize;

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
