//! A candidate fitted to a whole track.

use super::levenberg::{Minimum, Problem, Settings};
use super::segments::Segments;
use super::track::Track;
use crate::candidate::Candidate;
use crate::coordinates::State;
use crate::law::Law;
use crate::terms::Scales;
use crate::thresholds::FINEST;
use nalgebra::DMatrix;

/// A candidate fitted to a track.
#[derive(Clone, Debug)]
pub struct Fitted {
    /// The law.
    pub law: Law,
    /// State at time 0.
    pub start: State,
    /// χ² of the track, robust and whitened, with the prior of centres.
    pub loss: f64,
    /// Covariance of changes of the start's configuration, of its velocity and of the parameters.
    pub covariance: DMatrix<f64>,
    /// Smallest and largest allowed value of each parameter.
    pub bounds: Vec<[f64; 2]>,
    /// Place among the unknowns (start, then parameters), centre and deviation of each normal prior.
    pub priors: Vec<(usize, f64, f64)>,
}

/// Fits a candidate from a start and first values of its parameters.
///
/// Times of the track count from 0, where the start lies; `None` if no motion could be followed.
#[must_use]
pub fn shoot(
    candidate: &Candidate,
    track: &Track,
    (scales, start): (&Scales, &State),
    parameters: &[f64],
    settings: &Settings,
) -> Option<Fitted> {
    let track = track.part(0..track.times.len());
    let mut segments =
        Segments::new(candidate, std::slice::from_ref(&track), scales, std::slice::from_ref(start));
    let values = segments.values(parameters);
    let Minimum { values, loss, information } = segments.minimise(&values, settings, FINEST)?;
    let covariance = covariance_of(&information)?;
    let problem = &segments.parts[0];
    let n = start.v.len();
    let mut law = problem.law(&values)?;
    let variance = |i: usize| covariance[(2 * n + i, 2 * n + i)].max(0.0).sqrt();
    law.deviations = (0..law.parameters.len()).map(variance).collect();
    let start = problem.start(&values);
    let bounds = problem.unknowns()[2 * n..].iter().map(|unknown| [unknown.lower, unknown.upper]).collect();
    let priors = problem.priors.clone();
    Some(Fitted { law, start, loss, covariance, bounds, priors })
}

/// The covariance of values whose information is known: the inverse of a positive semidefinite matrix, in
/// which directions without information get none. `None` if it is not finite.
#[must_use]
pub fn covariance_of(matrix: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let diagonal: Vec<f64> = matrix.diagonal().iter().map(|d| d.max(f64::MIN_POSITIVE).sqrt()).collect();
    let scaled =
        DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |i, j| matrix[(i, j)] / (diagonal[i] * diagonal[j]));
    let is_finite = |m: &DMatrix<f64>| m.iter().all(|v| v.is_finite());
    // Singular values of what is not finite are sought without end.
    let inverse = is_finite(&scaled).then_some(scaled)?.pseudo_inverse(1e-12).ok()?;
    // Rounding of the inverse is not to be magnified where there is no information at all.
    let is_known = |i: usize| matrix[(i, i)] > 0.0;
    let value = |i: usize, j: usize| {
        if is_known(i) && is_known(j) { inverse[(i, j)] / (diagonal[i] * diagonal[j]) } else { 0.0 }
    };
    is_finite(&inverse).then(|| DMatrix::from_fn(matrix.nrows(), matrix.ncols(), value))
}

#[cfg(test)]
mod tests {
    use super::covariance_of;
    use nalgebra::DMatrix;

    #[test]
    fn what_is_known_without_end_has_no_covariance() {
        let known = |value: f64| DMatrix::from_diagonal(&nalgebra::DVector::from_vec(vec![value, 4.0]));
        assert_eq!(covariance_of(&known(1.0)).map(|c| c[(1, 1)]), Some(0.25));
        assert!(covariance_of(&known(f64::INFINITY)).is_none());
    }
}
