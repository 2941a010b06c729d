//! How the numbers of a factor come into shared memory: neighbouring units move neighbouring numbers.
#![allow(missing_docs, reason = "those of what the language's macro writes beside a function")]

use burn_cubecl::cubecl::{self, prelude::*};

/// Four numbers that are moved and multiplied together.
pub(super) type Four = Vector<f32, Const<4>>;

/// Units along an edge of a cube.
pub(super) const EDGE: usize = 16;
/// Numbers of a [`Four`].
pub(super) const FOUR: usize = 4;

/// A factor as it is read: where it begins, its rows (columns of the right factor), and how far rows and
/// summands lie apart.
#[derive(CubeType, Clone, Copy)]
pub(super) struct Factor {
    begin: u32,
    rows: u32,
    row_stride: u32,
    inner_stride: u32,
}

#[cube]
pub(super) fn factor(begin: u32, rows: u32, inner: u32, #[comptime] is_along: bool) -> Factor {
    if comptime!(is_along) {
        Factor { begin, rows, row_stride: inner, inner_stride: 1u32 }
    } else {
        Factor { begin, rows, row_stride: 1u32, inner_stride: rows }
    }
}

/// The summand and the number of the four rows that a unit stages, of those in a round.
#[cube]
fn staged(round: u32, #[comptime] is_along: bool) -> (u32, u32) {
    if comptime!(is_along) {
        (UNIT_POS % 16u32, UNIT_POS / 16u32 + 16u32 * round)
    } else {
        (UNIT_POS / 16u32, UNIT_POS % 16u32 + 16u32 * round)
    }
}

/// A number of a factor; zero outside.
#[cube]
fn number(values: &[f32], of: &Factor, row: u32, inner: u32, end: u32) -> f32 {
    let inside = row < of.rows && inner < end;
    let at = of.begin + select(inside, row * of.row_stride + inner * of.inner_stride, 0u32);
    select(inside, values[at as usize], 0.0f32)
}

/// The first of four rows of a tile, which lie [`EDGE`] apart: neighbouring units move neighbouring numbers.
#[cube]
pub(super) fn row_of(four: u32) -> u32 {
    four / 16u32 * 64u32 + four % 16u32
}

/// What a unit stages of a slice that begins at a summand.
#[cube]
pub(super) fn fetch(
    values: &[f32],
    of: &Factor,
    first_row: u32,
    slice: (u32, u32),
    held: &mut Array<Four>,
    #[comptime] form: (bool, usize),
) {
    #[unroll]
    for round in 0..comptime!(form.1) {
        let (k, four) = staged(round as u32, comptime!(form.0));
        let (row, inner) = (first_row + row_of(four), slice.0 + k);
        let mut numbers = Four::new(0.0f32);
        #[unroll]
        for i in 0..FOUR {
            numbers.insert(i, number(values, of, row + comptime!((i * EDGE) as u32), inner, slice.1));
        }
        held[round] = numbers;
    }
}

/// Leaves in shared memory what a unit has fetched.
#[cube]
pub(super) fn leave(held: &Array<Four>, stage: &mut [Four], #[comptime] form: (bool, usize)) {
    #[unroll]
    for round in 0..comptime!(form.1) {
        let (k, four) = staged(round as u32, comptime!(form.0));
        stage[k as usize * comptime!(EDGE * form.1 + 1) + four as usize] = held[round];
    }
}
