//! Sums of products by tiles: a cube of units holds the sums of a tile in registers, while slices of the
//! factors pass through shared memory.
//!
//! A tile has [`ROWS`] by [`COLUMNS`] sums. A unit holds eight rows of every 32nd column: the units of a
//! group of 32 read one number together from one factor, and neighbouring ones from the other. Its sums go
//! over all summands in order: nothing is reduced between units.

use cubecl::prelude::*;

/// Units of a cube.
pub(super) const UNITS: u32 = 128;
/// Rows and columns of a tile.
pub(super) const ROWS: u32 = 32;
pub(super) const COLUMNS: u32 = 128;
/// Summands of a slice.
pub(super) const SLICE: u32 = 16;
/// Most columns of narrow sums, which no tile is made for.
pub(super) const NARROW: u32 = 8;

/// Units that hold the same rows, and how far the columns of a unit lie apart.
pub(super) const LANES: u32 = 32;
/// Rows and columns of a unit.
pub(super) const UNIT_ROWS: usize = 8;
pub(super) const UNIT_COLUMNS: usize = 4;
/// Sums of a unit.
pub(super) const SUMS: usize = UNIT_ROWS * UNIT_COLUMNS;
/// Numbers of a slice that a unit stages: those of the rows' factors, and all.
pub(super) const ROW_FACTORS: usize = (ROWS * SLICE / UNITS) as usize;
pub(super) const FACTORS_OF_UNIT: usize = ROW_FACTORS + SLICE as usize;
/// Floats of shared memory: the sums of a tile, which are more than a slice. It is what every device has.
pub(super) const SHARED: usize = SUMS * UNITS as usize;

/// Where the columns' factors of a slice begin in shared memory.
const COLUMN_FACTORS: u32 = ROWS * SLICE;
/// Summands that are unrolled at once.
const UNROLLED: usize = 8;

/// The first row of a unit in a tile.
#[cube]
pub(super) fn first_row() -> u32 {
    UNIT_POS / LANES * UNIT_ROWS as u32
}

/// The first column of a unit in a tile.
#[cube]
pub(super) fn first_column() -> u32 {
    UNIT_POS % LANES
}

/// Puts a unit's numbers of a slice where all units of the cube can read them.
#[cube]
pub(super) fn stage(factors: &Array<f32>, shared: &mut [f32]) {
    sync_cube();
    #[unroll]
    for i in 0..FACTORS_OF_UNIT {
        shared[UNIT_POS as usize + i * UNITS as usize] = factors[i];
    }
    sync_cube();
}

/// Adds the products of a slice to a unit's sums, given how far the rows' factors lie apart by row and by
/// summand.
#[cube]
pub(super) fn add_slice(
    shared: &[f32],
    sums: &mut Array<f32>,
    #[comptime] row_stride: u32,
    #[comptime] summand_stride: u32,
) {
    let of_rows = first_row() * row_stride;
    let of_columns = COLUMN_FACTORS + first_column();
    for part in 0..SLICE / UNROLLED as u32 {
        let row = (of_rows + part * UNROLLED as u32 * summand_stride) as usize;
        let column = (of_columns + part * UNROLLED as u32 * COLUMNS) as usize;
        #[unroll]
        for k in 0..UNROLLED {
            let mut right = Array::<f32>::new(UNIT_COLUMNS);
            #[unroll]
            for j in 0..UNIT_COLUMNS {
                right[j] = shared[column + k * COLUMNS as usize + j * LANES as usize];
            }
            #[unroll]
            for i in 0..UNIT_ROWS {
                let left = shared[row + k * summand_stride as usize + i * row_stride as usize];
                #[unroll]
                for j in 0..UNIT_COLUMNS {
                    sums[UNIT_COLUMNS * i + j] += left * right[j];
                }
            }
        }
    }
}
