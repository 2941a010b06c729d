//! Prefix sums: units sum runs of values, the sums of the runs are summed in the same way, and each unit
//! places its run. No result depends on the order in which units run.

use burn::backend::TensorMetadata;
use burn::tensor::DType;
use cubecl::prelude::*;
use lgs_tensor::cube::{CubeTensor, arguments, empty, units, zeros};

/// Values that a unit sums.
const RUN: usize = 32;

#[cube(launch)]
fn sum_runs(values: &[u32], sums: &mut [u32]) {
    if ABSOLUTE_POS < sums.len() {
        let begin = ABSOLUTE_POS * RUN;
        let end = (begin + RUN).min(values.len());
        let mut sum = 0u32;
        for i in begin..end {
            sum += values[i];
        }
        sums[ABSOLUTE_POS] = sum;
    }
}

#[cube(launch)]
fn place_runs(values: &[u32], before: &[u32], places: &mut [u32]) {
    let count = values.len();
    let begin = ABSOLUTE_POS * RUN;
    if begin < count {
        let end = (begin + RUN).min(count);
        let mut sum = before[ABSOLUTE_POS];
        for i in begin..end {
            places[i] = sum;
            sum += values[i];
        }
        if end == count {
            places[count] = sum;
        }
    }
}

/// For `n > 0` counts the `n + 1` places at which each begins, the last being their sum.
pub(super) fn places(counts: &CubeTensor) -> CubeTensor {
    let n = counts.shape().num_elements();
    let runs = n.div_ceil(RUN);
    let out = empty(counts, [n + 1], DType::U32);
    let (cubes, dim) = units(&counts.client, runs);
    let before = if runs == 1 {
        zeros(counts, [1], DType::U32)
    } else {
        let sums = empty(counts, [runs], DType::U32);
        let [from, to] = arguments([counts, &sums]);
        sum_runs::launch(&counts.client, cubes.clone(), dim, from, to);
        places(&sums)
    };
    let [from, begins, to] = arguments([counts, &before, &out]);
    place_runs::launch(&counts.client, cubes, dim, from, begins, to);
    out
}
