//! The three matrix products of a linear layer on a block of Gaussians, single-threaded (blocks run in
//! parallel).
//!
//! Activations are feature-major, `[features, block]`; weights are `[out, in]`, row by row, of which a layer
//! may use a range of columns that starts at `first`.

#![expect(unsafe_code, reason = "the gemm crate takes raw pointers; lengths are asserted before each call")]

use gemm::{Parallelism, gemm};

/// A range of a weight's columns.
#[derive(Clone, Copy)]
pub(super) struct Columns {
    /// Inputs of the whole weight, the length of its rows.
    pub(super) row: usize,
    /// First column.
    pub(super) first: usize,
    /// Number of columns.
    pub(super) count: usize,
    /// Rows.
    pub(super) outputs: usize,
}

impl Columns {
    fn check(&self, weight: &[f32], block: usize, inputs: &[f32], outputs: &[f32]) {
        assert!(
            self.first + self.count <= self.row && weight.len() >= self.row * self.outputs,
            "columns of the weight"
        );
        assert!(
            inputs.len() >= self.count * block && outputs.len() >= self.outputs * block,
            "block of activations"
        );
    }
}

/// `z[out, b] += W[out, in] x[in, b]`.
pub(super) fn add_forward(weight: &[f32], columns: Columns, x: &[f32], z: &mut [f32], block: usize) {
    columns.check(weight, block, x, z);
    let (b, row) = (block as isize, columns.row as isize);
    // SAFETY: `check` asserted that every index below the sizes given lies inside the slices; `z` is borrowed
    // exclusively.
    unsafe {
        let w = weight.as_ptr().add(columns.first);
        #[rustfmt::skip]
        gemm(block, columns.outputs, columns.count, z.as_mut_ptr(), b, 1, true, x.as_ptr(), b, 1, w, row, 1,
            1.0, 1.0, false, false, false, Parallelism::None);
    }
}

/// `v_x[in, b] (+)= W[out, in]ᵀ v_z[out, b]`.
pub(super) fn backward_inputs(weight: &[f32], columns: Columns, v_z: &[f32], v_x: &mut [f32], block: usize) {
    columns.check(weight, block, v_x, v_z);
    let (b, row) = (block as isize, columns.row as isize);
    // SAFETY: as above, with `v_x` borrowed exclusively.
    unsafe {
        let w = weight.as_ptr().add(columns.first);
        #[rustfmt::skip]
        gemm(block, columns.count, columns.outputs, v_x.as_mut_ptr(), b, 1, false, v_z.as_ptr(), b, 1, w, 1, row,
            0.0, 1.0, false, false, false, Parallelism::None);
    }
}

/// `v_W[out, in] += v_z[out, b] x[in, b]ᵀ`.
pub(super) fn add_backward_weight(
    v_weight: &mut [f32],
    columns: Columns,
    v_z: &[f32],
    x: &[f32],
    block: usize,
) {
    columns.check(v_weight, block, x, v_z);
    let (b, row) = (block as isize, columns.row as isize);
    // SAFETY: as above, with `v_weight` borrowed exclusively.
    unsafe {
        let w = v_weight.as_mut_ptr().add(columns.first);
        #[rustfmt::skip]
        gemm(columns.count, columns.outputs, block, w, row, 1, true, x.as_ptr(), 1, b, v_z.as_ptr(), b, 1,
            1.0, 1.0, false, false, false, Parallelism::None);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_match_triple_loops_on_a_column_range() {
        let (block, row, first, count, outputs) = (5, 7, 2, 3, 4);
        let columns = Columns { row, first, count, outputs };
        let value = |i: usize| ((i * 37 + 11) % 19) as f32 * 0.1 - 0.9;
        let weight: Vec<f32> = (0..row * outputs).map(value).collect();
        let x: Vec<f32> = (0..count * block).map(|i| value(i + 3)).collect();
        let v_z: Vec<f32> = (0..outputs * block).map(|i| value(i + 8)).collect();
        let (mut z, mut v_x, mut v_w) =
            (vec![1.0; outputs * block], vec![9.0; count * block], vec![0.5; row * outputs]);
        add_forward(&weight, columns, &x, &mut z, block);
        backward_inputs(&weight, columns, &v_z, &mut v_x, block);
        add_backward_weight(&mut v_w, columns, &v_z, &x, block);
        let w = |o: usize, i: usize| weight[o * row + first + i];
        for b in 0..block {
            for o in 0..outputs {
                let expected = 1.0 + (0..count).map(|i| w(o, i) * x[i * block + b]).sum::<f32>();
                assert!((z[o * block + b] - expected).abs() < 1e-5);
            }
            for i in 0..count {
                let expected = (0..outputs).map(|o| w(o, i) * v_z[o * block + b]).sum::<f32>();
                assert!((v_x[i * block + b] - expected).abs() < 1e-5);
            }
        }
        for o in 0..outputs {
            for i in 0..row {
                let inside = (first..first + count).contains(&i);
                let sum: f32 = (0..block)
                    .map(|b| v_z[o * block + b] * if inside { x[(i - first) * block + b] } else { 0.0 })
                    .sum();
                assert!((v_w[o * row + i] - 0.5 - sum).abs() < 1e-5);
            }
        }
    }
}
