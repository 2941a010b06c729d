//! The visible Gaussians nearest first: a stable radix sort on the bits of the (positive) depth, ties by index.
//!
//! Chunks of the pairs count their digits and, once all counts are summed, move their pairs, in parallel. The result depends on neither the
//! number of chunks nor that of threads.

use crate::project::Projected;
use rayon::prelude::*;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

/// Bits of a digit, values of one, and the passes that cover 32 bits. As many lines of memory are written at a time as a digit has values: these
/// fit the first-level cache, and threads meet in few of them.
const BITS: u32 = 8;
const DIGITS: usize = 1 << BITS;
const PASSES: u32 = 4;
/// Fewest Gaussians of a chunk, and most chunks.
const MIN_CHUNK: usize = 2048;
const MAX_CHUNKS: usize = 16;

/// Two numbers that any thread may replace; no place is written by two threads between two joins.
#[derive(Debug, Default)]
pub(crate) struct Pair(AtomicU64);

impl Pair {
    #[inline(always)]
    pub(crate) fn set(&self, [low, high]: [u32; 2]) {
        self.0.store(u64::from(high) << 32 | u64::from(low), Relaxed);
    }

    /// The first number.
    #[inline(always)]
    pub(crate) fn low(&self) -> u32 {
        self.0.load(Relaxed) as u32
    }

    /// The second number.
    #[inline(always)]
    pub(crate) fn high(&self) -> u32 {
        (self.0.load(Relaxed) >> 32) as u32
    }
}

/// Indices and depths of the visible Gaussians, nearest first; arrays are kept from call to call.
#[derive(Debug, Default)]
pub(crate) struct DepthOrder {
    /// Index, bits of the depth.
    pairs: Vec<Pair>,
    other: Vec<Pair>,
}

impl DepthOrder {
    /// Sorts the Gaussians whose `reach` is not 0.
    pub(crate) fn update(&mut self, projected: &[Projected]) {
        let chunk = MIN_CHUNK.max(projected.len().div_ceil(MAX_CHUNKS));
        let visible = |g: &&Projected| g.reach > 0.0;
        let counts: Vec<usize> = projected.par_chunks(chunk).map(|chunk| chunk.iter().filter(visible).count()).collect();
        let total = counts.iter().sum();
        self.pairs.resize_with(total, Pair::default);
        self.other.resize_with(total, Pair::default);
        let mut rest = &self.pairs[..];
        let parts: Vec<&[Pair]> = counts.iter().map(|&count| rest.split_off(..count).unwrap_or_default()).collect();
        projected.par_chunks(chunk).zip(parts).enumerate().for_each(|(number, (from, to))| {
            let numbered = (0..).zip(from).filter(|(_, g)| visible(g));
            to.iter().zip(numbered).for_each(|(to, (i, g))| to.set([(number * chunk) as u32 + i, g.depth.to_bits()]));
        });
        for pass in 0..PASSES {
            if move_by_digit(&self.pairs, &self.other, pass * BITS, chunk) {
                std::mem::swap(&mut self.pairs, &mut self.other);
            }
        }
    }

    /// Pairs whose first number is the index of a Gaussian.
    pub(crate) fn pairs(&self) -> &[Pair] {
        &self.pairs
    }
}

/// One pass: by the digit that begins at bit `shift` of the second number. Nothing is moved, and `false` returned, where all have the same.
fn move_by_digit(from: &[Pair], to: &[Pair], shift: u32, chunk: usize) -> bool {
    let digit = |pair: &Pair| (pair.high() >> shift) as usize % DIGITS;
    let mut next: Vec<[u32; DIGITS]> = from
        .par_chunks(chunk)
        .map(|pairs| {
            let mut counts = [0; DIGITS];
            pairs.iter().for_each(|pair| counts[digit(pair)] += 1);
            counts
        })
        .collect();
    if (0..DIGITS).any(|digit| next.iter().map(|counts| counts[digit] as usize).sum::<usize>() == from.len()) {
        return false;
    }
    // From counts to the places of each chunk's first pair of each digit.
    let mut total = 0;
    for digit in 0..DIGITS {
        for counts in &mut next {
            total += std::mem::replace(&mut counts[digit], total);
        }
    }
    from.par_chunks(chunk).zip(&mut next).for_each(|(pairs, next)| {
        for pair in pairs {
            let next = &mut next[digit(pair)];
            to[*next as usize].set([pair.low(), pair.high()]);
            *next += 1;
        }
    });
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn visible_gaussians_come_nearest_first_and_ties_by_index() {
        let gaussian = |i: u32| Projected {
            reach: if i % 7 == 3 { 0.0 } else { 1.0 },
            depth: 0.3 + (i.wrapping_mul(2_654_435_761) % 1000) as f32 * 0.37,
            ..Projected::default()
        };
        let projected: Vec<Projected> = (0..40_000).map(gaussian).collect();
        let mut order = DepthOrder::default();
        for count in [40_000, 9000, 0] {
            let projected = &projected[..count];
            order.update(projected);
            let mut expected: Vec<usize> = (0..count).filter(|&i| projected[i].reach > 0.0).collect();
            expected.sort_by(|&a, &b| projected[a].depth.total_cmp(&projected[b].depth));
            let found: Vec<usize> = order.pairs().iter().map(|pair| pair.low() as usize).collect();
            assert_eq!(found, expected);
        }
    }
}
