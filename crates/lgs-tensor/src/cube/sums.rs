//! Sums along an axis: units sum values that lie apart by the number of units, and their sums are summed in
//! the same way. No result depends on the order in which units run.
#![allow(missing_docs, reason = "those of what the language's macro writes beside a kernel")]

use burn::tensor::DType;
use burn_cubecl::cubecl::{self, prelude::*};

use super::{CubeTensor, arguments, empty, units};

/// Values that a unit sums.
const RUN: usize = 64;

/// Of every column of every block `[length, width]` the sums of values that lie `parts` rows apart.
#[cube(launch)]
fn sum_parts(values: &[f32], sums: &mut [f32], length: u32, parts: u32, width: u32) {
    if ABSOLUTE_POS < sums.len() {
        let at = ABSOLUTE_POS as u32;
        let (column, part) = (at % width, at / width % parts);
        let block = at / width / parts;
        let mut sum = 0.0f32;
        let mut row = part;
        while row < length {
            sum += values[((block * length + row) * width + column) as usize];
            row += parts;
        }
        sums[ABSOLUTE_POS] = sum;
    }
}

/// The sums `[blocks, width]` over the middle axis of contiguous values `[blocks, length, width]`.
#[must_use]
pub fn sums(values: &CubeTensor, [blocks, length, width]: [usize; 3]) -> CubeTensor {
    let parts = length.div_ceil(RUN).max(1);
    let out = empty(values, [blocks * parts, width], DType::F32);
    let (count, dim) = units(&out.client, blocks * parts * width);
    let [from, to] = arguments([values, &out]);
    let [length, apart, columns] = [length, parts, width].map(|number| number as u32);
    sum_parts::launch(&out.client, count, dim, from, to, length, apart, columns);
    if parts > 1 { sums(&out, [blocks, parts, width]) } else { out }
}
