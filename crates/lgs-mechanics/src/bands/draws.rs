//! Draws of start and parameters from the posterior of one fit.

use crate::coordinates::State;
use crate::fit::Fitted;
use crate::law::Law;
use crate::thresholds::REDRAWS;
use lgs_core::{Stream, stream};
use nalgebra::{DMatrix, DVector};
use rand_distr::{Distribution, StandardNormal, StandardUniform};

/// A normal distribution around zero.
pub(super) struct Normal {
    /// A root of the covariance.
    root: DMatrix<f64>,
}

impl Normal {
    pub(super) fn new(covariance: &DMatrix<f64>) -> Self {
        let deviations = covariance.diagonal().map(|d| d.max(f64::MIN_POSITIVE).sqrt());
        let size = deviations.len();
        let part = |i, j| covariance[(i, j)] / (deviations[i] * deviations[j]);
        let eigen = DMatrix::from_fn(size, size, part).symmetric_eigen();
        let mut root = eigen.eigenvectors;
        for (i, value) in eigen.eigenvalues.iter().enumerate() {
            root.column_mut(i).scale_mut(value.max(0.0).sqrt());
        }
        // What has no deviation does not change, by no rounding either.
        let certain = |i: usize| covariance[(i, i)] <= 0.0;
        let rows = deviations.iter().enumerate();
        rows.for_each(|(i, own)| root.row_mut(i).scale_mut(if certain(i) { 0.0 } else { *own }));
        Self { root }
    }

    fn draw(&self, stream: &mut Stream) -> DVector<f64> {
        self.draw_with_square(stream).0
    }

    /// A draw, and its square in the metric of the distribution.
    fn draw_with_square(&self, stream: &mut Stream) -> (DVector<f64>, f64) {
        let drawn = DVector::from_fn(self.root.ncols(), |_, _| StandardNormal.sample(stream));
        (&self.root * &drawn, drawn.norm_squared())
    }

    /// A draw, made again while it is not allowed; the last one in the end.
    fn allowed(&self, stream: &mut Stream, is_allowed: &dyn Fn(&[f64]) -> bool) -> DVector<f64> {
        let mut change = self.draw(stream);
        for _ in 0..REDRAWS {
            if is_allowed(change.as_slice()) {
                break;
            }
            change = self.draw(stream);
        }
        change
    }

    /// A draw that was accepted, by its probability; the most probable of those tried in the end.
    fn accepted(&self, streams: &mut [Stream; 2], probability: &Probability<'_>) -> DVector<f64> {
        let [draws, acceptance] = streams;
        let mut best = (DVector::zeros(self.root.nrows()), -1.0);
        for _ in 0..=REDRAWS {
            let (change, square) = self.draw_with_square(draws);
            let own = probability(change.as_slice(), square);
            if own >= StandardUniform.sample(acceptance) {
                return change;
            }
            if own > best.1 {
                best = (change, own);
            }
        }
        best.0
    }
}

/// The probability by which a change is accepted, given the change and its square in the metric of the
/// distribution that it was drawn from.
pub type Probability<'a> = dyn Fn(&[f64], f64) -> f64 + 'a;

/// Draws of changes from a normal distribution around zero, each accepted by its probability or drawn again,
/// as often as is worth it; `index` is that of the law among its rivals.
#[must_use]
pub fn changes(
    covariance: &DMatrix<f64>,
    count: usize,
    (seed, index): (u64, u64),
    probability: &Probability<'_>,
) -> Vec<Vec<f64>> {
    let normal = Normal::new(covariance);
    let names = ["posterior of a law", "acceptance of draws"];
    let mut streams = names.map(|name| stream(seed, name, index));
    (0..count).map(|_| normal.accepted(&mut streams, probability).as_slice().to_vec()).collect()
}

/// A source of draws.
pub(super) struct Draws<'a> {
    fitted: &'a Fitted,
    normal: Normal,
    stream: Stream,
}

impl<'a> Draws<'a> {
    pub(super) fn new(fitted: &'a Fitted, seed: u64, index: u64) -> Self {
        let normal = Normal::new(&fitted.covariance);
        Self { fitted, normal, stream: stream(seed, "posterior of a law", index) }
    }

    /// A law and a start. Parameters keep to the bounds of the fit: draws beyond them are drawn again.
    pub(super) fn next(&mut self) -> (Law, State) {
        let fitted = self.fitted;
        let n = fitted.start.v.len();
        let inside = |change: &[f64]| {
            let values = fitted.law.parameters.iter().zip(change.iter().skip(2 * n)).map(|(p, d)| p + d);
            values.zip(&fitted.bounds).all(|(value, [lower, upper])| (*lower..=*upper).contains(&value))
        };
        let change = self.normal.allowed(&mut self.stream, &inside);
        let x = fitted.law.coordinates.retract(&fitted.start.x, &change.as_slice()[..n]);
        let v = fitted.start.v.iter().enumerate().map(|(i, v)| v + change[n + i]).collect();
        let mut law = fitted.law.clone();
        for (i, (p, [lower, upper])) in law.parameters.iter_mut().zip(&fitted.bounds).enumerate() {
            *p = (*p + change[2 * n + i]).clamp(*lower, *upper);
        }
        (law, State { x, v })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Draws of two changes, of which the second has no deviation.
    fn drawn(probability: &Probability<'_>) -> Vec<Vec<f64>> {
        let covariance = DMatrix::from_diagonal(&DVector::from_vec(vec![1.0, 0.0]));
        changes(&covariance, 400, (1, 2), probability)
    }

    #[test]
    fn what_has_no_deviation_does_not_change_at_all() {
        assert!(drawn(&|_, _| 1.0).iter().all(|change| change[1] == 0.0));
    }

    #[test]
    fn draws_that_are_unlikely_are_made_again() {
        assert!(
            drawn(&|change, _| f64::from(u8::from(change[0] > 0.0))).iter().all(|change| change[0] > 0.0)
        );
        // A window that makes changes four times as unlikely as the normal distribution halves its deviation.
        let narrower = drawn(&|_, square| (-1.5 * square).exp());
        let variance = narrower.iter().map(|change| change[0] * change[0]).sum::<f64>() / 400.0;
        assert!((variance - 0.25).abs() < 0.06, "{variance}");
    }
}
