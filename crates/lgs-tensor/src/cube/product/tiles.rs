//! The product of two matrices, a cube of units per tile of the result.
//!
//! Slices of both factors are staged in shared memory while the sums of the slice before are made; a unit
//! holds up to 8 × 8 sums in registers. Every sum runs over its summands in order; where the result is small
//! and there are many summands, ranges of them are summed by themselves and added in order at the end.
#![allow(missing_docs, reason = "those of what the language's macro writes beside a kernel")]

use burn_cubecl::cubecl::{self, prelude::*};

use super::staging::{EDGE, FOUR, Four, factor, fetch, leave, row_of};

/// Summands of a slice.
pub(super) const SLICE: usize = 16;

/// What becomes of a sum.
#[derive(Clone, Copy, Debug, Hash, PartialEq, Eq)]
pub(super) enum End {
    /// It is the result.
    Plain,
    /// A bias is added.
    Bias,
    /// A bias is added, and what is negative becomes zero.
    Relu,
}

/// What is known of a product when its kernel is compiled.
#[derive(Clone, Copy, Debug, Hash, PartialEq, Eq)]
pub(super) struct Form {
    /// Whether the summands of a row of the left factor lie one after the other, and those of a column of the
    /// right one.
    pub(super) is_along: [bool; 2],
    pub(super) end: End,
    /// Whether the left factor's rows are summed as well, behind each range's part of the result.
    pub(super) has_sums: bool,
    /// Fours that a unit holds along each edge of its tile, 1 or 2.
    pub(super) fours: usize,
}

impl Form {
    /// Rows and columns of a tile.
    pub(super) const fn tile(&self) -> usize {
        EDGE * FOUR * self.fours
    }
}

/// Sizes and places of a product.
#[derive(CubeType, CubeLaunch, Clone, Copy)]
pub(super) struct Sizes {
    pub(super) rows: u32,
    pub(super) columns: u32,
    pub(super) inner: u32,
    /// Summands of a range; their number is a multiple of the slice but for the last.
    pub(super) range: u32,
    /// Tiles of all ranges.
    pub(super) cubes: u32,
    /// Where factors and biases begin in their buffers.
    pub(super) left: u32,
    pub(super) right: u32,
    pub(super) bias: u32,
}

/// Adds the products of a slice to a unit's sums.
#[cube]
fn add(left: &[Four], right: &[Four], sums: &mut Array<Four>, #[comptime] fours: usize) {
    let (x, y) = (UNIT_POS as usize % EDGE, UNIT_POS as usize / EDGE);
    #[unroll]
    for k in 0..SLICE {
        let first = k * comptime!(EDGE * fours + 1);
        let mut columns = Array::<Four>::new(fours);
        #[unroll]
        for j in 0..fours {
            columns[j] = right[first + x + comptime!(j * EDGE)];
        }
        #[unroll]
        for i in 0..fours {
            let rows = left[first + y + comptime!(i * EDGE)];
            #[unroll]
            for r in 0..FOUR {
                let row = Four::new(rows.extract(r));
                #[unroll]
                for j in 0..fours {
                    let at = comptime!((i * FOUR + r) * fours + j);
                    sums[at] = fma(row, columns[j], sums[at]);
                }
            }
        }
    }
}

/// The tile of a cube: its range of summands, and its first row and column.
#[derive(CubeType, Clone, Copy)]
struct Tile {
    range: u32,
    row: u32,
    column: u32,
}

#[cube]
fn tile_of(cube: u32, sizes: &Sizes, #[comptime] edge: u32) -> Tile {
    let across = sizes.columns.div_ceil(edge);
    let down = sizes.rows.div_ceil(edge);
    let above = cube / across;
    Tile { range: above / down, row: (above % down) * edge, column: (cube % across) * edge }
}

/// So many zeros, four at a time.
#[cube]
fn zeros(#[comptime] count: usize) -> Array<Four> {
    let mut out = Array::<Four>::new(count);
    #[unroll]
    for i in 0..count {
        out[i] = Four::new(0.0f32);
    }
    out
}

/// `a b` of matrices in buffers. With several ranges of summands the result is `[ranges, rows columns]`, with
/// the sums of the left factor's rows behind each range's part where they are asked for.
#[cube(launch)]
pub(super) fn multiply(a: &[f32], b: &[f32], out: &mut [f32], sizes: Sizes, #[comptime] form: Form) {
    let fours = comptime!(form.fours);
    let mut left = Shared::<[Four]>::new_slice(comptime!(SLICE * (EDGE * form.fours + 1)));
    let mut right = Shared::<[Four]>::new_slice(comptime!(SLICE * (EDGE * form.fours + 1)));
    let cube = CUBE_POS as u32;
    if cube < sizes.cubes {
        let tile = tile_of(cube, &sizes, comptime!(form.tile() as u32));
        let (of_a, of_b) = comptime!(((form.is_along[0], form.fours), (form.is_along[1], form.fours)));
        let left_factor = factor(sizes.left, sizes.rows, sizes.inner, comptime!(form.is_along[0]));
        let right_factor = factor(sizes.right, sizes.columns, sizes.inner, comptime!(form.is_along[1]));
        let mut begin = (tile.range * sizes.range).min(sizes.inner);
        let end = (begin + sizes.range).min(sizes.inner);
        let mut sums = zeros(comptime!(FOUR * form.fours * form.fours));
        let mut total = Four::new(0.0f32);
        let mut held_a = Array::<Four>::new(fours);
        let mut held_b = Array::<Four>::new(fours);
        fetch(a, &left_factor, tile.row, (begin, end), &mut held_a, of_a);
        fetch(b, &right_factor, tile.column, (begin, end), &mut held_b, of_b);
        for _ in 0..(end - begin).div_ceil(SLICE as u32) {
            sync_cube();
            leave(&held_a, &mut left, of_a);
            leave(&held_b, &mut right, of_b);
            sync_cube();
            begin += SLICE as u32;
            fetch(a, &left_factor, tile.row, (begin, end), &mut held_a, of_a);
            fetch(b, &right_factor, tile.column, (begin, end), &mut held_b, of_b);
            add(&left, &right, &mut sums, fours);
            if comptime!(form.has_sums) && tile.column == 0u32 {
                total += row_sums(&left, fours);
            }
        }
        write(b, out, &tile, &sizes, &sums, form);
        if comptime!(form.has_sums) && tile.column == 0u32 {
            write_sums(out, &tile, &sizes, total, fours);
        }
    }
}

/// Sums over a slice of the rows that a unit of the first few stands for.
#[cube]
fn row_sums(left: &[Four], #[comptime] fours: usize) -> Four {
    let mut sum = Four::new(0.0f32);
    if UNIT_POS < comptime!((EDGE * fours) as u32) {
        for k in 0..SLICE {
            sum += left[k * comptime!(EDGE * fours + 1) + UNIT_POS as usize];
        }
    }
    sum
}

/// Where a range's part of the result begins.
#[cube]
fn part(range: u32, sizes: &Sizes, #[comptime] has_sums: bool) -> u32 {
    let mut length = sizes.rows * sizes.columns;
    if comptime!(has_sums) {
        length += sizes.rows;
    }
    range * length
}

/// Writes a unit's sums.
#[cube]
fn write(b: &[f32], out: &mut [f32], tile: &Tile, sizes: &Sizes, sums: &Array<Four>, #[comptime] form: Form) {
    let begin = part(tile.range, sizes, comptime!(form.has_sums));
    let (x, y) = (UNIT_POS % 16u32, UNIT_POS / 16u32);
    #[unroll]
    for i in 0..comptime!(FOUR * form.fours) {
        let row = tile.row + y + comptime!((i * EDGE) as u32);
        #[unroll]
        for j in 0..comptime!(FOUR * form.fours) {
            let column = tile.column + x + comptime!((j * EDGE) as u32);
            if row < sizes.rows && column < sizes.columns {
                let four = sums[comptime!(i * form.fours + j / FOUR)];
                let sum = four.extract(comptime!(j % FOUR));
                let at = begin + row * sizes.columns + column;
                out[at as usize] = ended(b, sizes.bias + column, sum, comptime!(form.end));
            }
        }
    }
}

/// What becomes of a sum, whose bias is at a place.
#[cube]
fn ended(biases: &[f32], at: u32, sum: f32, #[comptime] end: End) -> f32 {
    if comptime!(end == End::Plain) {
        sum
    } else {
        let value = sum + biases[at as usize];
        if comptime!(end == End::Relu) { value.max(0.0f32) } else { value }
    }
}

/// Writes the sums of the left factor's rows.
#[cube]
fn write_sums(out: &mut [f32], tile: &Tile, sizes: &Sizes, total: Four, #[comptime] fours: usize) {
    let begin = part(tile.range, sizes, true) + sizes.rows * sizes.columns;
    if UNIT_POS < comptime!((EDGE * fours) as u32) {
        #[unroll]
        for r in 0..FOUR {
            let row = tile.row + row_of(UNIT_POS) + comptime!((r * EDGE) as u32);
            if row < sizes.rows {
                out[(begin + row) as usize] = total.extract(r);
            }
        }
    }
}
