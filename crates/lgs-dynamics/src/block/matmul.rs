//! Small matrix products on slices: tiles of 4 rows by 4 vectors (2 where there are 16 registers) held in registers.
//!
//! `out` and `b` are row-major with rows of equal length; `a` is row-major too and may be read transposed. Rows shorter than a vector, and what
//! a whole vector leaves over, go through a plain loop. Every sum runs over `k` in ascending order, so a result depends on the shapes alone.

use pulp::{Arch, Simd, WithSimd};

/// Rows of a tile.
const TILE_ROWS: usize = 4;

/// How `a` is read.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Read {
    /// `a` is `[m, k]`.
    Rows,
    /// `a` is `[k, m]`.
    Columns,
}

/// What becomes of the values that are in `out`.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Store {
    /// They are replaced.
    Set,
    /// The product is added to them.
    Add,
}

/// `out[m, n] (+)= a[m, k] b[k, n]` (or `aᵀ` with `a` of shape `[k, m]`).
pub(crate) struct Product<'a> {
    pub(crate) out: &'a mut [f32],
    pub(crate) a: &'a [f32],
    pub(crate) read: Read,
    pub(crate) b: &'a [f32],
    /// `[m, k, n]`.
    pub(crate) shape: [usize; 3],
    pub(crate) store: Store,
}

impl Product<'_> {
    /// Computes the product.
    pub(crate) fn run(self) {
        let [m, k, n] = self.shape;
        assert!(self.out.len() == m * n && self.a.len() == m * k && self.b.len() == k * n, "shape {:?}", self.shape);
        Arch::new().dispatch(self);
    }

    #[inline(always)]
    fn weight(&self, row: usize, depth: usize) -> f32 {
        let [m, k, _] = self.shape;
        match self.read {
            Read::Rows => self.a[row * k + depth],
            Read::Columns => self.a[depth * m + row],
        }
    }

    /// The rest of the columns of some rows, one value at a time.
    #[inline(always)]
    fn plain(&mut self, rows: std::ops::Range<usize>, columns: std::ops::Range<usize>) {
        let [_, k, n] = self.shape;
        for row in rows {
            for column in columns.clone() {
                let mut sum = 0.0;
                for depth in 0..k {
                    sum += self.weight(row, depth) * self.b[depth * n + column];
                }
                let out = &mut self.out[row * n + column];
                *out = if self.store == Store::Add { *out + sum } else { sum };
            }
        }
    }

    /// A tile of `R` rows and `V` vectors at `(row, vector)`.
    #[inline(always)]
    fn tile<S: Simd, const R: usize, const V: usize>(&mut self, simd: S, row: usize, vector: usize) {
        let [m, k, n] = self.shape;
        let first = vector * S::F32_LANES;
        let width = V * S::F32_LANES;
        let mut sums = [[simd.splat_f32s(0.0); V]; R];
        let a_rows: [&[f32]; R] = match self.read {
            Read::Rows => std::array::from_fn(|r| &self.a[(row + r) * k..(row + r + 1) * k]),
            Read::Columns => [self.a; R],
        };
        #[expect(clippy::needless_range_loop, reason = "one depth of several matrices")]
        for depth in 0..k {
            let (b, _) = S::as_simd_f32s(&self.b[depth * n + first..][..width]);
            let weights: [f32; R] = match self.read {
                Read::Rows => std::array::from_fn(|r| a_rows[r][depth]),
                Read::Columns => {
                    let a = &self.a[depth * m + row..][..R];
                    std::array::from_fn(|r| a[r])
                }
            };
            for r in 0..R {
                let weight = simd.splat_f32s(weights[r]);
                for v in 0..V {
                    sums[r][v] = simd.mul_add_f32s(weight, b[v], sums[r][v]);
                }
            }
        }
        for (r, sums) in sums.iter().enumerate() {
            let (out, _) = S::as_mut_simd_f32s(&mut self.out[(row + r) * n + first..][..width]);
            for (out, &sum) in out.iter_mut().zip(sums) {
                *out = if self.store == Store::Add { simd.add_f32s(*out, sum) } else { sum };
            }
        }
    }

    /// All rows of `V` vectors from `vector` on.
    #[inline(always)]
    fn columns<S: Simd, const V: usize>(&mut self, simd: S, vector: usize) {
        let m = self.shape[0];
        let tiled = m - m % TILE_ROWS;
        for row in (0..tiled).step_by(TILE_ROWS) {
            self.tile::<S, TILE_ROWS, V>(simd, row, vector);
        }
        for row in tiled..m {
            self.tile::<S, 1, V>(simd, row, vector);
        }
    }

    #[inline(always)]
    fn panels<S: Simd, const V: usize>(&mut self, simd: S) -> usize {
        let vectors = self.shape[2] / S::F32_LANES;
        let panelled = vectors - vectors % V;
        for vector in (0..panelled).step_by(V) {
            self.columns::<S, V>(simd, vector);
        }
        for vector in panelled..vectors {
            self.columns::<S, 1>(simd, vector);
        }
        vectors * S::F32_LANES
    }
}

impl WithSimd for Product<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        // 32 registers take 16 sums, 16 registers take 8 beside the operands.
        let done = if S::F32_LANES >= 16 { self.panels::<S, 4>(simd) } else { self.panels::<S, 2>(simd) };
        let [m, _, n] = self.shape;
        self.plain(0..m, done..n);
    }
}

/// `out[n, m] = a[m, n]ᵀ`.
pub(crate) fn transpose(a: &[f32], m: usize, n: usize, out: &mut [f32]) {
    const TILE: usize = 16;
    for row in (0..m).step_by(TILE) {
        for column in (0..n).step_by(TILE) {
            for r in row..(row + TILE).min(m) {
                for c in column..(column + TILE).min(n) {
                    out[c * m + r] = a[r * n + c];
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbers(count: usize, seed: f32) -> Vec<f32> {
        (0..count).map(|i| ((i as f32 * 0.37 + seed).sin() * 3.0).fract()).collect()
    }

    #[test]
    fn products_of_any_shape_are_right() {
        for [m, k, n] in [[1, 1, 1], [4, 3, 64], [7, 5, 64], [9, 64, 37], [32, 17, 128], [3, 64, 3]] {
            let (a, b) = (numbers(m * k, 0.1), numbers(k * n, 0.7));
            let mut a_columns = vec![0.0; m * k];
            transpose(&a, m, k, &mut a_columns);
            let mut out = vec![0.0; m * n];
            let mut other = vec![1.0; m * n];
            Product { out: &mut out, a: &a, read: Read::Rows, b: &b, shape: [m, k, n], store: Store::Set }.run();
            Product { out: &mut other, a: &a_columns, read: Read::Columns, b: &b, shape: [m, k, n], store: Store::Add }.run();
            for row in 0..m {
                for column in 0..n {
                    let expected: f64 = (0..k).map(|d| f64::from(a[row * k + d]) * f64::from(b[d * n + column])).sum();
                    assert!((f64::from(out[row * n + column]) - expected).abs() < 1e-5, "{m} {k} {n}");
                    assert!((f64::from(other[row * n + column]) - 1.0 - expected).abs() < 1e-5, "{m} {k} {n}, transposed");
                }
            }
        }
    }
}
