//! Sums over the rows of a block, for the gradients of biases.

use crate::product::{vector, vector_at};
use pulp::{Arch, Simd, WithSimd};

/// Running sums that take turns, so that additions overlap.
const TURNS: usize = 8;

/// Adds the sums over the rows of `values: [rows, units]` to `sums: [units]`, whole vectors.
pub(crate) fn add_over_rows(values: &[f32], sums: &mut [f32]) {
    Arch::new().dispatch(OverRows { values, sums });
}

struct OverRows<'a> {
    values: &'a [f32],
    sums: &'a mut [f32],
}

impl WithSimd for OverRows<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let units = self.sums.len();
        let whole = self.values.len() / units / TURNS * TURNS * units;
        let (in_turns, rest) = self.values.split_at(whole);
        for unit in (0..units).step_by(S::F32_LANES) {
            let mut turns = [simd.splat_f32s(0.0); TURNS];
            for rows in in_turns.chunks_exact(TURNS * units) {
                for (turn, row) in turns.iter_mut().zip(rows.chunks_exact(units)) {
                    *turn = simd.add_f32s(*turn, vector_at::<S>(row, unit));
                }
            }
            let mut sum = turns[0];
            for &turn in &turns[1..] {
                sum = simd.add_f32s(sum, turn);
            }
            let mut last = simd.splat_f32s(0.0);
            for row in rest.chunks_exact(units) {
                last = simd.add_f32s(last, vector_at::<S>(row, unit));
            }
            let out = vector::<S>(self.sums, unit);
            *out = simd.add_f32s(*out, simd.add_f32s(sum, last));
        }
    }
}

/// The sum of one unit's values in the same order.
pub(crate) fn sum_over_rows(values: &[f32]) -> f32 {
    let mut turns = [0.0_f32; TURNS];
    let (chunks, rest) = values.as_chunks::<TURNS>();
    chunks.iter().for_each(|chunk| (0..TURNS).for_each(|i| turns[i] += chunk[i]));
    turns.iter().sum::<f32>() + rest.iter().sum::<f32>()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_layouts_give_the_same_bits_for_any_number_of_rows() {
        for rows in [1, 7, 8, 61] {
            let units = 32;
            let values: Vec<f32> = (0..rows * units).map(|i| (i as f32 * 0.7).sin()).collect();
            let mut sums = vec![0.0; units];
            add_over_rows(&values, &mut sums);
            for (unit, &found) in sums.iter().enumerate() {
                let column: Vec<f32> = values.iter().skip(unit).step_by(units).copied().collect();
                assert_eq!(found, sum_over_rows(&column), "{rows} rows, unit {unit}");
            }
        }
    }
}
