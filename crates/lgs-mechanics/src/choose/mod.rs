//! Choice of a law: the best evidence, with prior odds for simple laws.
//!
//! The evidence is the Bayesian information criterion in units of χ², with residuals whitened by the noise of
//! the track and samples counted as far as they are independent.

mod candidates;
mod further;
mod neighbours;
#[cfg(test)]
mod tests;

pub use candidates::{candidates, further_candidates, simplicity, surrounded_candidates};
pub use further::{choose_as_simple, choose_further};
pub use neighbours::choose_among_neighbours;

use crate::candidate::Candidate;
use crate::fit::{Fitted, Settings, Track, approach, first_values, shoot};
use crate::terms::Scales;
use crate::thresholds::{FAR, GOOD, SHOTS};
use rayon::prelude::*;

/// Prior odds against a law, in units of χ², for each half of an unknown that it has more than another one:
/// a law with one unknown more is, before anything is seen, `e` times less likely.
pub const PARSIMONY: f64 = 1.0;

/// Softness τ of the weights `exp(−ΔE / 2 τ)`: evidence that is itself estimated is trusted by half.
pub const SOFTNESS: f64 = 2.0;

/// χ² for each independent sample up to which a law describes a window. Over random laws of a point it is at
/// most 1.6 for the right law, and at least 2.9 for smooth random paths that stand out of their noise.
pub const DESCRIBED: f64 = 2.0;

/// χ² for each independent sample up to which a law explains a motion: there is nothing left for another.
pub const EXPLAINED: f64 = GOOD;

/// A candidate that was fitted to a track.
#[derive(Clone, Debug)]
pub struct Judged {
    /// Place in the list of candidates.
    pub index: usize,
    /// The fit.
    pub fitted: Fitted,
    /// χ² and the penalty of its parameters; the smaller the better.
    pub evidence: f64,
    /// Unknowns in halves, with surcharges of terms without an energy: the smaller the simpler.
    pub simplicity: usize,
}

impl Judged {
    /// Names of its terms, joined by ` + `.
    #[must_use]
    pub fn names(&self) -> String {
        let names: Vec<&str> = self.fitted.law.terms.iter().map(|term| term.kind.name()).collect();
        names.join(" + ")
    }

    /// Evidence and prior odds together, in units of χ²; the smaller the likelier.
    #[must_use]
    pub fn score(&self) -> f64 {
        self.evidence + PARSIMONY * self.simplicity as f64
    }
}

/// All candidates that could be fitted, and the law chosen among them.
#[derive(Clone, Debug)]
pub struct Choice {
    /// Fitted candidates, the best score first.
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

    /// Weight of each fitted candidate in forecasts; they add up to 1.
    #[must_use]
    pub fn weights(&self) -> Vec<f64> {
        weights(&self.judged.iter().map(Judged::score).collect::<Vec<_>>())
    }

    /// Whether one of the laws explains the track to within the scatter of χ².
    #[must_use]
    pub fn explains(&self, judged: &Judged) -> bool {
        let Fitted { law, start, loss, .. } = &judged.fitted;
        *loss <= explained(self.samples, (law.unknown_count() + 2 * start.v.len()) as f64)
    }

    /// Whether the chosen law describes the window, by its χ².
    #[must_use]
    pub fn describes(&self) -> bool {
        self.chi_square_per_sample() <= DESCRIBED
    }

    /// Whitened χ² of the chosen law for each independent sample: below 1 by the share of the unknowns for a
    /// law that explains the track.
    #[must_use]
    pub fn chi_square_per_sample(&self) -> f64 {
        self.law().fitted.loss / self.samples.max(1.0)
    }
}

/// Weights `exp(−S / 2 τ)` of laws by their scores; they add up to 1.
#[must_use]
pub fn weights(scores: &[f64]) -> Vec<f64> {
    let best = scores.iter().copied().fold(f64::INFINITY, f64::min);
    let weight = |score: &f64| (-(score - best) / (2.0 * SOFTNESS)).exp();
    let total: f64 = scores.iter().map(weight).sum();
    scores.iter().map(|score| weight(score) / total).collect()
}

/// How hard a fit of a candidate is tried.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Effort {
    /// From the best first values alone: a simpler law explains the track already, and this one is a rival at
    /// most.
    Rival,
    /// From several first values, by way of segments and directly, until a fit is good.
    Full,
}

/// Fits one candidate from several first values.
#[must_use]
pub fn fit(candidate: &Candidate, track: &Track, scales: &Scales) -> Option<Fitted> {
    fit_with(candidate, track, scales, Effort::Full)
}

/// χ² up to which a law explains a track: that of the degrees of freedom which its unknowns leave, and the
/// scatter of that, `√(2 N)`, and once more for the noise, which is estimated from as many samples.
#[must_use]
pub fn explained(samples: f64, unknowns: f64) -> f64 {
    (samples - unknowns).max(0.0) + 2.0 * samples.sqrt()
}

/// Unknowns of a candidate with its start.
fn unknowns(candidate: &Candidate) -> f64 {
    (candidate.unknown_count() + 2 * candidate.coordinates.freedoms()) as f64
}

fn fit_with(candidate: &Candidate, track: &Track, scales: &Scales, effort: Effort) -> Option<Fitted> {
    let samples = track.independent_samples();
    let settings = Settings { useful: DESCRIBED * samples, ..Settings::default() };
    let begin = &track.smooth[0].0;
    let good = explained(samples, unknowns(candidate));
    let mut best: Option<Fitted> = None;
    let shots = if effort == Effort::Full { SHOTS } else { 1 };
    let most = FAR.powi(2) * samples;
    for first in first_values(candidate, track, scales, shots) {
        let near = match effort {
            Effort::Full => approach(candidate, track, scales, (&first, most)),
            Effort::Rival => None,
        };
        if effort == Effort::Full && near.is_none() && best.is_some() {
            continue;
        }
        for near in [near, Some((begin.clone(), first))] {
            let Some((start, parameters)) = near else { continue };
            let fitted = shoot(candidate, track, (scales, &start), &parameters, &settings);
            best = best.into_iter().chain(fitted).min_by(|a, b| a.loss.total_cmp(&b.loss));
            if best.as_ref().is_some_and(|fitted| fitted.loss <= good) {
                return best;
            }
        }
    }
    best
}

/// Fits all candidates to a track, the simplest first and those as simple as each other side by side, and
/// chooses; `None` if none could be fitted.
#[must_use]
pub fn choose(list: &[Candidate], track: &Track, scales: &Scales) -> Option<Choice> {
    choose_beside(list, track, scales, usize::MAX)
}

/// The same where a law of a simplicity is known that explains the track: those that are not as simple are
/// its rivals at most, and fitted with less effort.
#[must_use]
pub fn choose_beside(list: &[Candidate], track: &Track, scales: &Scales, known: usize) -> Option<Choice> {
    let samples = track.independent_samples();
    let mut order: Vec<usize> = (0..list.len()).collect();
    order.sort_by_key(|&index| simplicity(&list[index]));
    let mut judged: Vec<Judged> = Vec::new();
    let mut simplest = known;
    for alike in order.chunk_by(|&a, &b| simplicity(&list[a]) == simplicity(&list[b])) {
        let own = simplicity(&list[alike[0]]);
        let effort = if own > simplest { Effort::Rival } else { Effort::Full };
        let fitted = |&index: &usize| judge(index, &list[index], (track, scales), effort);
        let found: Vec<Judged> = alike.par_iter().filter_map(fitted).collect();
        let explains = |found: &Judged| found.fitted.loss <= explained(samples, unknowns(&list[found.index]));
        if found.iter().any(explains) {
            simplest = simplest.min(own);
        }
        judged.extend(found);
    }
    among(judged, samples)
}

/// Fits one candidate and weighs it.
pub(crate) fn judge(
    index: usize,
    candidate: &Candidate,
    (track, scales): (&Track, &Scales),
    effort: Effort,
) -> Option<Judged> {
    let fitted = fit_with(candidate, track, scales, effort)?;
    let penalty = track.independent_samples().max(1.0).ln();
    let evidence = fitted.loss + penalty * candidate.unknown_count() as f64;
    Some(Judged { index, fitted, evidence, simplicity: simplicity(candidate) })
}

/// Chooses the best score.
pub(crate) fn among(mut judged: Vec<Judged>, samples: f64) -> Option<Choice> {
    judged.sort_by(|a, b| a.score().total_cmp(&b.score()));
    (!judged.is_empty()).then_some(Choice { judged, chosen: 0, samples })
}
