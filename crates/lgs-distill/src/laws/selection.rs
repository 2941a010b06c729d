//! The choice of a law's terms by forecasts of held-out samples.
//!
//! Every candidate is fitted without the last part of the window and rolled into it, and fitted without the
//! first part and rolled back into that. The simplest candidate whose forecast is about as good as the best
//! one's is taken, candidates without a force Q first: a motion that a potential explains belongs to the
//! potential. Residuals inside a window always fall with more terms; forecasts do not, so this keeps terms
//! that have only fitted noise from wrecking a rollout to three times the window, and says honestly how good
//! one is.

use super::candidate::Candidate;
use super::fit::LawFit;
use super::fitted_law::{FittedLaw, HeldOutSample};
use super::linear::law::Law;
use super::linear::terms::Terms;
use crate::config::DistillConfig;
use crate::motion::object_motion::ObjectMotion;
use crate::motion::shared_motion::SharedMotion;
use crate::motion::smooth_motion::SmoothMotion;
use crate::shared_support::SharedSupport;
use crate::shared_support::moments::SupportMoments;
use crate::thresholds::{MOST_GROWTH, MOST_RATE, MOST_REACH, UNDESCRIBED_FORECAST, UNEXPLAINED_FORECAST};
use glam::DVec3;
use lgs_core::geometry::wide;
use lgs_dynamics::{ForceKind, PotentialKind};
use rayon::prelude::*;
use std::ops::Range;

/// A chosen law, fitted to the whole window, with the forecast that chose it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ChosenLaw {
    /// Its form.
    pub(crate) candidate: Candidate,
    /// The fit to the whole window.
    pub(crate) fitted: FittedLaw,
    /// The same law under the rigid constraint, if it was fitted to independent particles and a rigid body
    /// follows it as well.
    pub(crate) constrained: Option<FittedLaw>,
    /// Root mean square position error at held-out samples.
    pub(crate) forecast: f64,
}

/// Chooses and fits the law of an object's motion; `None` if its particles share no motion, the
/// configuration's U cannot hold a law, or no candidate gives anything finite.
pub(crate) fn choose_law(
    motion: &ObjectMotion,
    support: Option<&SharedSupport>,
    config: &DistillConfig,
) -> Option<ChosenLaw> {
    let shared = motion.shared.as_ref().filter(|_| config.potential == PotentialKind::QuadraticMlp)?;
    let moments = support.map(|support| support.moments);
    let center = wide(motion.scales.center);
    let folds = folds(&shared.shared, config);
    let forecaster = |fold| Forecaster::new(fold, center, moments);
    let selection = Selection {
        motion: &shared.shared,
        forecasters: folds.each_ref().map(forecaster),
        whole: LawFit::new(shared, center, moments),
        points: shared.shared.sigma_points(),
        displacement: shared.shared.rms_displacement(),
        config,
    };
    selection.choose(&candidates(config.force, support))
}

/// Laws to choose from, in order of preference: for independent particles (the paper's form) before those
/// under the rigid constraint.
fn candidates(force: ForceKind, support: Option<&SharedSupport>) -> Vec<Candidate> {
    let terms = Terms::candidates(force);
    let of_mode = |rigid_constraint| terms.iter().map(move |&terms| Candidate { terms, rigid_constraint });
    let mut all: Vec<Candidate> = of_mode(false).collect();
    if support.is_some() {
        all.extend(of_mode(true));
    }
    all
}

/// A part of the window, and the samples outside of it.
struct Fold {
    motion: SmoothMotion,
    held_out: Vec<HeldOutSample>,
}

/// The window without its last part, and without its first.
fn folds(motion: &SharedMotion, config: &DistillConfig) -> [Fold; 2] {
    let samples = motion.times.len();
    let held_out = config.held_out_samples(samples);
    let fold = |window: Range<usize>, held_out: &mut dyn Iterator<Item = usize>| Fold {
        motion: SmoothMotion::new(motion.part(window.clone()), config.degrees()),
        held_out: held_out
            .map(|sample| HeldOutSample { step: sample as i64 - window.start as i64, sample })
            .collect(),
    };
    [
        fold(0..samples - held_out, &mut (samples - held_out..samples)),
        fold(held_out..samples, &mut (0..held_out).rev()),
    ]
}

/// The fits of one fold, and the samples that test them.
struct Forecaster<'a> {
    fit: LawFit<'a>,
    held_out: &'a [HeldOutSample],
}

impl<'a> Forecaster<'a> {
    fn new(fold: &'a Fold, center: DVec3, support: Option<SupportMoments>) -> Self {
        Self { fit: LawFit::new(&fold.motion, center, support), held_out: &fold.held_out }
    }
}

/// The choice for one motion.
struct Selection<'a> {
    motion: &'a SharedMotion,
    forecasters: [Forecaster<'a>; 2],
    /// The fits to the whole window.
    whole: LawFit<'a>,
    points: Vec<DVec3>,
    displacement: f64,
    config: &'a DistillConfig,
}

/// A candidate with its forecast error and its fit to the whole window.
struct Scored {
    candidate: Candidate,
    forecast: f64,
    fitted: FittedLaw,
}

impl Selection<'_> {
    /// The first candidate whose forecast is admitted.
    fn choose(&self, candidates: &[Candidate]) -> Option<ChosenLaw> {
        let fitted = self.fitted(candidates);
        let best = fitted.iter().map(|scored| scored.forecast).fold(f64::INFINITY, f64::min);
        let chosen = fitted
            .into_iter()
            .find(|scored| scored.forecast <= self.admitted(&scored.candidate.terms, best))?;
        let Scored { candidate, forecast, fitted } = chosen;
        Some(ChosenLaw { candidate, forecast, constrained: self.constrained(&candidate, &fitted), fitted })
    }

    /// Candidates with finite forecasts, fitted to the whole window. Where no law explains the motion, only
    /// those that at least stay about where the motion was.
    fn fitted(&self, candidates: &[Candidate]) -> Vec<Scored> {
        let forecasts: Vec<f64> = candidates.par_iter().map(|candidate| self.forecast(candidate)).collect();
        for (candidate, forecast) in candidates.iter().zip(&forecasts) {
            tracing::debug!(?candidate, forecast, "forecast of a candidate law");
        }
        let best = forecasts.iter().copied().fold(f64::INFINITY, f64::min);
        let is_explained = best <= UNEXPLAINED_FORECAST * self.displacement;
        let finite = candidates.iter().zip(forecasts).filter(|(_, forecast)| forecast.is_finite());
        finite
            .filter_map(|(&candidate, forecast)| {
                self.whole.fit(&candidate).map(|fitted| Scored { candidate, forecast, fitted })
            })
            .filter(|Scored { candidate, fitted, .. }| {
                is_explained || candidate.terms.is_unconfined() || self.stays(fitted)
            })
            .collect()
    }

    /// Root mean square error of a candidate's forecasts of the held-out samples; infinite if it is none.
    fn forecast(&self, candidate: &Candidate) -> f64 {
        let (dt, window) = (self.motion.dt(), self.motion.dt() * self.motion.times.len() as f64);
        let is_sound =
            |law: &Law| law.fastest_rate() * dt < MOST_RATE && law.growth_rate() * window < MOST_GROWTH;
        let squared = self.forecasters.iter().map(|Forecaster { fit, held_out }| {
            let fitted = fit.fit(candidate).filter(|fitted| is_sound(&fitted.law));
            fitted.map_or(f64::INFINITY, |f| f.error_at(self.motion, &self.points, held_out).powi(2))
        });
        (0.5 * squared.sum::<f64>()).sqrt()
    }

    /// The largest forecast error with which a law of these terms is taken, given the best one's. Motions
    /// that cannot be told apart go to the potential; where nothing describes the motion, the best forecast
    /// counts.
    fn admitted(&self, terms: &Terms, best: f64) -> f64 {
        let config = self.config;
        let is_described = best <= UNDESCRIBED_FORECAST * self.displacement;
        let (slack, tolerance) = if is_described && !terms.has_force() {
            (config.conservative_slack, config.forecast_tolerance)
        } else {
            (config.forecast_slack, 0.0)
        };
        best * f64::from(slack) + f64::from(config.forecast_floor) * self.displacement + f64::from(tolerance)
    }

    /// The law under the rigid constraint, if it is one of independent particles that a rigid body follows as
    /// well.
    fn constrained(&self, candidate: &Candidate, fitted: &FittedLaw) -> Option<FittedLaw> {
        if candidate.rigid_constraint || !self.whole.has_support() {
            return None;
        }
        let constrained = self.whole.constrained(&fitted.law, candidate)?;
        let (error, constrained_error) = (fitted.error, constrained.error);
        tracing::debug!(?candidate, error, constrained_error, "the law, and a rigid body under it");
        let tolerated = f64::from(self.config.forecast_slack) * error
            + f64::from(self.config.forecast_floor) * self.displacement;
        (constrained_error <= tolerated).then_some(constrained)
    }

    /// Whether a rollout to three windows stays within [`MOST_REACH`] of the reach that the motion had in
    /// one.
    fn stays(&self, fitted: &FittedLaw) -> bool {
        let seen = || self.motion.poses.iter().flat_map(|pose| self.points.iter().map(|&b| pose.apply(b)));
        let center = seen().sum::<DVec3>() / (self.motion.poses.len() * self.points.len()) as f64;
        let limit = MOST_REACH * seen().map(|p| p.distance(center)).fold(0.0, f64::max);
        let mut rollout = fitted.rollout(&self.points, self.motion.dt());
        (0..=3 * (self.motion.times.len() - 1)).all(|step| {
            if step > 0 {
                rollout.step();
            }
            (0..self.points.len()).all(|i| rollout.position(i).distance(center) <= limit)
        })
    }
}
