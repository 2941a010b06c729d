//! Matrix products on slices whose results are used before they leave the registers: a tile of sums goes
//! through an [`Epilogue`] (a bias and an activation, a product with slopes, an addition) and is stored once.
//!
//! The right operand is read in vectors along its columns, the left one value by value. Every sum runs over
//! the depth in ascending order, so a result depends on the shapes alone, not on the width of vectors or
//! tiles. Columns are multiples of [`COLUMNS`]; callers pad with zeros.

use crate::packed::{COLUMNS, Right};
use pulp::{Arch, Simd, WithSimd};

/// Consumes a product, one vector of sums at a time.
pub(crate) trait Epilogue {
    /// Takes the sums whose first lane is at `(row, column)`.
    fn take<S: Simd>(&mut self, simd: S, row: usize, column: usize, sums: S::f32s);
}

/// The sums of `R` rows and `V` vectors.
pub(crate) type Tile<S, const R: usize, const V: usize> = [[<S as Simd>::f32s; V]; R];

/// A left operand by its layout in memory.
pub(crate) trait Left: Copy {
    /// `R` rows from `row` on times `V` vectors from `column` on of a panel `[depth, width]` of vectors.
    fn tile<S: Simd, const R: usize, const V: usize>(self, row: usize, panel: Panel<'_, S>) -> Tile<S, R, V>;
}

/// The part of a panel of the right operand that a tile reads.
#[derive(Clone, Copy)]
pub(crate) struct Panel<'a, S: Simd> {
    simd: S,
    /// `[depth, width]`.
    vectors: &'a [S::f32s],
    width: usize,
    column: usize,
}

/// A left operand `[rows, stride]`, of which the first columns are used, a multiple of [`COLUMNS`].
#[derive(Clone, Copy)]
pub(crate) struct Rows<'a>(pub(crate) &'a [f32], pub(crate) usize);

/// A left operand `[rows, stride]`, of which any number of first columns is used.
#[derive(Clone, Copy)]
pub(crate) struct UnpaddedRows<'a>(pub(crate) &'a [f32], pub(crate) usize);

/// A left operand that is stored transposed, `[depth, stride]`, of which the first columns are the rows.
#[derive(Clone, Copy)]
pub(crate) struct Columns<'a>(pub(crate) &'a [f32], pub(crate) usize);

/// Adds the product of one column of the left operand, `R` values, and one row of a panel, `V` vectors.
#[inline(always)]
fn add_products<S: Simd, const R: usize, const V: usize>(
    simd: S,
    a: impl Fn(usize) -> f32,
    b: &[S::f32s],
    sums: &mut Tile<S, R, V>,
) {
    for (r, sums) in sums.iter_mut().enumerate() {
        let a = simd.splat_f32s(a(r));
        for (b, sum) in b.iter().zip(sums) {
            *sum = simd.mul_add_f32s(a, *b, *sum);
        }
    }
}

impl Left for Rows<'_> {
    #[inline(always)]
    fn tile<S: Simd, const R: usize, const V: usize>(self, row: usize, panel: Panel<'_, S>) -> Tile<S, R, V> {
        let (simd, depth) = (panel.simd, panel.vectors.len() / panel.width);
        assert!(depth.is_multiple_of(COLUMNS), "depth {depth} of rows");
        // Pieces of fixed length need no bounds checks inside.
        let lines: [&[[f32; COLUMNS]]; R] =
            std::array::from_fn(|r| self.0[(row + r) * self.1..][..depth].as_chunks().0);
        let mut sums = [[simd.splat_f32s(0.0); V]; R];
        for (piece, vectors) in panel.vectors.chunks_exact(panel.width * COLUMNS).enumerate() {
            let a: [&[f32; COLUMNS]; R] = std::array::from_fn(|r| &lines[r][piece]);
            for (at, b) in (0..COLUMNS).zip(vectors.chunks_exact(panel.width)) {
                add_products(simd, |r| a[r][at], &b[panel.column..panel.column + V], &mut sums);
            }
        }
        sums
    }
}

impl Left for UnpaddedRows<'_> {
    #[inline(always)]
    fn tile<S: Simd, const R: usize, const V: usize>(self, row: usize, panel: Panel<'_, S>) -> Tile<S, R, V> {
        let (simd, depth) = (panel.simd, panel.vectors.len() / panel.width);
        let lines: [&[f32]; R] = std::array::from_fn(|r| &self.0[(row + r) * self.1..][..depth]);
        let mut sums = [[simd.splat_f32s(0.0); V]; R];
        for (at, b) in panel.vectors.chunks_exact(panel.width).enumerate() {
            add_products(simd, |r| lines[r][at], &b[panel.column..panel.column + V], &mut sums);
        }
        sums
    }
}

impl Left for Columns<'_> {
    #[inline(always)]
    fn tile<S: Simd, const R: usize, const V: usize>(self, row: usize, panel: Panel<'_, S>) -> Tile<S, R, V> {
        let simd = panel.simd;
        let mut sums = [[simd.splat_f32s(0.0); V]; R];
        for (a, b) in self.0.chunks_exact(self.1).zip(panel.vectors.chunks_exact(panel.width)) {
            let a = &a[row..row + R];
            add_products(simd, |r| a[r], &b[panel.column..panel.column + V], &mut sums);
        }
        sums
    }
}

/// `rows` rows of `left right`, handed to an epilogue.
pub(crate) struct Product<'a, L, E> {
    pub(crate) left: L,
    pub(crate) rows: usize,
    pub(crate) right: Right<'a>,
    pub(crate) epilogue: E,
}

impl<L: Left, E: Epilogue> Product<'_, L, E> {
    /// Computes the product.
    pub(crate) fn run(self) {
        Arch::new().dispatch(self);
    }

    /// `R` rows by `V` vectors.
    #[inline(always)]
    fn tile<S: Simd, const R: usize, const V: usize>(
        &mut self,
        row: usize,
        first: usize,
        panel: Panel<'_, S>,
    ) {
        let sums = self.left.tile::<S, R, V>(row, panel);
        for (r, sums) in sums.iter().enumerate() {
            for (v, &sums) in sums.iter().enumerate() {
                self.epilogue.take(panel.simd, row + r, first + (panel.column + v) * S::F32_LANES, sums);
            }
        }
    }

    /// All rows of the `V` vectors at a panel's column.
    #[inline(always)]
    fn tiles<S: Simd, const R: usize, const V: usize>(&mut self, first: usize, panel: Panel<'_, S>) {
        let mut row = 0;
        while row + R <= self.rows {
            self.tile::<S, R, V>(row, first, panel);
            row += R;
        }
        while row + 3 <= self.rows {
            self.tile::<S, 3, V>(row, first, panel);
            row += 3;
        }
        while row < self.rows {
            self.tile::<S, 1, V>(row, first, panel);
            row += 1;
        }
    }
}

impl<L: Left, E: Epilogue> WithSimd for Product<'_, L, E> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        for (first, width, panel) in self.right.panels() {
            let (vectors, width) = (S::as_simd_f32s(panel).0, width / S::F32_LANES);
            let mut column = 0;
            // 32 registers hold 24 sums of the widest vectors, 16 registers 12 of half the width, beside the
            // operands.
            while S::F32_LANES == COLUMNS && column + 4 <= width {
                self.tiles::<S, 6, 4>(first, Panel { simd, vectors, width, column });
                column += 4;
            }
            while column < width {
                match S::F32_LANES {
                    16 => self.tiles::<S, 8, 1>(first, Panel { simd, vectors, width, column }),
                    8 => self.tiles::<S, 6, 2>(first, Panel { simd, vectors, width, column }),
                    _ => self.tiles::<S, 4, 4>(first, Panel { simd, vectors, width, column }),
                }
                column += match S::F32_LANES {
                    16 => 1,
                    8 => 2,
                    _ => 4,
                };
            }
        }
    }
}

/// Replaces what is in a matrix `[rows, stride]`.
pub(crate) struct Set<'a>(pub(crate) &'a mut [f32], pub(crate) usize);

impl Epilogue for Set<'_> {
    #[inline(always)]
    fn take<S: Simd>(&mut self, _: S, row: usize, column: usize, sums: S::f32s) {
        *vector::<S>(self.0, row * self.1 + column) = sums;
    }
}

/// Adds to a matrix `[rows, stride]`.
pub(crate) struct Add<'a>(pub(crate) &'a mut [f32], pub(crate) usize);

impl Epilogue for Add<'_> {
    #[inline(always)]
    fn take<S: Simd>(&mut self, simd: S, row: usize, column: usize, sums: S::f32s) {
        let out = vector::<S>(self.0, row * self.1 + column);
        *out = simd.add_f32s(*out, sums);
    }
}

/// The vector of a matrix whose first lane is at `at`, a multiple of the lanes.
#[inline(always)]
pub(crate) fn vector<S: Simd>(values: &mut [f32], at: usize) -> &mut S::f32s {
    &mut S::as_mut_simd_f32s(values).0[at / S::F32_LANES]
}

/// As [`vector`], for reading.
#[inline(always)]
pub(crate) fn vector_at<S: Simd>(values: &[f32], at: usize) -> S::f32s {
    S::as_simd_f32s(values).0[at / S::F32_LANES]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::packed::{Packed, padded};
    use pulp::Scalar;

    fn numbers(count: usize, seed: f32) -> Vec<f32> {
        (0..count).map(|i| ((i as f32 * 0.37 + seed).sin() * 3.0).fract()).collect()
    }

    /// `a b` in double precision, `[m, width]`, of `a: [m, k]` and `b: [k, n]`.
    fn expected(a: &[f32], b: &[f32], [m, k, n]: [usize; 3]) -> Vec<f64> {
        let entry = |row: usize, column: usize| -> f64 {
            let term = |d: usize| f64::from(a[row * k + d]) * f64::from(b[d * n + column]);
            if column < n { (0..k).map(term).sum() } else { 0.0 }
        };
        let width = padded(n);
        (0..m * width).map(|at| entry(at / width, at % width)).collect()
    }

    fn check([m, k, n]: [usize; 3]) {
        let (a, b) = (numbers(m * k, 0.1), numbers(k * n, 0.7));
        let transposed: Vec<f32> = (0..k * m).map(|i| a[i % m * k + i / m]).collect();
        let packed = Packed::new(k, n, |depth, column| b[depth * n + column]);
        let (right, width) = (packed.right(), padded(n));
        let [mut by_rows, mut in_pieces, mut narrow] = [(); 3].map(|()| vec![0.0; m * width]);
        let mut added = vec![1.0; m * width];
        let columns = Columns(&transposed, m);
        Product { left: UnpaddedRows(&a, k), rows: m, right, epilogue: Set(&mut by_rows, width) }.run();
        if k.is_multiple_of(COLUMNS) {
            Product { left: Rows(&a, k), rows: m, right, epilogue: Set(&mut in_pieces, width) }.run();
            assert_eq!(in_pieces, by_rows, "{m} {k} {n}, by rows in pieces");
        }
        Product { left: columns, rows: m, right, epilogue: Add(&mut added, width) }.run();
        let one_lane = Product { left: columns, rows: m, right, epilogue: Set(&mut narrow, width) };
        Scalar.vectorize(one_lane);
        for (at, expected) in expected(&a, &b, [m, k, n]).into_iter().enumerate() {
            let close = |found: f32, offset: f64| (f64::from(found) - offset - expected).abs() < 1e-5;
            assert!(close(by_rows[at], 0.0), "{m} {k} {n}, by rows");
            assert!(close(added[at], 1.0), "{m} {k} {n}, by columns");
            assert!(close(narrow[at], 0.0), "{m} {k} {n}, one lane");
        }
    }

    #[test]
    fn products_of_any_shape_and_vector_width_are_right() {
        check([1, 1, 1]);
        check([4, 3, 64]);
        check([7, 5, 64]);
        check([9, 64, 37]);
        check([64, 16, 128]);
        check([3, 64, 96]);
        check([64, 128, 6]);
        check([10, 37, 64]);
    }

    #[test]
    fn a_plain_matrix_is_read_as_it_lies() {
        let (a, b) = (numbers(3 * 32, 0.2), numbers(32 * 96, 0.4));
        let mut out = vec![0.0; 3 * 96];
        let right = Right::plain(&b, 96);
        Product { left: Rows(&a, 32), rows: 3, right, epilogue: Set(&mut out, 96) }.run();
        let expected: f32 = (0..32).map(|d| a[32 + d] * b[d * 96 + 70]).sum();
        assert!((out[96 + 70] - expected).abs() < 1e-5);
    }
}
