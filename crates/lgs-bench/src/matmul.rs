//! Panels for the rate of matrix products.
#![expect(
    unsafe_code,
    reason = "the gemm crate takes raw pointers; the arrays' lengths are those of the shape"
)]

use crate::plain::Plain;
use gemm::{Parallelism, gemm};

/// Rows, depth and columns: a block of 256 particles through a layer of the paper's networks.
const SHAPE: [usize; 3] = [256, 128, 128];

/// The operands of one product, about 320 KiB.
pub struct Panels {
    out: Vec<f32>,
    a: Vec<f32>,
    b: Vec<f32>,
}

impl Plain for Panels {
    /// Multiplications and additions of one product.
    const WORK: f64 = 2.0 * (SHAPE[0] * SHAPE[1] * SHAPE[2]) as f64;

    fn new() -> Self {
        let [m, k, n] = SHAPE;
        let numbers =
            |len: usize| (0..len).map(|i| ((i * 37) % 101) as f32 / 101.0 - 0.5).collect::<Vec<_>>();
        Self { out: vec![0.0; m * n], a: numbers(m * k), b: numbers(k * n) }
    }

    /// `out = a b`, all column-major, which the library prefers.
    fn round(&mut self) {
        let [m, k, n] = SHAPE;
        let (rows, depth) = (m as isize, k as isize);
        // SAFETY: the arrays hold m·n, m·k and k·n values, which the strides given stay inside; `out` is
        // borrowed exclusively.
        unsafe {
            #[rustfmt::skip]
            gemm(m, n, k, self.out.as_mut_ptr(), rows, 1, false, self.a.as_ptr(), rows, 1,
                self.b.as_ptr(), depth, 1, 0.0, 1.0, false, false, false, Parallelism::None);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_product_is_one() {
        let mut panels = Panels::new();
        panels.round();
        let [m, k, _] = SHAPE;
        let expected: f32 = (0..k).map(|d| panels.a[d * m + 3] * panels.b[5 * k + d]).sum();
        assert!((panels.out[5 * m + 3] - expected).abs() < 1e-4);
    }
}
