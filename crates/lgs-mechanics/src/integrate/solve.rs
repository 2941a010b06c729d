//! Small vectors and linear systems inside of a step.

use super::stepper::{NoSolution, Solved};
use crate::terms::Block;

/// Solves `(I − s A) u = r` for a square `A` and all columns of `r` (`[n, columns]`, row by row), in place, with
/// the memory of a matrix.
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
            (0..n).for_each(|j| {
                let kept = a[(pivot, j)];
                a[(pivot, j)] = a[(best, j)];
                a[(best, j)] = kept;
            });
            (0..columns).for_each(|j| r.swap(pivot * columns + j, best * columns + j));
        }
        for i in pivot + 1..n {
            let factor = a[(i, pivot)] / a[(pivot, pivot)];
            if factor != 0.0 {
                (pivot..n).for_each(|j| a[(i, j)] -= factor * a[(pivot, j)]);
                (0..columns).for_each(|j| r[i * columns + j] -= factor * r[pivot * columns + j]);
            }
        }
    }
    for i in (0..n).rev() {
        for j in 0..columns {
            let known: f64 = (i + 1..n).map(|k| a[(i, k)] * r[k * columns + j]).sum();
            r[i * columns + j] = (r[i * columns + j] - known) / a[(i, i)];
        }
    }
    Ok(())
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
