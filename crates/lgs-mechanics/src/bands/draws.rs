//! Draws of start and parameters from the posterior of one fit.

use crate::coordinates::State;
use crate::fit::Fitted;
use crate::law::Law;
use crate::thresholds::REDRAWS;
use lgs_core::{Stream, stream};
use nalgebra::{DMatrix, DVector};
use rand_distr::{Distribution, StandardNormal};

/// A normal distribution around zero.
pub(crate) struct Normal {
    /// A root of the covariance.
    root: DMatrix<f64>,
}

impl Normal {
    pub(crate) fn new(covariance: &DMatrix<f64>) -> Self {
        let deviations = covariance.diagonal().map(|d| d.max(f64::MIN_POSITIVE).sqrt());
        let size = deviations.len();
        let part = |i, j| covariance[(i, j)] / (deviations[i] * deviations[j]);
        let eigen = DMatrix::from_fn(size, size, part).symmetric_eigen();
        let mut root = eigen.eigenvectors;
        for (i, value) in eigen.eigenvalues.iter().enumerate() {
            root.column_mut(i).scale_mut(value.max(0.0).sqrt());
        }
        deviations.iter().enumerate().for_each(|(i, deviation)| root.row_mut(i).scale_mut(*deviation));
        Self { root }
    }

    pub(crate) fn draw(&self, stream: &mut Stream) -> DVector<f64> {
        &self.root * DVector::from_fn(self.root.ncols(), |_, _| StandardNormal.sample(stream))
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
}

/// Draws of changes from a normal distribution around zero: those that are not allowed are drawn again, as
/// often as is worth it; `index` is that of the law among its rivals.
#[must_use]
pub fn changes(
    covariance: &DMatrix<f64>,
    count: usize,
    (seed, index): (u64, u64),
    is_allowed: &dyn Fn(&[f64]) -> bool,
) -> Vec<Vec<f64>> {
    let normal = Normal::new(covariance);
    let mut stream = stream(seed, "posterior of a law", index);
    (0..count).map(|_| normal.allowed(&mut stream, is_allowed).as_slice().to_vec()).collect()
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
