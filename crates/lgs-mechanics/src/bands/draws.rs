//! Draws of start and parameters from the posterior of one fit.

use crate::Law;
use crate::coordinates::State;
use crate::fit::Fitted;
use lgs_core::{Stream, stream};
use nalgebra::{DMatrix, DVector};
use rand::RngExt;

/// A source of draws.
pub(super) struct Draws<'a> {
    fitted: &'a Fitted,
    /// A root of the covariance.
    root: DMatrix<f64>,
    stream: Stream,
}

impl<'a> Draws<'a> {
    pub(super) fn new(fitted: &'a Fitted, seed: u64, index: u64) -> Self {
        let deviations = fitted.covariance.diagonal().map(|d| d.max(f64::MIN_POSITIVE).sqrt());
        let size = deviations.len();
        let part = |i, j| fitted.covariance[(i, j)] / (deviations[i] * deviations[j]);
        let eigen = DMatrix::from_fn(size, size, part).symmetric_eigen();
        let mut root = eigen.eigenvectors;
        for (i, value) in eigen.eigenvalues.iter().enumerate() {
            root.column_mut(i).scale_mut(value.max(0.0).sqrt());
        }
        deviations.iter().enumerate().for_each(|(i, deviation)| root.row_mut(i).scale_mut(*deviation));
        Self { fitted, root, stream: stream(seed, "posterior of a law", index) }
    }

    /// A law and a start.
    pub(super) fn next(&mut self) -> (Law, State) {
        let fitted = self.fitted;
        let normal = DVector::from_fn(self.root.ncols(), |_, _| normal(&mut self.stream));
        let change = &self.root * normal;
        let n = fitted.start.v.len();
        let x = fitted.law.coordinates.retract(&fitted.start.x, &change.as_slice()[..n]);
        let v = fitted.start.v.iter().enumerate().map(|(i, v)| v + change[n + i]).collect();
        let mut law = fitted.law.clone();
        law.parameters.iter_mut().enumerate().for_each(|(i, p)| *p += change[2 * n + i]);
        (law, State { x, v })
    }
}

/// A draw of N(0, 1) by the Box–Muller transform.
fn normal(stream: &mut Stream) -> f64 {
    let radius = (-2.0 * (1.0 - stream.random::<f64>()).ln()).sqrt();
    radius * (std::f64::consts::TAU * stream.random::<f64>()).cos()
}
