//! A stable radix sort of pairs of a key and a value, up to eight bits at a time.
//!
//! Cubes sort blocks of pairs by a digit in shared memory, four bits at a time; the counts of a digit in all
//! blocks are summed up, and each block's pairs are dealt to where its digits begin among all. Stability
//! needs no atomics, and equal keys keep their order in every run of the program.

use burn::backend::TensorMetadata;
use burn::tensor::DType;
use cubecl::prelude::*;
use lgs_tensor::cube::{CubeTensor, arguments, cubes, empty};

use super::scan::{Sums, UNITS};

/// Pairs of a unit, and of a block.
const EACH: usize = 4;
const BLOCK: usize = UNITS * EACH;
/// Bits of a digit at most: a unit each has to have one of them.
const BITS: u32 = 8;
/// Bits by which a block is sorted at a time, and words that count them, two to a word.
const ROUND: u32 = 4;
const WORDS: usize = 8;

#[cube]
fn digit(key: u32, shift: u32, bits: u32) -> u32 {
    (key >> shift) & ((1u32 << bits) - 1u32)
}

/// Sorts each block by a digit, and notes `[digits, blocks]` how many pairs have it and where they begin in
/// the block.
#[cube(launch)]
fn sort_blocks(
    pairs: &[u32],
    sorted: &mut [u32],
    counts: &mut [u32],
    begins: &mut [u32],
    shift: u32,
    bits: u32,
) {
    let blocks = counts.len() >> bits as usize;
    let mut items = Shared::<[u32]>::new_slice(BLOCK);
    if CUBE_POS < blocks {
        let first = CUBE_POS * BLOCK;
        let count = (pairs.len() / 2usize - first).min(BLOCK);
        for k in 0..EACH {
            let i = k * UNITS + UNIT_POS as usize;
            // What is missing in the last block comes behind all pairs.
            let key = select(i < count, pairs[2usize * (first + i.min(count - 1usize))], 0xffff_ffffu32);
            items[i] = digit(key, shift, bits) * BLOCK as u32 + i as u32;
        }
        sort_items(&mut items, bits);
        if UNIT_POS < 1u32 << bits {
            let at = UNIT_POS as usize * blocks + CUBE_POS;
            let begin = begin_of(&items, UNIT_POS).min(count as u32);
            begins[at] = begin;
            counts[at] = begin_of(&items, UNIT_POS + 1u32).min(count as u32) - begin;
        }
        for k in 0..EACH {
            let i = k * UNITS + UNIT_POS as usize;
            if i < count {
                let from = 2usize * (first + items[i] as usize % BLOCK);
                sorted[2usize * (first + i)] = pairs[from];
                sorted[2usize * (first + i) + 1usize] = pairs[from + 1usize];
            }
        }
    }
}

/// Sorts items, of which each is a digit and, below it, its place.
#[cube]
fn sort_items(items: &mut [u32], bits: u32) {
    let mut words = Shared::<[u32]>::new_slice(WORDS * UNITS);
    let mut sums = Sums::new();
    let rounds = (bits + ROUND - 1u32) / ROUND;
    for round in 0..rounds {
        sync_cube();
        let mut own = Array::<u32>::new(EACH);
        let mut ranks = Array::<u32>::new(EACH);
        count_own(items, &mut words, round, &mut own, &mut ranks);
        sync_cube();
        let total = place_words(&mut words, &mut sums);
        sync_cube();
        #[unroll]
        for k in 0..EACH {
            let (at, half) = word_of(own[k], round);
            // The upper halves count the upper digits, which come behind all lower ones.
            let lower = select(half > 0u32, total & 0xffffu32, 0u32);
            let place = ((words[at] >> half) & 0xffffu32) + lower + ranks[k];
            items[place as usize] = own[k];
        }
    }
    sync_cube();
}

/// The word in which a unit counts the digit of an item, and the bits before the digit's half of it.
#[cube]
fn word_of(item: u32, round: u32) -> (usize, u32) {
    let digit = ((item / BLOCK as u32) >> (ROUND * round)) & 15u32;
    (digit as usize % WORDS * UNITS + UNIT_POS as usize, digit / WORDS as u32 * 16u32)
}

/// Counts the digits of the unit's own items, which follow each other, and notes how many of the same digit
/// come before each.
#[cube]
fn count_own(items: &mut [u32], words: &mut [u32], round: u32, own: &mut Array<u32>, ranks: &mut Array<u32>) {
    for word in 0..WORDS {
        words[word * UNITS + UNIT_POS as usize] = 0u32;
    }
    #[unroll]
    for k in 0..EACH {
        own[k] = items[UNIT_POS as usize * EACH + k];
        let (at, half) = word_of(own[k], round);
        ranks[k] = (words[at] >> half) & 0xffffu32;
        words[at] = words[at] + (1u32 << half);
    }
}

/// Replaces all words by the sums of those before them; gives the sum of all.
#[cube]
fn place_words(words: &mut [u32], sums: &mut Sums) -> u32 {
    let first = UNIT_POS as usize * WORDS;
    let mut sum = 0u32;
    for word in 0..WORDS {
        sum += words[first + word];
    }
    let (before, total) = sums.scan(sum);
    let mut place = before;
    for word in 0..WORDS {
        let count = words[first + word];
        words[first + word] = place;
        place += count;
    }
    total
}

/// The first item whose digit is not before `digit`.
#[cube]
fn begin_of(items: &[u32], digit: u32) -> u32 {
    let mut low = 0u32;
    let mut high = items.len() as u32;
    while low < high {
        let middle = (low + high) / 2u32;
        if items[middle as usize] / (BLOCK as u32) < digit {
            low = middle + 1u32;
        } else {
            high = middle;
        }
    }
    low
}

/// For every digit, a cube each: how many pairs of blocks before have it, and how many all have.
#[cube(launch)]
fn place_counts(counts: &[u32], places: &mut [u32], totals: &mut [u32]) {
    if CUBE_POS < totals.len() {
        let blocks = counts.len() / totals.len();
        let each = (blocks + UNITS - 1usize) / UNITS;
        let begin = CUBE_POS * blocks + (UNIT_POS as usize * each).min(blocks);
        let end = (begin + each).min((CUBE_POS + 1usize) * blocks);
        let mut sum = 0u32;
        for i in begin..end {
            sum += counts[i];
        }
        let mut sums = Sums::new();
        let (before, total) = sums.scan(sum);
        let mut place = before;
        for i in begin..end {
            places[i] = place;
            place += counts[i];
        }
        if UNIT_POS == 0u32 {
            totals[CUBE_POS] = total;
        }
    }
}

/// Deals the pairs of sorted blocks to where their digits begin.
#[cube(launch)]
fn deal_blocks(
    sorted: &[u32],
    begins: &[u32],
    places: &[u32],
    totals: &[u32],
    dealt: &mut [u32],
    shift: u32,
    bits: u32,
) {
    let (digits, unit) = (totals.len(), UNIT_POS as usize);
    let blocks = begins.len() / digits;
    let mut offsets = Shared::<[u32]>::new_slice(UNITS);
    if CUBE_POS < blocks {
        let mut own = 0u32;
        if unit < digits {
            own = totals[unit];
        }
        let mut sums = Sums::new();
        let (before, _total) = sums.scan(own);
        if unit < digits {
            let at = unit * blocks + CUBE_POS;
            // Numbers may wrap around here, and do so back below.
            offsets[unit] = before + places[at] - begins[at];
        }
        sync_cube();
        for k in 0..EACH {
            let i = k * UNITS + unit;
            let from = 2usize * (CUBE_POS * BLOCK + i);
            if from < sorted.len() {
                let key = sorted[from];
                let to = 2usize * (offsets[digit(key, shift, bits) as usize] + i as u32) as usize;
                dealt[to] = key;
                dealt[to + 1usize] = sorted[from + 1usize];
            }
        }
    }
}

/// Pairs `[n, 2]` of a key and a value, n > 0, by the lowest `bits` bits of their keys.
pub(super) fn sorted(mut pairs: CubeTensor, bits: u32) -> CubeTensor {
    let each = bits.div_ceil(bits.div_ceil(BITS).max(1));
    for shift in (0..bits).step_by(each.max(1) as usize) {
        pairs = sorted_by_digit(&pairs, shift, each);
    }
    pairs
}

fn sorted_by_digit(pairs: &CubeTensor, shift: u32, bits: u32) -> CubeTensor {
    let (n, digits) = (pairs.shape()[0], 1 << bits);
    let blocks = n.div_ceil(BLOCK);
    let (client, dim) = (&pairs.client, CubeDim::new_1d(UNITS as u32));
    let [in_blocks, dealt] = [(); 2].map(|()| empty(pairs, [n, 2], DType::U32));
    let [counts, begins, places] = [(); 3].map(|()| empty(pairs, [digits, blocks], DType::U32));
    let totals = empty(pairs, [digits], DType::U32);
    let [from, to, count, begin] = arguments([pairs, &in_blocks, &counts, &begins]);
    sort_blocks::launch(client, cubes(client, blocks), dim, from, to, count, begin, shift, bits);
    let [from, to, all] = arguments([&counts, &places, &totals]);
    place_counts::launch(client, cubes(client, digits), dim, from, to, all);
    let [from, begin, place, all, to] = arguments([&in_blocks, &begins, &places, &totals, &dealt]);
    deal_blocks::launch(client, cubes(client, blocks), dim, from, begin, place, all, to, shift, bits);
    dealt
}
