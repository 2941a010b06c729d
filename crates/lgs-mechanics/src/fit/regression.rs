//! First values of linear parameters by regression in the weak form.
//!
//! Equation of motion and terms are averaged over bumps in time, so that the errors of single accelerations
//! of the smooth path cancel. Bumps and their slopes vanish at their ends, which all lie inside the window:
//! the accelerations at the window's own ends, the least certain ones, have no weight.

use super::track::Track;
use crate::candidate::Candidate;
use crate::thresholds::HALF_WIDTHS;
use nalgebra::{DMatrix, DVector};

/// Values of all parameters and what the equation of motion leaves.
#[derive(Clone, Debug)]
pub struct Regression {
    /// Parameters of the candidate.
    pub parameters: Vec<f64>,
    /// Sum of squares left over the sum of squares of the forces.
    pub left: f64,
    /// What is left in each row, over the root of the sum of squares of the forces.
    pub residuals: DVector<f64>,
}

/// A weight over the window, `cos²` around a centre.
struct Bump {
    centre: f64,
    half: f64,
}

impl Bump {
    /// Bumps of all widths, each by half of its half width beside the last.
    fn all() -> Vec<Self> {
        let of_width = |half: f64| {
            let count = ((1.0 - 2.0 * half) / (0.5 * half)).round() as usize + 1;
            (0..count).map(move |k| Self { centre: half + 0.5 * half * k as f64, half })
        };
        HALF_WIDTHS.into_iter().flat_map(of_width).collect()
    }

    /// Weight of a place in the window, 0 to 1. Integrating by parts, a bump multiplies positions by its
    /// second derivative, whose norm and therefore the row's noise goes as the half width to the power −3/2.
    fn weight(&self, place: f64) -> f64 {
        let distance = (place - self.centre).abs() / self.half;
        let certainty = self.half.powf(1.5);
        if distance < 1.0 { certainty * (0.5 * std::f64::consts::PI * distance).cos().powi(2) } else { 0.0 }
    }
}

/// Fits all parameters that enter linearly; the others keep their values in `start`.
#[must_use]
pub fn regress(candidate: &Candidate, track: &Track, start: &[f64]) -> Option<Regression> {
    let n = candidate.coordinates.freedoms();
    let bumps = Bump::all();
    let (first, last) = (*track.times.first()?, *track.times.last()?);
    let design = candidate.design();
    let mut rows = DMatrix::<f64>::zeros(n * bumps.len(), design.columns());
    let mut right = DVector::zeros(n * bumps.len());
    for (time, (state, acceleration)) in track.times.iter().zip(&track.smooth) {
        let columns = design.at(start, state);
        let force = candidate.inertial_force(start, state, acceleration);
        for (bump, weight) in bumps.iter().map(|b| b.weight((time - first) / (last - first))).enumerate() {
            if weight > 0.0 {
                for (to, from) in rows.rows_mut(n * bump, n).iter_mut().zip(columns.iter()) {
                    *to += weight * from;
                }
                (0..n).for_each(|i| right[n * bump + i] += weight * force[i]);
            }
        }
    }
    let coefficients = solve(&rows, &right)?;
    let residuals = (&rows * &coefficients - &right) / right.norm().max(f64::MIN_POSITIVE);
    let left = residuals.norm_squared();
    let parameters = candidate.with_coefficients(start, coefficients.as_slice());
    parameters.iter().all(|p| p.is_finite()).then_some(Regression { parameters, left, residuals })
}

/// Least squares by the pseudoinverse, in columns of unit length; `None` if they are not finite.
fn solve(rows: &DMatrix<f64>, right: &DVector<f64>) -> Option<DVector<f64>> {
    if rows.ncols() == 0 {
        return Some(DVector::zeros(0));
    }
    let lengths: Vec<f64> = rows.column_iter().map(|c| c.norm().max(f64::MIN_POSITIVE)).collect();
    let mut scaled = rows.clone();
    lengths.iter().enumerate().for_each(|(i, length)| scaled.column_mut(i).unscale_mut(*length));
    // Singular values of what is not finite are sought without end.
    if !scaled.iter().all(|value| value.is_finite()) {
        return None;
    }
    // Directions a million times weaker than the strongest are noise of the smooth path.
    let mut found = scaled.svd(true, true).solve(right, 1e-6).ok()?;
    lengths.iter().enumerate().for_each(|(i, length)| found[i] /= length);
    Some(found)
}
