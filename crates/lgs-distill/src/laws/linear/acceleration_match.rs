//! Least squares of accelerations: the linear law that matches them best, as a start for fits by rollouts.

use super::law::Law;
use super::terms::{ALL_UNKNOWNS, Terms, design};
use crate::thresholds::ACCELERATION_RIDGE;
use glam::DVec3;
use lgs_core::geometry::solve_positive;
use nalgebra::{DMatrix, SMatrix, SVector};

/// Normal equations of the linear law with every term.
#[derive(Clone, Debug, Default)]
pub(crate) struct NormalEquations {
    gram: SMatrix<f64, ALL_UNKNOWNS, ALL_UNKNOWNS>,
    rhs: SVector<f64, ALL_UNKNOWNS>,
}

impl NormalEquations {
    /// Adds the equation of an acceleration at a state, positions from the law's centre.
    pub(crate) fn add(&mut self, q: DVec3, v: DVec3, acceleration: DVec3) {
        for (row, a) in design(q, v).into_iter().zip(acceleration.to_array()) {
            let row = SVector::from(row);
            self.rhs += row * a;
            self.gram += row * row.transpose();
        }
    }

    /// The law of some terms about a centre that matches accelerations best.
    pub(crate) fn solve(&self, terms: &Terms, center: DVec3) -> Law {
        let columns = terms.columns();
        let n = columns.len();
        let mut gram = DMatrix::from_fn(n, n, |i, j| {
            let pairs = columns[i].iter().flat_map(|&a| columns[j].iter().map(move |&b| (a, b)));
            pairs.map(|pair| self.gram[pair]).sum::<f64>()
        });
        for (i, places) in columns.iter().enumerate() {
            let shared = Terms::ridge_group(places[0]).map(|place| self.gram[(place, place)]);
            gram[(i, i)] += ACCELERATION_RIDGE * shared.fold(f64::MIN_POSITIVE, f64::max);
        }
        let rhs = DMatrix::from_fn(n, 1, |i, _| columns[i].iter().map(|&place| self.rhs[place]).sum::<f64>());
        let mut all = [0.0; ALL_UNKNOWNS];
        if let Some(found) = solve_positive(gram, &rhs) {
            for (places, &value) in columns.iter().zip(&found) {
                places.iter().for_each(|&place| all[place] = value);
            }
        }
        terms.law_of_fit(center, all)
    }
}
