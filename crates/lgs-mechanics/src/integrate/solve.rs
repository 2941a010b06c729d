//! Small vectors and linear systems inside of a step.

use super::stepper::{NoSolution, Solved};
use crate::terms::Block;

/// A square matrix, eliminated with row exchange, for solving with several right-hand sides.
#[derive(Debug, Default)]
pub(crate) struct Eliminated {
    /// Above the diagonal and on it what elimination leaves, below it the factors of the rows above.
    rows: Block,
    /// The row that each pivot was exchanged with.
    exchanged: Vec<usize>,
}

impl Eliminated {
    /// Takes `I − s A` for a square `A`, in the memory of the one before.
    pub(crate) fn shifted(&mut self, a: &Block, s: f64) -> Solved {
        let n = a.columns();
        self.rows.reset(n, n);
        for i in 0..n {
            for j in 0..n {
                self.rows[(i, j)] = f64::from(u8::from(i == j)) - s * a[(i, j)];
            }
        }
        self.eliminate(n)
    }

    fn eliminate(&mut self, n: usize) -> Solved {
        let a = &mut self.rows;
        self.exchanged.clear();
        for pivot in 0..n {
            let best = (pivot..n)
                .fold(pivot, |best, i| if a[(i, pivot)].abs() > a[(best, pivot)].abs() { i } else { best });
            let size = a[(best, pivot)].abs();
            if size.is_nan() || size < f64::MIN_POSITIVE {
                return Err(NoSolution);
            }
            self.exchanged.push(best);
            if best != pivot {
                swap_rows(a.values_mut(), n, [pivot, best]);
            }
            for i in pivot + 1..n {
                let factor = a[(i, pivot)] / a[(pivot, pivot)];
                (pivot + 1..n).for_each(|j| a[(i, j)] += -factor * a[(pivot, j)]);
                a[(i, pivot)] = factor;
            }
        }
        Ok(())
    }

    /// Solves for all columns of `r` (`[n, columns]`, row by row), in place.
    pub(crate) fn solve(&self, r: &mut [f64]) {
        let (a, n) = (&self.rows, self.exchanged.len());
        let columns = r.len() / n.max(1);
        // Rows below a pivot are exchanged with their factors.
        for (pivot, &best) in self.exchanged.iter().enumerate() {
            if best != pivot {
                swap_rows(r, columns, [pivot, best]);
            }
        }
        for i in 1..n {
            (0..i).for_each(|pivot| subtract_row(r, columns, [i, pivot], a[(i, pivot)]));
        }
        for i in (0..n).rev() {
            (i + 1..n).for_each(|k| subtract_row(r, columns, [i, k], a[(i, k)]));
            let own = a[(i, i)];
            r[i * columns..(i + 1) * columns].iter_mut().for_each(|value| *value /= own);
        }
    }
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
