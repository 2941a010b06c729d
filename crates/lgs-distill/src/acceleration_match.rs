//! Least squares of accelerations: the linear law that matches them best, as a start for fits by rollouts.

use crate::dense::{V3, solve_positive};
use crate::law::{Law, Stiffness, Terms, active_columns, full_design};

/// Ridge, as a part of a column's square.
const RIDGE: f64 = 1e-4;

/// Normal equations of the full linear law.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NormalEquations {
    gram: [[f64; 13]; 13],
    rhs: [f64; 13],
}

impl NormalEquations {
    pub(crate) const EMPTY: Self = Self { gram: [[0.0; 13]; 13], rhs: [0.0; 13] };

    /// Adds the equation of an acceleration at a state, positions from the law's centre.
    pub(crate) fn add(&mut self, q: V3, v: V3, acceleration: V3) {
        for (row, a) in full_design(q, v).iter().zip(acceleration) {
            for i in 0..13 {
                self.rhs[i] += row[i] * a;
                for j in 0..13 {
                    self.gram[i][j] += row[i] * row[j];
                }
            }
        }
    }

    /// The law of some terms about a centre that matches accelerations best.
    pub(crate) fn solve(&self, terms: &Terms, center: V3) -> Law {
        let columns = active_columns(terms);
        let n = columns.len();
        let pairs = |a: &[usize], b: &[usize]| {
            a.iter().flat_map(|&i| b.iter().map(move |&j| self.gram[i][j])).sum::<f64>()
        };
        let mut gram = vec![0.0; n * n];
        let mut rhs: Vec<f64> =
            columns.iter().map(|group| group.iter().map(|&c| self.rhs[c]).sum()).collect();
        for (i, a) in columns.iter().enumerate() {
            for (j, b) in columns.iter().enumerate() {
                gram[i * n + j] = pairs(a, b);
            }
        }
        // Stiffness along directions that are hardly visited is noise: all of them share the ridge of the
        // largest.
        let largest = (3..9).map(|c| self.gram[c][c]).fold(0.0, f64::max);
        for (i, group) in columns.iter().enumerate() {
            let visited = if (3..9).contains(&group[0]) { largest } else { gram[i * n + i] };
            gram[i * n + i] += RIDGE * visited + 1e-12;
        }
        let mut all = [0.0; 13];
        if solve_positive(&mut gram, &mut rhs, n, 1) {
            columns.iter().zip(&rhs).for_each(|(group, &v)| group.iter().for_each(|&c| all[c] = v));
        }
        all[9] = all[9].max(0.0);
        let full = Terms { gravity: true, stiffness: Stiffness::Full, damping: true, gyration: true };
        let law = Law::with_unknowns(center, &full, &all);
        Law::with_unknowns(center, terms, &law.unknowns(terms))
    }
}
