//! Which terms a law has, chosen by forecasts of held-out samples.
//!
//! Every candidate is fitted without the last part of the window and rolled into it, and fitted without the
//! first part and rolled back into that. The simplest candidate whose forecast is about as good as the best
//! one's is taken, candidates without a force Q first: what a potential explains belongs to the potential
//! (G42). Residuals inside a window always fall with more terms; forecasts do not, so this keeps terms that
//! have only fitted noise from wrecking a rollout to three times the window, and says honestly how good one
//! is.

use crate::DistillConfig;
use crate::dense::{V3, add, norm2, scale, sub};
use crate::fitted_law::{Candidate, FittedLaw};
use crate::law::{Stiffness, Terms, fastest_rate, growth_rate};
use crate::law_fit::LawFit;
use crate::pose::PoseKind;
use crate::rigid_body::Anchoring;
use crate::shared_motion::SharedMotion;
use rayon::prelude::*;

/// A potential that pushes apart may do so by this exponent over the window, and no more: over three windows
/// it would tear apart.
const MOST_GROWTH: f64 = 0.35;

/// Forecast error, as a part of the displacement, above which a motion counts as unexplained.
const POOR: f64 = 0.01;
/// Forecast error, as a part of the displacement, above which a motion is not even described.
const LOST: f64 = 0.1;
/// How much farther than in the window a law may carry an unexplained motion in three windows.
const MOST_REACH: f64 = 1.5;

/// A chosen law, fitted to the whole window, with the forecast that chose it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ChosenLaw {
    /// Its form.
    pub(crate) candidate: Candidate,
    /// The fit to the whole window.
    pub(crate) fitted: FittedLaw,
    /// The same law from the best start of a body held rigid, if it was fitted to independent particles and
    /// the body follows it as well.
    pub(crate) held: Option<FittedLaw>,
    /// Root mean square position error at held-out samples.
    pub(crate) forecast: f64,
}

/// Laws to choose from, in order of preference: for independent particles (the paper's form) before those
/// that need the object held rigid, and in each group fewer terms first, potentials before forces except for
/// plain damping.
pub(crate) fn candidates(force: bool, rigid_constraint: bool) -> Vec<Candidate> {
    use Stiffness::{Axial, Full, Isotropic, None};
    let terms = |gravity, stiffness, damping, gyration| Terms { gravity, stiffness, damping, gyration };
    let mut tiers = vec![
        vec![terms(false, None, false, false), terms(true, None, false, false)],
        vec![terms(true, Isotropic, false, false), terms(true, Axial, false, false)],
        vec![terms(true, Full, false, false)],
    ];
    if force {
        tiers.insert(1, vec![terms(false, None, true, false), terms(true, None, true, false)]);
        tiers.push(vec![
            terms(true, Isotropic, true, false),
            terms(true, Axial, true, false),
            terms(true, Full, true, false),
        ]);
        tiers.push(vec![
            terms(false, None, false, true),
            terms(true, None, false, true),
            terms(true, None, true, true),
            terms(true, Isotropic, false, true),
            terms(true, Axial, false, true),
            terms(true, Full, false, true),
            terms(true, Full, true, true),
        ]);
    }
    let modes = if rigid_constraint { &[false, true][..] } else { &[false][..] };
    modes
        .iter()
        .flat_map(|&rigid_constraint| {
            tiers.iter().flatten().map(move |&terms| Candidate { terms, rigid_constraint })
        })
        .collect()
}

/// The fits of one window, and the samples outside of it that judge them.
struct Fold<'a> {
    fit: LawFit<'a>,
    /// Step from the fold's first sample, and index of the sample in the whole motion.
    judges: Vec<(i64, usize)>,
}

/// Chooses and fits the law of a motion; `None` if no candidate gives anything finite.
pub(crate) fn choose_law(
    motion: &SharedMotion,
    center: V3,
    anchors: &[usize],
    force: bool,
    config: &DistillConfig,
) -> Option<ChosenLaw> {
    let samples = motion.times.len();
    let anchoring = Anchoring::of(&anchors.iter().map(|&i| motion.shape[i]).collect::<Vec<_>>());
    let rigid_constraint = config.rigid_constraint && motion.kind == PoseKind::Rigid && anchors.len() >= 4;
    let held = ((samples as f32 * config.held_out) as usize).clamp(1, samples / 2);
    let early = motion.window(0..samples - held);
    let late = motion.window(held..samples);
    let degrees = config.degrees();
    let folds = [
        Fold {
            fit: LawFit::new(&early, &early.smooth(degrees.clone()).0, center, anchoring),
            judges: (samples - held..samples).map(|s| (s as i64, s)).collect(),
        },
        Fold {
            fit: LawFit::new(&late, &late.smooth(degrees.clone()).0, center, anchoring),
            judges: (0..held).rev().map(|s| (s as i64 - held as i64, s)).collect(),
        },
    ];
    let whole = LawFit::new(motion, &motion.smooth(degrees).0, center, anchoring);
    let points = motion.sigma_points();
    let dt = (motion.times[samples - 1] - motion.times[0]) / (samples - 1) as f64;
    let scored: Vec<(Candidate, f64)> = candidates(force, rigid_constraint)
        .into_par_iter()
        .map(|candidate| {
            let squares: f64 =
                folds.iter().map(|fold| forecast(fold, &candidate, motion, &points, dt).powi(2)).sum();
            (candidate, (0.5 * squares).sqrt())
        })
        .collect();
    for (candidate, score) in &scored {
        tracing::debug!(?candidate, score, "forecast of a candidate law");
    }
    let displacement = motion.rms_displacement();
    let best = smallest(&scored);
    // Where no law explains the motion, one that at least stays about where the motion was is taken.
    let explained = best <= POOR * displacement;
    let kept: Vec<(Candidate, f64, FittedLaw)> = scored
        .iter()
        .filter(|(_, score)| score.is_finite())
        .filter_map(|&(candidate, score)| whole.fit(&candidate).map(|fitted| (candidate, score, fitted)))
        .filter(|(candidate, _, fitted)| {
            explained || is_plain(candidate) || stays(fitted, motion, &points, dt)
        })
        .collect();
    let best = kept.iter().map(|(_, score, _)| *score).fold(f64::INFINITY, f64::min);
    let admitted = |candidate: &Candidate| {
        // What cannot be told apart goes to the potential; where nothing describes the motion, the best
        // forecast counts.
        let (slack, tolerance) = match (candidate.terms.has_force(), best <= LOST * displacement) {
            (false, true) => (config.conservative_slack, config.forecast_tolerance),
            _ => (config.forecast_slack, 0.0),
        };
        best * f64::from(slack) + f64::from(config.forecast_floor) * displacement + f64::from(tolerance)
    };
    let (candidate, forecast, fitted) =
        kept.into_iter().find(|(candidate, score, _)| *score <= admitted(candidate))?;
    let held = if rigid_constraint && !candidate.rigid_constraint {
        whole.held(&fitted.law, &candidate)
    } else {
        None
    };
    tracing::debug!(
        ?candidate,
        error = fitted.error,
        held = held.map(|held| held.error),
        "the law, and a body held rigid under it"
    );
    let tolerated =
        f64::from(config.forecast_slack) * fitted.error + f64::from(config.forecast_floor) * displacement;
    Some(ChosenLaw { candidate, fitted, held: held.filter(|held| held.error <= tolerated), forecast })
}

/// The smallest score.
fn smallest(scored: &[(Candidate, f64)]) -> f64 {
    scored.iter().map(|(_, score)| *score).fold(f64::INFINITY, f64::min)
}

/// Whether a law is one of uniform field and damping alone, which may leave the window's region.
fn is_plain(candidate: &Candidate) -> bool {
    candidate.terms.stiffness == Stiffness::None && !candidate.terms.gyration
}

/// Whether a rollout to three windows stays within [`MOST_REACH`] of the reach that the motion had in one.
fn stays(fitted: &FittedLaw, motion: &SharedMotion, points: &[V3], dt: f64) -> bool {
    let seen: Vec<V3> = motion.poses.iter().flat_map(|pose| points.iter().map(|&b| pose.apply(b))).collect();
    let center = scale(seen.iter().fold([0.0; 3], |sum, &p| add(sum, p)), 1.0 / seen.len() as f64);
    let reach =
        |positions: &[V3]| positions.iter().map(|&p| norm2(sub(p, center))).fold(0.0, f64::max).sqrt();
    let rolled = fitted.rollout(points, dt, 3 * (motion.times.len() - 1));
    let limit = MOST_REACH * reach(&seen);
    rolled.iter().all(|row| reach(row) <= limit && row.iter().flatten().all(|v| v.is_finite()))
}

/// Error of a candidate at a fold's judges.
fn forecast(fold: &Fold<'_>, candidate: &Candidate, motion: &SharedMotion, points: &[V3], dt: f64) -> f64 {
    let window = dt * motion.times.len() as f64;
    match fold.fit.fit(candidate) {
        Some(fitted)
            if fastest_rate(&fitted.law) * dt < 0.5 && growth_rate(&fitted.law) * window < MOST_GROWTH =>
        {
            fitted.error_at(motion, points, dt, &fold.judges)
        }
        _ => f64::INFINITY,
    }
}
