//! Chains of products of matrices with what becomes of their sums: the layers of a network one after the
//! other, by a cube of units for every block of particles.
//!
//! What a product leaves on the tape is read by the units of the same cube alone, so that a barrier lies
//! between one product and the next, and no launch.

use cubecl::prelude::*;

use super::ends::end_row;
use super::field::{Range, Scales, normalise};
use super::field_vjp::{kicked, seed};
use super::tables::*;
use super::tiles::{
    COLUMNS as TILE_COLUMNS, FACTORS_OF_UNIT, LANES, NARROW, ROW_FACTORS, ROWS, SHARED, SLICE, SUMS,
    UNIT_COLUMNS, UNIT_ROWS, UNITS, add_slice, first_column, first_row, stage,
};

/// Units that share the sums of one particle in a narrow product.
const PARTS: u32 = UNITS / ROWS;

/// Products of two networks that run side by side: the number of the first of each, and how many.
#[derive(CubeType, CubeLaunch, Clone, Copy)]
pub(super) struct Chains {
    pub(super) first: u32,
    pub(super) count: u32,
    pub(super) other: u32,
    pub(super) other_count: u32,
}

/// What the chains are, and what their cubes begin with: an evaluation with what enters the networks,
pub(super) const FORWARD: u32 = 0;
/// its backward pass with cotangents of what the networks give, made of rows `[n, 6]`,
pub(super) const BACKWARD: u32 = 1;
/// or of those of the state after a step without alignment.
pub(super) const BACKWARD_OF_STEP: u32 = 2;

/// Runs the chains for a range of particles; the cubes of the second follow those of the first. `carried` has
/// the cotangents that a backward pass begins with ([`kicked`]). What differs between calls is told at run
/// time: the program is long, and there is one for all.
#[cube(launch)]
pub(super) fn products(
    weights: &[f32],
    table: &[u32],
    tape: &mut [f32],
    states: &[f32],
    carried: &[f32],
    chains: Chains,
    range: Range,
    scales: Scales,
    h: f32,
    pass: u32,
    force: u32,
) {
    let blocks = range.rows.div_ceil(ROWS);
    let cube = CUBE_POS as u32;
    let mut shared = Shared::<[f32]>::new_slice(SHARED);
    if cube < 2u32 * blocks {
        let is_first = cube < blocks;
        let row = (cube - select(is_first, 0u32, blocks)) * ROWS;
        let own = row + UNIT_POS;
        if UNIT_POS < ROWS && own < range.rows {
            if pass == FORWARD {
                normalise(states, table, tape, own, &range, &scales, is_first);
            } else {
                let v = kicked(carried, (range.first + own) as usize, h, pass == BACKWARD_OF_STEP);
                seed(table, tape, states, &v, own, &range, &scales, h, select(is_first, NONE, force));
            }
        }
        let first = select(is_first, chains.first, chains.other);
        for i in 0..select(is_first, chains.count, chains.other_count) {
            sync_storage();
            let product = PLACES + (first + i) as usize * PRODUCT;
            if table[product + END] == PLAIN {
                narrow(weights, table, tape, &mut shared, product, (row, range.rows));
            } else {
                wide(weights, table, tape, &mut shared, product, (row, range.rows));
            }
        }
    }
}

/// A product for the particles of a block, given its first one and their number in all.
#[cube]
fn wide(
    weights: &[f32],
    table: &[u32],
    tape: &mut [f32],
    shared: &mut [f32],
    product: usize,
    range: (u32, u32),
) {
    let (row, rows) = range;
    let columns = table[product + COLUMNS];
    for tile in 0..columns.div_ceil(TILE_COLUMNS) {
        let column = tile * TILE_COLUMNS;
        let sums = tile_sums(weights, table, &*tape, shared, product, (row, rows, column));
        // What becomes of the sums is written once, for rows in a loop, so they are where a loop finds them.
        sync_cube();
        #[unroll]
        for i in 0..SUMS {
            shared[UNIT_POS as usize + i * UNITS as usize] = sums[i];
        }
        let mut columns_at = Array::<u32>::new(UNIT_COLUMNS);
        #[unroll]
        for j in 0..UNIT_COLUMNS {
            columns_at[j] = column + first_column() + j as u32 * LANES;
        }
        for i in 0..UNIT_ROWS as u32 {
            let own = row + first_row() + i;
            if own < rows {
                let mut of_row = Array::<f32>::new(UNIT_COLUMNS);
                #[unroll]
                for j in 0..UNIT_COLUMNS {
                    let at = (i * UNIT_COLUMNS as u32 + j as u32) * UNITS + UNIT_POS;
                    of_row[j] = shared[at as usize];
                }
                end_row(weights, table, tape, product, own * columns, &columns_at, &of_row);
            }
        }
    }
}

/// A unit's sums of the tile that begins at a column.
#[cube]
fn tile_sums(
    weights: &[f32],
    table: &[u32],
    tape: &[f32],
    shared: &mut [f32],
    product: usize,
    place: (u32, u32, u32),
) -> Array<f32> {
    let (row, rows, column) = place;
    let mut factors_at = Array::<u32>::new(ROW_FACTORS);
    #[unroll]
    for i in 0..ROW_FACTORS {
        let own = (row + UNIT_POS / SLICE + i as u32 * (UNITS / SLICE)).min(rows - 1u32);
        factors_at[i] = table[product + FACTORS] + own * table[product + STRIDE];
    }
    let columns = table[product + COLUMNS];
    let weights_at = table[product + WEIGHTS] + (column + UNIT_POS).min(columns - 1u32);
    let mut sums = biases(weights, table, product, column);
    let mut factors = Array::<f32>::new(FACTORS_OF_UNIT);
    let (inner, stride) = (table[product + INNER], table[product + WEIGHTS_STRIDE]);
    fetch(weights, tape, &factors_at, (weights_at, stride), (0u32, inner), &mut factors);
    for slice in 0..inner.div_ceil(SLICE) {
        stage(&factors, shared);
        // The next slice is on its way while this one is summed.
        let next = (slice + 1u32) * SLICE;
        fetch(weights, tape, &factors_at, (weights_at, stride), (next, inner), &mut factors);
        add_slice(&*shared, &mut sums, SLICE, 1u32);
    }
    sums
}

/// Reads a unit's numbers of the slice that begins at a summand: zeros behind the last one.
#[cube]
fn fetch(
    weights: &[f32],
    tape: &[f32],
    factors_at: &Array<u32>,
    of_weights: (u32, u32),
    range: (u32, u32),
    factors: &mut Array<f32>,
) {
    let (weights_at, stride) = of_weights;
    let (begin, inner) = range;
    if begin < inner {
        let summand = begin + UNIT_POS % SLICE;
        let last = summand.min(inner - 1u32);
        #[unroll]
        for i in 0..ROW_FACTORS {
            factors[i] = select(summand < inner, tape[(factors_at[i] + last) as usize], 0.0f32);
        }
        #[unroll]
        for i in 0..SLICE as usize {
            let summand = begin + i as u32;
            let weight = weights[(weights_at + summand.min(inner - 1u32) * stride) as usize];
            factors[ROW_FACTORS + i] = select(summand < inner, weight, 0.0f32);
        }
    }
}

/// The biases of a unit's columns, or zeros.
#[cube]
fn biases(weights: &[f32], table: &[u32], product: usize, column: u32) -> Array<f32> {
    let mut sums = Array::<f32>::new(SUMS);
    let (columns, biases) = (table[product + COLUMNS], table[product + BIASES]);
    let has_biases = biases != NONE;
    #[unroll]
    for j in 0..UNIT_COLUMNS {
        let own = (column + first_column() + j as u32 * LANES).min(columns - 1u32);
        let at = select(has_biases, biases, 0u32) + own;
        let bias = select(has_biases, weights[at as usize], 0.0f32);
        #[unroll]
        for i in 0..UNIT_ROWS {
            sums[UNIT_COLUMNS * i + j] = bias;
        }
    }
    sums
}

/// A product of few columns, whose sums are the result. Units share a particle's sums, each every fourth
/// summand, and add theirs in order.
#[cube]
fn narrow(
    weights: &[f32],
    table: &[u32],
    tape: &mut [f32],
    shared: &mut [f32],
    product: usize,
    range: (u32, u32),
) {
    let (row, rows) = range;
    let own = row + UNIT_POS / PARTS;
    let columns = table[product + COLUMNS];
    let sums = part_sums(weights, table, &*tape, product, own.min(rows - 1u32));
    #[unroll]
    for j in 0..NARROW {
        shared[(UNIT_POS + j * UNITS) as usize] = sums[j as usize];
    }
    sync_cube();
    let biases = table[product + BIASES];
    let has_biases = biases != NONE;
    #[unroll]
    for j in 0..NARROW / PARTS {
        let column = UNIT_POS % PARTS + j * PARTS;
        if own < rows && column < columns {
            let at = select(has_biases, biases + column, 0u32);
            let mut sum = select(has_biases, weights[at as usize], 0.0f32);
            #[unroll]
            for part in 0..PARTS {
                sum += shared[(column * UNITS + UNIT_POS / PARTS * PARTS + part) as usize];
            }
            tape[(table[product + FIRST] + own * columns + column) as usize] = sum;
        }
    }
}

/// A unit's part of the sums of a particle in a narrow product.
#[cube]
fn part_sums(weights: &[f32], table: &[u32], tape: &[f32], product: usize, row: u32) -> Array<f32> {
    let (inner, columns) = (table[product + INNER], table[product + COLUMNS]);
    let factors = table[product + FACTORS] + row * table[product + STRIDE];
    let mut sums = Array::<f32>::new(NARROW as usize);
    #[unroll]
    for j in 0..NARROW as usize {
        sums[j] = 0.0f32;
    }
    for step in 0..inner.div_ceil(PARTS) {
        let summand = step * PARTS + UNIT_POS % PARTS;
        if summand < inner {
            let factor = tape[(factors + summand) as usize];
            let at = table[product + WEIGHTS] + summand * table[product + WEIGHTS_STRIDE];
            #[unroll]
            for j in 0..NARROW {
                if j < columns {
                    sums[j as usize] += factor * weights[(at + j) as usize];
                }
            }
        }
    }
    sums
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
