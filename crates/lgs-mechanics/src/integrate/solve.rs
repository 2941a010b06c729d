//! Small vectors and linear systems inside of a step.

use super::stepper::{NoSolution, Solved};
use crate::terms::Block;

/// Solves `(I − s A) u = r` for a square `A` and all columns of `r` (`[n, columns]`, row by row), in place,
/// with the memory of a matrix.
pub(crate) fn shifted(a: &Block, s: f64, matrix: &mut Block, r: &mut [f64]) -> Solved {
    let n = a.columns();
    matrix.reset(n, n);
    for i in 0..n {
        for j in 0..n {
            matrix[(i, j)] = f64::from(u8::from(i == j)) - s * a[(i, j)];
        }
    }
    in_place(matrix, n, r)
}

/// Solves `A u = r` for all columns of `r` by elimination with row exchange, in place; `A` is overwritten.
pub(crate) fn in_place(a: &mut Block, n: usize, r: &mut [f64]) -> Solved {
    let columns = r.len() / n.max(1);
    for pivot in 0..n {
        let best = (pivot..n)
            .fold(pivot, |best, i| if a[(i, pivot)].abs() > a[(best, pivot)].abs() { i } else { best });
        let size = a[(best, pivot)].abs();
        if size.is_nan() || size < f64::MIN_POSITIVE {
            return Err(NoSolution);
        }
        if best != pivot {
            swap_rows(a.values_mut(), n, [pivot, best]);
            swap_rows(r, columns, [pivot, best]);
        }
        for i in pivot + 1..n {
            let factor = a[(i, pivot)] / a[(pivot, pivot)];
            subtract_row(a.values_mut(), n, [i, pivot], factor);
            subtract_row(r, columns, [i, pivot], factor);
        }
    }
    for i in (0..n).rev() {
        (i + 1..n).for_each(|k| subtract_row(r, columns, [i, k], a[(i, k)]));
        let own = a[(i, i)];
        r[i * columns..(i + 1) * columns].iter_mut().for_each(|value| *value /= own);
    }
    Ok(())
}

/// Exchanges two rows, the first of them before the second.
fn swap_rows(rows: &mut [f64], columns: usize, [first, second]: [usize; 2]) {
    let (before, after) = rows.split_at_mut(second * columns);
    before[first * columns..(first + 1) * columns].swap_with_slice(&mut after[..columns]);
}

/// Subtracts a multiple of another row from a row.
fn subtract_row(rows: &mut [f64], columns: usize, [row, other]: [usize; 2], factor: f64) {
    let (before, after) = rows.split_at_mut(row.max(other) * columns);
    let (own, other) = match row > other {
        true => (&mut after[..columns], &before[other * columns..(other + 1) * columns]),
        false => (&mut before[row * columns..(row + 1) * columns], &after[..columns]),
    };
    add_scaled(own, other, -factor);
}

/// `to += s from`.
pub(super) fn add_scaled(to: &mut [f64], from: &[f64], s: f64) {
    if s != 0.0 {
        to.iter_mut().zip(from).for_each(|(to, from)| *to += s * from);
    }
}

/// Largest absolute entry.
pub(super) fn norm(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |most: f64, value| most.max(value.abs()))
}

/// Refuses numbers that are not finite.
pub(super) fn finite(values: &[f64]) -> Solved {
    if values.iter().all(|value| value.is_finite()) { Ok(()) } else { Err(NoSolution) }
}
