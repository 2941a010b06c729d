//! The numbers of sums over particles in the table.

use super::tables::*;
use super::tiles::{COLUMNS as TILE_COLUMNS, NARROW, ROWS, UNITS};

/// A term of a sum over particles: its left array, and its right one with how far particles lie apart.
pub(super) type Term = (u32, (u32, usize));
/// No second term.
pub(super) const NO_TERM: Term = (NONE, (0, 0));

/// The numbers of a sum over particles: rows and columns, how far the left factors of particles lie apart,
/// terms, and where the sums go with how far they lie apart by row and by column.
pub(super) fn outer(
    (rows, columns): (usize, usize),
    stride: usize,
    terms: [Term; 2],
    (to, to_row, to_column): (usize, usize, usize),
) -> [u32; OUTER] {
    let mut sum = [0; OUTER];
    for (number, (left, (right, right_stride))) in terms.into_iter().enumerate() {
        let term = &mut sum[TERM * number..];
        (term[LEFT], term[RIGHT], term[RIGHT_STRIDE]) = (left, right, right_stride as u32);
    }
    (sum[OUTPUTS], sum[INPUTS], sum[LEFT_STRIDE]) = (rows as u32, columns as u32, stride as u32);
    (sum[TO], sum[TO_ROW], sum[TO_COLUMN]) = (to as u32, to_row as u32, to_column as u32);
    sum
}

/// The tiles of a sum over particles.
pub(super) fn tiles_of(sum: &[u32; OUTER]) -> u32 {
    if sum[INPUTS] <= NARROW {
        return sum[OUTPUTS].div_ceil(UNITS);
    }
    sum[OUTPUTS].div_ceil(ROWS) * sum[INPUTS].div_ceil(TILE_COLUMNS)
}
