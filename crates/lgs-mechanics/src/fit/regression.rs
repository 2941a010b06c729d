//! First values of linear parameters by regression in the weak form.
//!
//! Equation of motion and terms are averaged over overlapping bumps in time, so that the errors of single
//! accelerations of the smooth path cancel.

use super::Track;
use crate::Candidate;
use nalgebra::{DMatrix, DVector};

/// Bumps over the window: a few for each of the parameters that a law has.
const BUMPS: usize = 16;

/// Values of all parameters and the mean square of what the equation of motion leaves.
#[derive(Clone, Debug)]
pub struct Regression {
    /// Parameters of the candidate.
    pub parameters: Vec<f64>,
    /// Sum of squares left over the sum of squares of the forces.
    pub left: f64,
}

/// Weight of a sample in a bump: `cos²` over two spacings of the bumps.
fn weight(place: f64, bump: usize) -> f64 {
    let distance = (place * (BUMPS - 1) as f64 - bump as f64).abs();
    if distance < 1.0 { (0.5 * std::f64::consts::PI * distance).cos().powi(2) } else { 0.0 }
}

/// Fits all parameters that enter linearly; the others keep their values in `start`.
#[must_use]
pub fn regress(candidate: &Candidate, track: &Track, start: &[f64]) -> Option<Regression> {
    let n = candidate.coordinates.freedoms();
    let count = track.times.len();
    let mut rows = DMatrix::zeros(0, 0);
    let mut right = DVector::zeros(n * BUMPS);
    for (sample, (state, acceleration)) in track.smooth.iter().enumerate() {
        let design = candidate.design(start, state);
        let force = candidate.inertial_force(start, state, acceleration);
        if rows.is_empty() {
            rows = DMatrix::zeros(n * BUMPS, design.ncols());
        }
        for bump in 0..BUMPS {
            let weight = weight(sample as f64 / (count - 1).max(1) as f64, bump);
            if weight > 0.0 {
                let mut block = rows.rows_mut(n * bump, n);
                block += &design * weight;
                (0..n).for_each(|i| right[n * bump + i] += weight * force[i]);
            }
        }
    }
    let coefficients = solve(&rows, &right)?;
    let left = (&rows * &coefficients - &right).norm_squared() / right.norm_squared().max(f64::MIN_POSITIVE);
    let parameters = candidate.with_coefficients(start, coefficients.as_slice());
    parameters.iter().all(|p| p.is_finite()).then_some(Regression { parameters, left })
}

/// Least squares by the pseudoinverse, in columns of unit length.
fn solve(rows: &DMatrix<f64>, right: &DVector<f64>) -> Option<DVector<f64>> {
    if rows.ncols() == 0 {
        return Some(DVector::zeros(0));
    }
    let lengths: Vec<f64> = rows.column_iter().map(|c| c.norm().max(f64::MIN_POSITIVE)).collect();
    let mut scaled = rows.clone();
    lengths.iter().enumerate().for_each(|(i, length)| scaled.column_mut(i).unscale_mut(*length));
    // Directions a million times weaker than the strongest are noise of the smooth path.
    let mut found = scaled.svd(true, true).solve(right, 1e-6).ok()?;
    lengths.iter().enumerate().for_each(|(i, length)| found[i] /= length);
    Some(found)
}
