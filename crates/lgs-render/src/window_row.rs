//! The window of SSIM along rows of cells.

use crate::cells::{CHANNELS, Row};
use crate::simd::{BLOCK, Lanes, V, splat};
use crate::window::{Carry, Nest, RADIUS, ROW_STEP, STEP};
use pulp::Simd;

/// Replaces a plane of a row by the nested sums of a plane of another one, or of its squares. The other one's margins are filled.
#[inline(always)]
pub(crate) fn along<S: Simd, const SQUARED: bool, const FROM: usize, const TO: usize>(
    simd: S,
    nest: &Nest<S>,
    (from, plane): (&Row<FROM>, usize),
    (to, plane_to): (&mut Row<TO>, usize),
) {
    for index in 0..BLOCK / S::F32_LANES {
        for channel in 0..CHANNELS {
            let mut first = [splat(simd, 0.0); 2 * RADIUS];
            for (x, cells) in first.iter_mut().zip(from) {
                *x = input::<S, SQUARED>(simd, &cells[channel][plane], index);
            }
            let mut carry = Carry::begin(nest, &first);
            let mut x = [splat(simd, 0.0); STEP + RADIUS];
            x[..RADIUS].copy_from_slice(&first[RADIUS..]);
            let blocks = to[RADIUS..].as_chunks_mut::<ROW_STEP>().0;
            for (entering, to) in from[2 * RADIUS..].as_chunks::<ROW_STEP>().0.iter().zip(blocks) {
                for i in 0..ROW_STEP {
                    x[RADIUS + i] = input::<S, SQUARED>(simd, &entering[i][channel][plane], index);
                }
                let out = carry.advance::<ROW_STEP>(nest, &x);
                x.copy_within(ROW_STEP..ROW_STEP + RADIUS, 0);
                for i in 0..ROW_STEP {
                    to[i][channel][plane_to].set(index, out[i]);
                }
            }
        }
    }
}

#[inline(always)]
fn input<S: Simd, const SQUARED: bool>(simd: S, lanes: &Lanes, index: usize) -> V<S> {
    let x = lanes.get(simd, index);
    if SQUARED { x * x } else { x }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cells::{Layout, cells, cells_mut, fill_margins};
    use crate::window::{Column, SIZE, down, gain, weights};
    use pulp::{Arch, WithSimd};

    struct Windows<'a>(&'a Layout, &'a mut Row<1>);

    impl WithSimd for Windows<'_> {
        type Output = [Vec<[Lanes; 1]>; 2];

        /// Along a row, and down its cells as if they were a column.
        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
            let (nest, mut row) = (Nest::new(simd), self.0.row::<1>());
            fill_margins(simd, self.0, self.1);
            along::<S, false, 1, 1>(simd, &nest, (self.1, 0), (&mut row, 0));
            let (mut column, mut below) = (Column::default(), cells(self.1).to_vec());
            for block in below.as_chunks_mut::<STEP>().0 {
                for index in 0..BLOCK / S::F32_LANES {
                    let mut x = [splat(simd, 0.0); STEP];
                    for (x, cell) in x.iter_mut().zip(&*block) {
                        *x = cell[0].get(simd, index);
                    }
                    let sums = down(simd, &nest, &mut column, &x, index);
                    for (out, sum) in block.iter_mut().zip(sums) {
                        out[0].set(index, sum);
                    }
                }
            }
            [cells(&row).to_vec(), below]
        }
    }

    /// A value of a cell.
    fn value(cell: usize, lane: usize) -> f32 {
        ((cell * 37 + lane * 11) % 17) as f32 - 5.0
    }

    #[test]
    fn every_sum_weighs_the_inputs_around_it() {
        // A segment of sixteen steps along a row, and one that ends with a shorter step.
        for pixels in [16, 20, 41] {
            let layout = Layout::new(BLOCK * pixels);
            let mut inputs = layout.row::<1>();
            for (i, cell) in cells_mut(&mut inputs)[..layout.cells()].iter_mut().enumerate() {
                cell[0].0 = std::array::from_fn(|lane| value(i, lane));
            }
            let [row, below] = Arch::new().dispatch(Windows(&layout, &mut inputs));
            let at = |i: usize, lane: usize| f64::from(inputs.as_flattened()[i][0].0[lane]);
            let mean = |i: usize, stride: usize, lane: usize| -> f64 {
                (0..SIZE).map(|k| f64::from(weights()[k]) * at(CHANNELS * RADIUS + i + stride * k - stride * RADIUS, lane)).sum()
            };
            for lane in 0..BLOCK {
                for (i, cell) in row[..layout.cells()].iter().enumerate() {
                    let found = f64::from(cell[0].0[lane]) / gain();
                    assert!((found - mean(i, CHANNELS, lane)).abs() < 2e-6, "along a row: {found} for {}", mean(i, CHANNELS, lane));
                }
                // The column gives a result when the input `RADIUS` behind it has entered, and follows zeros.
                for i in RADIUS..layout.cells() - STEP - RADIUS {
                    let found = f64::from(below[RADIUS + i][0].0[lane]) / gain();
                    assert!((found - mean(i, 1, lane)).abs() < 2e-6, "down a column: {found} for {}", mean(i, 1, lane));
                }
            }
        }
    }
}
