//! A stable radix sort of pairs of a key and a value, four bits at a time.
//!
//! Units count the digits of runs of pairs; the counts, digit by digit and run by run, are summed up to the
//! places of the pairs, which each unit then deals in their order. Stability needs no atomics, and equal keys
//! keep their order in every run of the program.

use burn::backend::TensorMetadata;
use burn::tensor::DType;
use cubecl::prelude::*;
use lgs_tensor::cube::{CubeTensor, arguments, empty, units};

use super::scan::places;

/// Pairs that a unit deals.
const RUN: usize = 16;
/// Bits of a digit, and different digits.
const BITS: u32 = 4;
const DIGITS: usize = 16;

#[cube]
fn digit(key: u32, shift: u32) -> usize {
    ((key >> shift) & 15u32) as usize
}

#[cube(launch)]
fn count_digits(pairs: &[u32], counts: &mut [u32], shift: u32) {
    let runs = counts.len() / DIGITS;
    if ABSOLUTE_POS < runs {
        let begin = ABSOLUTE_POS * RUN;
        let end = (begin + RUN).min(pairs.len() / 2usize);
        let mut bins = Array::<u32>::new(DIGITS);
        for bin in 0..DIGITS {
            bins[bin] = 0u32;
        }
        for i in begin..end {
            bins[digit(pairs[2usize * i], shift)] += 1u32;
        }
        for bin in 0..DIGITS {
            counts[bin * runs + ABSOLUTE_POS] = bins[bin];
        }
    }
}

#[cube(launch)]
fn deal_digits(pairs: &[u32], places: &[u32], dealt: &mut [u32], shift: u32) {
    let runs = places.len() / DIGITS;
    if ABSOLUTE_POS < runs {
        let begin = ABSOLUTE_POS * RUN;
        let end = (begin + RUN).min(pairs.len() / 2usize);
        let mut next = Array::<u32>::new(DIGITS);
        for bin in 0..DIGITS {
            next[bin] = places[bin * runs + ABSOLUTE_POS];
        }
        for i in begin..end {
            let bin = digit(pairs[2usize * i], shift);
            let place = next[bin] as usize;
            dealt[2usize * place] = pairs[2usize * i];
            dealt[2usize * place + 1usize] = pairs[2usize * i + 1usize];
            next[bin] = next[bin] + 1u32;
        }
    }
}

/// Pairs `[n, 2]` of a key and a value, n > 0, by the lowest `bits` bits of their keys.
pub(super) fn sorted(mut pairs: CubeTensor, bits: u32) -> CubeTensor {
    let n = pairs.shape()[0];
    let runs = n.div_ceil(RUN);
    let (cubes, dim) = units(&pairs.client, runs);
    for shift in (0..bits).step_by(BITS as usize) {
        let counts = empty(&pairs, [DIGITS * runs], DType::U32);
        let [from, to] = arguments([&pairs, &counts]);
        count_digits::launch(&pairs.client, cubes.clone(), dim, from, to, shift);
        let dealt = empty(&pairs, [n, 2], DType::U32);
        let [from, begins, to] = arguments([&pairs, &places(&counts), &dealt]);
        deal_digits::launch(&pairs.client, cubes.clone(), dim, from, begins, to, shift);
        pairs = dealt;
    }
    pairs
}
