//! Chebyshev least squares on uniform samples, with analytic derivatives and the degree chosen by generalised
//! cross validation.
//!
//! Every channel of a curve (a coordinate, an entry of a pose) shares the basis, so one factorisation serves
//! all of them. Low degrees are preferred: the smallest whose score is within a few per cent of the best one,
//! since derivatives amplify what the extra degrees fit.

use crate::thresholds::SCORE_SLACK;
use lgs_core::geometry::solve_positive;
use nalgebra::DMatrix;

/// A curve `[0, 1]·span → R^channels` as Chebyshev coefficients.
#[derive(Clone, Debug)]
pub(crate) struct Curve {
    start: f64,
    end: f64,
    channels: usize,
    /// `[degree + 1, channels]`.
    coefficients: Vec<f64>,
}

/// Which derivative of a curve.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Order {
    /// The value.
    Value,
    /// The first derivative by time.
    First,
    /// The second derivative by time.
    Second,
}

impl Curve {
    /// Least squares fit of `values` (`[samples, channels]`) at `times`.
    pub(crate) fn fit(times: &[f64], values: &[f64], channels: usize, degree: usize) -> Self {
        let (start, end) = (times[0], times[times.len() - 1]);
        let n = degree.min(times.len() - 1) + 1;
        let basis: Vec<Vec<f64>> = times.iter().map(|&t| basis_at(unit(start, end, t), n)).collect();
        let design = DMatrix::from_fn(times.len(), n, |sample, i| basis[sample][i]);
        let values = DMatrix::from_row_slice(times.len(), channels, values);
        // The rounding of the sums.
        let ridge = DMatrix::identity(n, n) * (f64::EPSILON * (n * times.len()) as f64);
        let solution = solve_positive(design.tr_mul(&design) + ridge, &design.tr_mul(&values));
        // Row by row: the transpose of a matrix that lies column by column.
        let coefficients =
            solution.map_or_else(|| vec![0.0; n * channels], |found| found.transpose().as_slice().to_vec());
        Self { start, end, channels, coefficients }
    }

    /// The fit whose degree in `degrees` has the smallest generalised cross-validation score (within 3 %, the
    /// lowest); also its degree.
    ///
    /// `emphasis` scales each channel's residual, for channels of different units.
    pub(crate) fn fit_by_cross_validation(
        times: &[f64],
        values: &[f64],
        emphasis: &[f64],
        degrees: std::ops::RangeInclusive<usize>,
    ) -> (Self, usize) {
        let channels = emphasis.len();
        let highest = (*degrees.end()).min(times.len().saturating_sub(2).max(1));
        let lowest = (*degrees.start()).min(highest);
        let fits: Vec<(Self, f64)> = (lowest..=highest)
            .map(|degree| {
                let fit = Self::fit(times, values, channels, degree);
                let freedom = 1.0 - (degree + 1) as f64 / times.len() as f64;
                let score = fit.squared_residual(times, values, emphasis) / (freedom * freedom);
                (fit, score)
            })
            .collect();
        let best = fits.iter().map(|(_, score)| *score).fold(f64::INFINITY, f64::min);
        // Noise-free curves: f32 rounding of the values is as good as a residual gets.
        let magnitude: f64 = values
            .chunks_exact(channels)
            .flat_map(|r| r.iter().zip(emphasis).map(|(v, e)| (v * e).powi(2)))
            .sum();
        let floor = f64::from(f32::EPSILON).powi(2) * magnitude;
        for (offset, (fit, score)) in fits.into_iter().enumerate() {
            if score <= SCORE_SLACK * best + floor {
                return (fit, lowest + offset);
            }
        }
        (Self::fit(times, values, channels, highest), highest)
    }

    /// The curve or a derivative at a time, also outside of the fitted interval.
    pub(crate) fn at(&self, time: f64, order: Order) -> Vec<f64> {
        let n = self.coefficients.len() / self.channels;
        let u = unit(self.start, self.end, time);
        let speed = 2.0 / (self.end - self.start);
        let basis = match order {
            Order::Value => basis_at(u, n),
            Order::First => derivative_basis_at(u, n).0.into_iter().map(|b| b * speed).collect(),
            Order::Second => derivative_basis_at(u, n).1.into_iter().map(|b| b * speed * speed).collect(),
        };
        let mut out = vec![0.0; self.channels];
        for (b, row) in basis.iter().zip(self.coefficients.chunks_exact(self.channels)) {
            for (o, c) in out.iter_mut().zip(row) {
                *o += b * c;
            }
        }
        out
    }

    /// Sum over samples and channels of the squared, emphasised residual.
    pub(crate) fn squared_residual(&self, times: &[f64], values: &[f64], emphasis: &[f64]) -> f64 {
        let mut sum = 0.0;
        for (&t, row) in times.iter().zip(values.chunks_exact(self.channels)) {
            for ((f, v), e) in self.at(t, Order::Value).iter().zip(row).zip(emphasis) {
                sum += ((f - v) * e).powi(2);
            }
        }
        sum
    }
}

/// Time mapped to [−1, 1].
fn unit(start: f64, end: f64, t: f64) -> f64 {
    (2.0 * t - start - end) / (end - start)
}

/// `T_0 … T_{n−1}` at `u`.
fn basis_at(u: f64, n: usize) -> Vec<f64> {
    let mut basis = vec![1.0; n];
    for i in 1..n {
        basis[i] = if i == 1 { u } else { 2.0 * u * basis[i - 1] - basis[i - 2] };
    }
    basis
}

/// First and second derivatives of `T_0 … T_{n−1}` by `u`, from the differentiated recurrence.
fn derivative_basis_at(u: f64, n: usize) -> (Vec<f64>, Vec<f64>) {
    let basis = basis_at(u, n);
    let (mut first, mut second) = (vec![0.0; n], vec![0.0; n]);
    for i in 1..n {
        if i == 1 {
            first[1] = 1.0;
        } else {
            first[i] = 2.0 * basis[i - 1] + 2.0 * u * first[i - 1] - first[i - 2];
            second[i] = 4.0 * first[i - 1] + 2.0 * u * second[i - 1] - second[i - 2];
        }
    }
    (first, second)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_polynomial_and_its_derivatives_are_recovered_and_its_degree_found() {
        let times: Vec<f64> = (0..76).map(|i| 0.01 * f64::from(i)).collect();
        let values: Vec<f64> = times.iter().flat_map(|t| [1.0 + 2.0 * t - 3.0 * t * t, t * t * t]).collect();
        let (curve, degree) = Curve::fit_by_cross_validation(&times, &values, &[1.0, 1.0], 1..=9);
        assert_eq!(degree, 3);
        for t in [-0.01, 0.3, 0.8] {
            let (value, first, second) =
                (curve.at(t, Order::Value), curve.at(t, Order::First), curve.at(t, Order::Second));
            assert!((value[0] - (1.0 + 2.0 * t - 3.0 * t * t)).abs() < 1e-9);
            assert!((first[0] - (2.0 - 6.0 * t)).abs() < 1e-8);
            assert!((second[1] - 6.0 * t).abs() < 1e-7);
        }
    }
}
