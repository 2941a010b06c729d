//! Levenberg–Marquardt with bounds, scales and a robust loss.

use crate::thresholds::{DIFFERENCE, LARGEST_DAMPING, LEAST_GAIN, SLOW_STEPS};
use nalgebra::{DMatrix, DVector};

/// An unknown of a problem.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unknown {
    /// A typical size of changes.
    pub scale: f64,
    /// Smallest allowed value.
    pub lower: f64,
    /// Largest allowed value.
    pub upper: f64,
}

impl Unknown {
    /// Values below and above one, and their distance: those of a central difference, or of a one-sided one
    /// at a bound, beyond which residuals may not change.
    fn around(&self, value: f64) -> ([f64; 2], f64) {
        let step = DIFFERENCE * self.scale;
        let [below, above] = [value - step, value + step];
        let is_fixed = self.upper - self.lower < step;
        if is_fixed || (below >= self.lower && above <= self.upper) {
            return ([below, above], 2.0 * step);
        }
        let [below, above] = [below, above].map(|value| value.clamp(self.lower, self.upper));
        ([below, above], above - below)
    }
}

/// Residuals that are to become small, in units of their noise.
pub trait Problem {
    /// The unknowns.
    fn unknowns(&self) -> &[Unknown];

    /// Residuals at values of the unknowns; `None` where they are not defined.
    fn residuals(&self, values: &[f64]) -> Option<DVector<f64>>;

    /// Residuals with their derivatives `[residuals, unknowns]`; by finite differences unless overridden.
    fn linearised(&self, values: &[f64]) -> Option<(DVector<f64>, DMatrix<f64>)> {
        let residuals = self.residuals(values)?;
        let jacobian = finite_differences(self, values, residuals.len())?;
        Some((residuals, jacobian))
    }
}

/// Derivatives of a problem's residuals by central differences, one-sided at bounds.
#[must_use]
pub fn finite_differences<P: Problem + ?Sized>(
    problem: &P,
    values: &[f64],
    rows: usize,
) -> Option<DMatrix<f64>> {
    let mut jacobian = DMatrix::zeros(rows, values.len());
    let mut moved = values.to_vec();
    for (column, unknown) in problem.unknowns().iter().enumerate() {
        let ([below, above], apart) = unknown.around(values[column]);
        moved[column] = above;
        let above = problem.residuals(&moved)?;
        moved[column] = below;
        let below = problem.residuals(&moved)?;
        moved[column] = values[column];
        jacobian.set_column(column, &((above - below) / apart));
    }
    Some(jacobian)
}

/// How a minimum is sought.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Most linearisations.
    pub iterations: usize,
    /// Residual in units of the noise beyond which the loss grows linearly (Huber); infinite for squares.
    pub threshold: f64,
    /// The search ends when a step lowers the loss by less than this, in units of χ², or when several steps
    /// after each other lower it by less than a ten-thousandth of itself.
    pub tolerance: f64,
    /// Loss above which a minimum is of no use: the search also ends when several steps after each other are
    /// so short that as many as are left would not lead below it; infinite where every minimum is of use.
    pub useful: f64,
}

impl Default for Settings {
    /// At 4 standard deviations Huber’s loss keeps all but one in 16 000 samples of normal noise as they are;
    /// a change of χ² by 0.001 is far below what a choice between laws can see.
    fn default() -> Self {
        Self { iterations: 40, threshold: 4.0, tolerance: 1e-3, useful: f64::INFINITY }
    }
}

/// A minimum of the loss.
#[derive(Clone, Debug)]
pub struct Minimum {
    /// Values of the unknowns.
    pub values: Vec<f64>,
    /// The loss: χ² where no residual is beyond the threshold.
    pub loss: f64,
    /// `JᵀWJ` at the minimum, whose inverse is the covariance of the values.
    pub information: DMatrix<f64>,
}

/// Huber's loss of all residuals, twice the usual one so that it equals χ² of small residuals.
fn loss_of(residuals: &DVector<f64>, threshold: f64) -> f64 {
    let one = |r: &f64| if r.abs() <= threshold { r * r } else { threshold * (2.0 * r.abs() - threshold) };
    residuals.iter().map(one).sum()
}

/// The normal equations in scaled unknowns: `JᵀWJ` and `JᵀWr`.
fn normal_equations(
    (residuals, jacobian): &(DVector<f64>, DMatrix<f64>),
    unknowns: &[Unknown],
    threshold: f64,
) -> (DMatrix<f64>, DVector<f64>) {
    let mut weighted = jacobian.clone();
    let mut right = residuals.clone();
    for (row, r) in residuals.iter().enumerate() {
        let root = if r.abs() > threshold { (threshold / r.abs()).sqrt() } else { 1.0 };
        weighted.row_mut(row).scale_mut(root);
        right[row] *= root;
    }
    for (column, unknown) in unknowns.iter().enumerate() {
        weighted.column_mut(column).scale_mut(unknown.scale);
    }
    (weighted.tr_mul(&weighted), weighted.tr_mul(&right))
}

/// Solves the damped equations for the unknowns that are not held at a bound.
fn step(matrix: &DMatrix<f64>, gradient: &DVector<f64>, damping: f64, held: &[bool]) -> Option<DVector<f64>> {
    let mut damped = matrix.clone();
    let mut right = -gradient;
    let largest = matrix.diagonal().max().max(f64::MIN_POSITIVE);
    for (i, &held) in held.iter().enumerate() {
        // A direction without any effect gets the smallest diagonal that the precision can tell from zero.
        damped[(i, i)] += damping * matrix[(i, i)].max(1e-12 * largest);
        if held {
            damped.row_mut(i).fill(0.0);
            damped.column_mut(i).fill(0.0);
            damped[(i, i)] = 1.0;
            right[i] = 0.0;
        }
    }
    damped.cholesky().map(|factor| factor.solve(&right))
}

/// Moves by a scaled step and keeps to the bounds.
fn moved(values: &[f64], step: &DVector<f64>, unknowns: &[Unknown]) -> Vec<f64> {
    let one = |((value, step), unknown): ((&f64, &f64), &Unknown)| {
        (value + step * unknown.scale).clamp(unknown.lower, unknown.upper)
    };
    values.iter().zip(step.iter()).zip(unknowns).map(one).collect()
}

/// Which unknowns lie at a bound against which the loss pushes them.
fn held(values: &[f64], gradient: &DVector<f64>, unknowns: &[Unknown]) -> Vec<bool> {
    let one = |((value, gradient), unknown): ((&f64, &f64), &Unknown)| {
        (*value <= unknown.lower && *gradient > 0.0) || (*value >= unknown.upper && *gradient < 0.0)
    };
    values.iter().zip(gradient.iter()).zip(unknowns).map(one).collect()
}

/// Finds a minimum of the loss from a start; `None` where the start itself is not defined.
#[must_use]
pub fn minimise(problem: &dyn Problem, start: &[f64], settings: &Settings) -> Option<Minimum> {
    let unknowns = problem.unknowns();
    let zero = DVector::zeros(start.len());
    let mut values = moved(start, &zero, unknowns);
    let mut linear = problem.linearised(&values)?;
    let mut loss = loss_of(&linear.0, settings.threshold);
    let (mut damping, mut slow) = (1e-3, 0);
    for left in (0..settings.iterations).rev() {
        let (matrix, gradient) = normal_equations(&linear, unknowns, settings.threshold);
        let held = held(&values, &gradient, unknowns);
        let mut next = None;
        while damping < LARGEST_DAMPING && next.is_none() {
            let tried = step(&matrix, &gradient, damping, &held).map(|s| moved(&values, &s, unknowns));
            let tried_loss = |v: &Vec<f64>| Some(loss_of(&problem.residuals(v)?, settings.threshold));
            next = tried.and_then(|v| tried_loss(&v).filter(|&l| l < loss).map(|l| (v, l)));
            damping *= if next.is_some() { 0.1 } else { 8.0 };
        }
        let Some((better, better_loss)) = next else { break };
        let gain = loss - better_loss;
        (values, loss) = (better, better_loss);
        linear = problem.linearised(&values)?;
        damping = damping.max(1e-12);
        let is_slow = gain < LEAST_GAIN * loss || gain * (left as f64) < loss - settings.useful;
        slow = if is_slow { slow + 1 } else { 0 };
        if gain < settings.tolerance || slow == SLOW_STEPS {
            break;
        }
    }
    let mut information = unscaled(normal_equations(&linear, unknowns, settings.threshold).0, unknowns);
    // What cannot change is not uncertain, and makes nothing else so.
    for (index, _) in unknowns.iter().enumerate().filter(|(_, unknown)| unknown.lower == unknown.upper) {
        information.row_mut(index).fill(0.0);
        information.column_mut(index).fill(0.0);
    }
    (loss.is_finite()).then_some(Minimum { values, loss, information })
}

/// A matrix of scaled unknowns in units of the unknowns.
fn unscaled(mut matrix: DMatrix<f64>, unknowns: &[Unknown]) -> DMatrix<f64> {
    for (i, unknown) in unknowns.iter().enumerate() {
        matrix.row_mut(i).unscale_mut(unknown.scale);
        matrix.column_mut(i).unscale_mut(unknown.scale);
    }
    matrix
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::Cell;

    /// A curved valley, and a residual of 20 that nothing lowers.
    struct Valley {
        unknowns: [Unknown; 2],
        linearised: Cell<usize>,
    }

    impl Problem for Valley {
        fn unknowns(&self) -> &[Unknown] {
            &self.unknowns
        }

        fn residuals(&self, values: &[f64]) -> Option<DVector<f64>> {
            let [x, y] = [values[0], values[1]];
            Some(DVector::from_vec(vec![10.0 * (y - x * x), 1.0 - x, 20.0]))
        }

        fn linearised(&self, values: &[f64]) -> Option<(DVector<f64>, DMatrix<f64>)> {
            self.linearised.set(self.linearised.get() + 1);
            let jacobian = DMatrix::from_row_slice(3, 2, &[-20.0 * values[0], 10.0, -1.0, 0.0, 0.0, 0.0]);
            Some((self.residuals(values)?, jacobian))
        }
    }

    #[test]
    fn a_search_ends_early_where_what_it_comes_to_is_of_no_use() {
        let steps = |useful: f64| {
            let unknowns = [Unknown { scale: 1.0, lower: -10.0, upper: 10.0 }; 2];
            let valley = Valley { unknowns, linearised: Cell::new(0) };
            let settings = Settings { threshold: f64::INFINITY, useful, ..Settings::default() };
            let minimum = minimise(&valley, &[-1.2, 1.0], &settings).expect("a minimum");
            (valley.linearised.get(), minimum.loss)
        };
        let [(all, least), (enough, within), (few, _)] = [f64::INFINITY, 401.0, 10.0].map(steps);
        assert!((least - 400.0).abs() < 0.1 && within == least && enough == all, "{all} {enough} {least}");
        assert!(few < all, "{few} of {all}");
    }
}
