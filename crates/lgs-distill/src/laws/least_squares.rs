//! Levenberg–Marquardt for a dozen or two unknowns, with derivatives by forward differences.

use crate::thresholds::{CONVERGED, DIFFERENCE, FIRST_DAMPING, ITERATIONS, SMALLEST_UNKNOWN, TRIALS};
use lgs_core::geometry::solve_positive;
use nalgebra::{DMatrix, DVector};

/// Unknowns where a descent stops, and the sum of squares there.
pub(crate) struct Minimum {
    pub(crate) unknowns: Vec<f64>,
    pub(crate) cost: f64,
}

/// Minimises the sum of squares of `residual` over the unknowns from `fixed` on; those before stay.
pub(crate) fn minimise(
    mut unknowns: Vec<f64>,
    fixed: usize,
    residual: impl Fn(&[f64]) -> Vec<f64>,
) -> Minimum {
    let mut current = DVector::from(residual(&unknowns));
    let mut cost = sum_of_squares(&current);
    let mut damping = FIRST_DAMPING;
    for _ in 0..ITERATIONS {
        let jacobian = jacobian(&unknowns, fixed, &current, &residual);
        let mut improved = false;
        for _ in 0..TRIALS {
            if let Some(step) = damped_step(&jacobian, &current, damping) {
                let mut trial = unknowns.clone();
                trial[fixed..].iter_mut().zip(&step).for_each(|(p, s)| *p -= s);
                let at_trial = DVector::from(residual(&trial));
                let trial_cost = sum_of_squares(&at_trial);
                if trial_cost < cost {
                    improved = cost - trial_cost > CONVERGED * cost;
                    (unknowns, current, cost) = (trial, at_trial, trial_cost);
                    damping = (0.1 * damping).max(1e-12);
                    break;
                }
            }
            damping *= 10.0;
        }
        if !improved {
            break;
        }
    }
    Minimum { unknowns, cost }
}

/// Forward differences of the residual, one column per unknown from `fixed` on.
fn jacobian(
    unknowns: &[f64],
    fixed: usize,
    current: &DVector<f64>,
    residual: &impl Fn(&[f64]) -> Vec<f64>,
) -> DMatrix<f64> {
    let mut shifted = unknowns.to_vec();
    let columns: Vec<DVector<f64>> = (fixed..unknowns.len())
        .map(|i| {
            let step = DIFFERENCE * unknowns[i].abs().max(SMALLEST_UNKNOWN);
            shifted[i] = unknowns[i] + step;
            let moved = DVector::from(residual(&shifted));
            shifted[i] = unknowns[i];
            (moved - current) / step
        })
        .collect();
    DMatrix::from_columns(&columns)
}

/// The Marquardt step: `(JᵀJ + λ diag) step = Jᵀ r`.
fn damped_step(jacobian: &DMatrix<f64>, residual: &DVector<f64>, damping: f64) -> Option<DVector<f64>> {
    let mut gram = jacobian.tr_mul(jacobian);
    let diagonal = gram.diagonal();
    // An unknown that nothing depends on gets a pivot of its own.
    let least = 1e-15 * diagonal.max() + f64::MIN_POSITIVE;
    gram.set_diagonal(&diagonal.map(|entry| entry * (1.0 + damping) + least));
    let rhs = DMatrix::from_columns(&[jacobian.tr_mul(residual)]);
    let step = solve_positive(gram, &rhs)?.column(0).into_owned();
    step.iter().all(|s| s.is_finite()).then_some(step)
}

/// Sum of squares, infinite if anything is not finite.
fn sum_of_squares(values: &DVector<f64>) -> f64 {
    let sum = values.norm_squared();
    if sum.is_finite() { sum } else { f64::INFINITY }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_curved_valley_is_followed_to_its_end_and_fixed_unknowns_stay() {
        let residual = |p: &[f64]| vec![10.0 * (p[1] - p[0] * p[0]), 1.0 - p[0], p[2]];
        let found = minimise(vec![-1.2, 1.0, 0.0], 0, residual);
        assert!(found.cost < 1e-20 && (found.unknowns[0] - 1.0).abs() < 1e-9, "{:?}", found.unknowns);
        let found = minimise(vec![0.5, 1.0, 2.0], 1, residual);
        assert!(found.unknowns[0] == 0.5 && (found.unknowns[1] - 0.25).abs() < 1e-9, "{:?}", found.unknowns);
    }
}
