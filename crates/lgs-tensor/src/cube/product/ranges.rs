//! Sums of what ranges of summands gave.
#![allow(missing_docs, reason = "those of what the language's macro writes beside a kernel")]

use burn_cubecl::cubecl::{self, prelude::*};

/// The parts of ranges of summands, added in order: the first `split` numbers go to one place, the others to
/// another.
#[cube(launch)]
pub(super) fn add_ranges(parts: &[f32], out: &mut [f32], ranges: u32, split: u32, to: u32, then: u32) {
    let count = parts.len() as u32 / ranges;
    let at = ABSOLUTE_POS as u32;
    if at < count {
        let mut sum = 0.0f32;
        for range in 0..ranges {
            sum += parts[(range * count + at) as usize];
        }
        let place = select(at < split, to + at, then + at - select(at < split, 0u32, split));
        out[place as usize] = sum;
    }
}
