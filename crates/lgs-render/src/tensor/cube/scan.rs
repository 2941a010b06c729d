//! Prefix sums: cubes sum blocks of values, and place the values of a block behind the sums of the blocks
//! before. No result depends on the order in which units run.

use burn::backend::TensorMetadata;
use burn::tensor::DType;
use cubecl::prelude::*;
use lgs_tensor::cube::{CubeTensor, arguments, cubes, empty};

/// Units of a cube, and edge of the square that they make.
pub(super) const UNITS: usize = 256;
const EDGE: usize = 16;
/// Values of a unit, and of a block.
const EACH: usize = 8;
const BLOCK: usize = UNITS * EACH;

/// Memory that a cube's scan needs; one in use must not be scanned again before the next barrier.
#[derive(CubeType)]
pub(super) struct Sums {
    units: Shared<[u32]>,
    rows: Shared<[u32]>,
}

#[cube]
impl Sums {
    pub(super) fn new() -> Sums {
        Sums { units: Shared::<[u32]>::new_slice(UNITS), rows: Shared::<[u32]>::new_slice(EDGE) }
    }

    /// The sum of the values of the units before this one, and that of all; by two barriers.
    pub(super) fn scan(&mut self, value: u32) -> (u32, u32) {
        let unit = UNIT_POS as usize;
        self.units[unit] = value;
        sync_cube();
        if unit < EDGE {
            let mut sum = 0u32;
            for i in 0..EDGE {
                sum += self.units[unit * EDGE + i];
            }
            self.rows[unit] = sum;
        }
        sync_cube();
        let mut before = 0u32;
        let mut total = 0u32;
        for row in 0..EDGE {
            before += select(row < unit / EDGE, self.rows[row], 0u32);
            total += self.rows[row];
        }
        for i in unit / EDGE * EDGE..unit {
            before += self.units[i];
        }
        (before, total)
    }
}

/// The sum of every block.
#[cube(launch)]
fn sum_blocks(values: &[u32], sums: &mut [u32]) {
    if CUBE_POS < sums.len() {
        let mut sum = 0u32;
        for k in 0..EACH {
            let i = CUBE_POS * BLOCK + k * UNITS + UNIT_POS as usize;
            if i < values.len() {
                sum += values[i];
            }
        }
        let mut shared = Sums::new();
        let (_before, total) = shared.scan(sum);
        if UNIT_POS == 0u32 {
            sums[CUBE_POS] = total;
        }
    }
}

/// Writes where every value begins, and after the last what all sum up to, into a column of rows.
#[cube(launch)]
fn place_blocks(values: &[u32], sums: &[u32], places: &mut [u32], columns: u32, column: u32) {
    let count = values.len();
    if CUBE_POS * BLOCK < count {
        let mut earlier = 0u32;
        let mut block = UNIT_POS as usize;
        while block < CUBE_POS {
            earlier += sums[block];
            block += UNITS;
        }
        let begin = (CUBE_POS * BLOCK + UNIT_POS as usize * EACH).min(count);
        let end = (begin + EACH).min(count);
        let mut own = 0u32;
        for i in begin..end {
            own += values[i];
        }
        let mut shared = Sums::new();
        let (_before, earlier) = shared.scan(earlier);
        let mut shared = Sums::new();
        let (before, _total) = shared.scan(own);
        let mut place = earlier + before;
        for i in begin..end {
            places[i * columns as usize + column as usize] = place;
            place += values[i];
        }
        if end == count && begin < end {
            places[count * columns as usize + column as usize] = place;
        }
    }
}

/// For `n > 0` counts the `n + 1` places at which each begins, the last being their sum.
pub(super) fn places(counts: &CubeTensor) -> CubeTensor {
    let out = empty(counts, [counts.shape().num_elements() + 1], DType::U32);
    place(counts, &out, 0);
    out
}

/// Writes the places of counts into a column of rows, of which there is one more.
pub(super) fn place(counts: &CubeTensor, rows: &CubeTensor, column: usize) {
    let n = counts.shape().num_elements();
    let blocks = n.div_ceil(BLOCK);
    let (client, dim) = (&counts.client, CubeDim::new_1d(UNITS as u32));
    // A single block has none before it.
    let mut sums = counts.clone();
    if blocks > 1 {
        sums = empty(counts, [blocks], DType::U32);
        let [from, to] = arguments([counts, &sums]);
        sum_blocks::launch(client, cubes(client, blocks), dim, from, to);
    }
    let columns = rows.shape().num_elements() / (n + 1);
    let [from, before, to] = arguments([counts, &sums, rows]);
    place_blocks::launch(client, cubes(client, blocks), dim, from, before, to, columns as u32, column as u32);
}
