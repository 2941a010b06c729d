//! Choice of a law: the simplest within one slack of the best evidence.
//!
//! The evidence is the Bayesian information criterion in units of χ², with residuals whitened by the noise of
//! the track and samples counted as far as they are independent.

mod candidates;
#[cfg(test)]
mod tests;

pub use candidates::{candidates, simplicity};

use crate::Candidate;
use crate::fit::{Fitted, Settings, Track, first_values, shoot};
use crate::terms::Scales;

/// Difference of evidence, in units of χ², within which the simpler law is taken: by Jeffreys' scale, `e⁵` to
/// one is strong evidence and 10 is its χ².
pub const SLACK: f64 = 10.0;

/// First values of a candidate from which shooting starts.
const SHOTS: usize = 3;

/// A candidate that was fitted to a track.
#[derive(Clone, Debug)]
pub struct Judged {
    /// Place in the list of candidates.
    pub index: usize,
    /// The fit.
    pub fitted: Fitted,
    /// χ² and the penalty of its parameters; the smaller the better.
    pub evidence: f64,
    /// What a choice between laws that the evidence cannot tell apart prefers: the smaller the simpler.
    pub simplicity: usize,
}

/// All candidates that could be fitted, and the law chosen among them.
#[derive(Clone, Debug)]
pub struct Choice {
    /// Fitted candidates, the best evidence first.
    pub judged: Vec<Judged>,
    /// Place of the chosen one in `judged`.
    pub chosen: usize,
    /// Samples that count as independent, summed over components.
    pub samples: f64,
}

impl Choice {
    /// The chosen law.
    #[must_use]
    pub fn law(&self) -> &Judged {
        &self.judged[self.chosen]
    }

    /// Whitened χ² for each degree of freedom that the chosen law leaves, near 1 for a law that explains the
    /// track.
    #[must_use]
    pub fn chi_square_per_sample(&self) -> f64 {
        let fitted = &self.law().fitted;
        fitted.loss / (self.samples - fitted.covariance.nrows() as f64).max(1.0)
    }
}

/// Fits one candidate from its best first values.
#[must_use]
pub fn fit(candidate: &Candidate, track: &Track, scales: &Scales) -> Option<Fitted> {
    let start = &track.smooth[0].0;
    let settings = Settings::default();
    first_values(candidate, track, scales, SHOTS)
        .iter()
        .filter_map(|p| shoot(candidate, track, (scales, start), p, &settings))
        .min_by(|a, b| a.loss.total_cmp(&b.loss))
}

/// Fits all candidates to a track that starts at time 0 and chooses; `None` if none could be fitted.
#[must_use]
pub fn choose(list: &[Candidate], track: &Track, scales: &Scales) -> Option<Choice> {
    let samples = track.independent_samples();
    let penalty = samples.max(1.0).ln();
    let judge = |(index, candidate): (usize, &Candidate)| {
        let fitted = fit(candidate, track, scales)?;
        let evidence = fitted.loss + penalty * candidate.parameter_count() as f64;
        Some(Judged { index, fitted, evidence, simplicity: simplicity(candidate) })
    };
    let mut judged: Vec<Judged> = list.iter().enumerate().filter_map(judge).collect();
    judged.sort_by(|a, b| a.evidence.total_cmp(&b.evidence));
    let best = judged.first()?.evidence;
    let near = judged.iter().enumerate().filter(|(_, j)| j.evidence <= best + SLACK);
    let chosen = near.min_by_key(|(_, j)| j.simplicity)?.0;
    Some(Choice { judged, chosen, samples })
}
