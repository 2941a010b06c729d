//! The law of an object in generalised coordinates: of one body, through impacts or without, or of two that
//! act on each other.

use super::choice::choose_law;
use super::contact::{self, Impacted, Surroundings};
use super::couples::choose_couple;
use super::forecast::ForecastErrors;
use super::kinematics::allow_for_joint;
use super::known::GeneralisedLaw;
use super::modal::choose_modal;
use super::observed::{Laws, ObservedPoses};
use super::rated::Rated;
use super::sliding::slides;
use crate::motion::pose::PoseKind;
use crate::motion::shared_motion::SharedMotion;
use crate::thresholds::{DRAWN_LAWS, JUDGED_WINDOWS, MOST_AFTER_IMPACT};
use lgs_mechanics::FORECAST_ERROR;
use lgs_mechanics::bands::{Rival, Verdict};
use lgs_mechanics::choose::{DESCRIBED, EXPLAINED};
use lgs_mechanics::collisions::Bounced;
use lgs_mechanics::contact::impacts;

/// What laws are sought among, and the points at rest around the body.
pub(crate) type Around<'a> = (Laws, Surroundings<'a>);

/// Errors of poses beside those that their scatter tells of, world units.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Errors {
    /// Length that their source does not resolve: no pose is known better.
    pub(crate) resolution: f64,
    /// Size of errors that change slowly from pose to pose, and may or may not be there.
    pub(crate) slow: f64,
    /// Whether the resolution allows for what no law explains: a law within it need not be the right one.
    pub(crate) is_allowance: bool,
}

impl Errors {
    /// Errors that change slowly, of poses whose source resolves any length.
    pub(crate) fn changing_slowly(slow: f64) -> Self {
        Self { slow, ..Self::resolving(0.0) }
    }

    /// No errors but those below a length that the source does not resolve.
    pub(super) fn resolving(resolution: f64) -> Self {
        Self { resolution, slow: 0.0, is_allowance: false }
    }
}

/// Finds the law of shared motions at the same times, of one body, or of two that act on each other, for
/// poses with known errors.
pub(crate) fn law_within(
    bodies: &[&SharedMotion],
    (laws, surroundings): Around<'_>,
    errors: Errors,
    seed: u64,
) -> Option<GeneralisedLaw> {
    let errors = Errors {
        resolution: errors.resolution.max(FORECAST_ERROR * SharedMotion::rms_displacement_of(bodies)),
        ..errors
    };
    match bodies {
        [motion] if motion.kind == PoseKind::Affine => {
            smooth(&choose_modal(motion, laws, errors.resolution)?, (bodies, Surroundings::default()), seed)
        }
        [motion] => of_body(motion, (laws, surroundings), errors, seed),
        [first, second] => of_couple([first, second], laws, errors, seed),
        _ => None,
    }
}

/// Whether velocities jump between poses.
pub(super) fn has_impacts(motion: &SharedMotion) -> bool {
    let centers: Vec<[f64; 3]> = motion.poses.iter().map(|pose| pose.shift.to_array()).collect();
    !impacts(&motion.times, &centers).is_empty()
}

/// The law of one rigid body.
fn of_body(
    motion: &SharedMotion,
    (laws, surroundings): Around<'_>,
    errors: Errors,
    seed: u64,
) -> Option<GeneralisedLaw> {
    let mut observed = ObservedPoses::new(motion, laws, errors.resolution);
    allow_for_joint(&mut observed, errors.slow);
    observed.slides = slides(&observed, motion, surroundings);
    let (chosen, impacted) = smooth_and_impacted(&mut observed, motion, surroundings, errors);
    if let Some(Bounced { law, chi_square, error, .. }) = impacted.as_ref().map(|found| &found.bounced) {
        tracing::debug!(?law, chi_square, error, "a law through impacts");
    }
    if let Some(impacted) = impacted.as_ref().filter(|found| found.is_sure()) {
        return through_impacts(impacted, &observed, motion, seed);
    }
    // Of impacts that neither a plane at rest nor another body shows, a smooth law that explains is simpler.
    let is_explained = chosen.as_ref().is_some_and(|smooth| smooth.chi_square() <= EXPLAINED);
    let is_told = !surroundings.hits.is_empty();
    let is_admitted = |found: &Impacted| is_told || !is_explained || found.is_on_observed_plane();
    let admitted = impacted.as_ref().filter(|found| is_admitted(found));
    if let Some((impacted, lead)) =
        admitted.and_then(|found| Some((found, found.lead(chosen.as_ref(), &observed)?)))
    {
        let law = through_impacts(impacted, &observed, motion, seed)?;
        let evidence = chosen.map(|smooth| smooth.best().evidence.bettered_by(lead));
        return Some(GeneralisedLaw { evidence, ..law });
    }
    let mut chosen = chosen?;
    if observed.allow_for(errors.slow, chosen.chi_square()) {
        chosen = choose_law(&observed)?;
    }
    smooth(&chosen.by_noise_left(&[&observed]), (&[motion], surroundings), seed)
}

/// The likeliest smooth law of a body and the likeliest one through impacts, as far as they are sought. Where
/// the centre jumps, or others tell of a hit, no smooth law may explain the motion, which is long to find
/// out: less effort is made at first, and no more if there is a law through impacts.
fn smooth_and_impacted(
    observed: &mut ObservedPoses,
    motion: &SharedMotion,
    surroundings: Surroundings<'_>,
    errors: Errors,
) -> (Option<Rated>, Option<Impacted>) {
    let jumps = has_impacts(motion) || !surroundings.hits.is_empty();
    let mut chosen = None;
    if !errors.is_allowance {
        observed.is_explained = jumps;
        chosen = choose_law(observed);
        observed.is_explained = false;
        // A motion that a smooth law explains shows no impact, nor does one that is described without a jump,
        // unless others tell of one.
        let most = if jumps { EXPLAINED } else { DESCRIBED };
        let is_unhit = surroundings.hits.is_empty();
        if chosen.as_ref().is_some_and(|smooth| is_unhit && smooth.chi_square() <= most) {
            return (if jumps { choose_law(observed) } else { chosen }, None);
        }
    }
    let impacted = contact::through_impacts(observed, motion, surroundings, errors.slow);
    let explains = impacted.as_ref().is_some_and(|found| found.accounts_for_motion(surroundings));
    if impacted.as_ref().is_some_and(Impacted::is_sure) || (jumps && explains && chosen.is_some()) {
        return (chosen, impacted);
    }
    if chosen.is_none() || jumps {
        observed.is_explained = explains;
        chosen = choose_law(observed);
        observed.is_explained = false;
    }
    (chosen, impacted)
}

/// The law of two rigid bodies that act on each other.
fn of_couple(bodies: [&SharedMotion; 2], laws: Laws, errors: Errors, seed: u64) -> Option<GeneralisedLaw> {
    if bodies.iter().any(|motion| motion.kind == PoseKind::Affine) {
        return None;
    }
    let mut observed = bodies.map(|motion| ObservedPoses::new(motion, laws, errors.resolution));
    let mut found = choose_couple(observed.each_ref())?;
    let allowed = observed.each_mut().map(|body| body.allow_for(errors.slow, found.chi_square()));
    if allowed.contains(&true) {
        found = choose_couple(observed.each_ref())?;
    }
    smooth(&found.by_noise_left(&observed.each_ref()), (&bodies, Surroundings::default()), seed)
}

/// The likeliest law without impacts; with a contact, if a single body is about to go through a plane at
/// rest.
pub(super) fn smooth(
    rated: &Rated,
    (bodies, surroundings): (&[&SharedMotion], Surroundings<'_>),
    seed: u64,
) -> Option<GeneralisedLaw> {
    let (system, best) = (rated.system(), rated.best());
    let fitted = best.judged.fitted.clone();
    let duration = JUDGED_WINDOWS[1] * bodies[0].duration();
    let law = fitted.law.clone().resolved(&fitted.start, duration, FORECAST_ERROR).ok()?;
    let bases = best.posterior.placed.bases_at_start();
    let ordered: Vec<&SharedMotion> = system.order.iter().map(|&body| bodies[body]).collect();
    let mut found = GeneralisedLaw::new((law, fitted.start.clone()), bases, rated.chi_square(), &ordered)?;
    found.order.clone_from(&system.order);
    found.evidence = Some(best.evidence);
    found.judge(bodies, rated, seed);
    let forecasts = ForecastErrors::of(rated, bodies);
    tracing::debug!(?forecasts, trusted = ?found.known.trusted, "errors of blocked forecasts");
    found.known.forecast_error = forecasts.law;
    // First order does not see a law run away: what it does not explain, it does not forecast.
    let may_run_away = best.posterior.bends() && found.known.verdict != Verdict::Explained;
    if forecasts.fails || may_run_away {
        found.known.limit_to_window(bodies[0].duration());
    }
    let is_trusted = found.known.trusted[1] > bodies[0].duration();
    found.is_refuted = !is_trusted && forecasts.refute();
    if let [motion] = bodies
        && let Some(bounced) = contact::expected(&fitted, &found.bases[0], motion, surroundings)
    {
        found.law.contact.clone_from(&bounced.law.contact);
        expect(&mut found, &bounced, motion, seed);
    }
    Some(found)
}

/// A law through impacts.
fn through_impacts(
    impacted: &Impacted,
    observed: &ObservedPoses,
    motion: &SharedMotion,
    seed: u64,
) -> Option<GeneralisedLaw> {
    let bounced = &impacted.bounced;
    let base = impacted.base(observed);
    let law = (bounced.law.clone(), bounced.start.clone());
    let mut found = GeneralisedLaw::new(law, vec![base], bounced.chi_square, &[motion])?;
    let names: Vec<&str> = found.law.terms.iter().map(|term| term.kind.name()).collect();
    found.known.rivals = vec![Rival { terms: names.join(" + "), weight: 1.0 }];
    if bounced.chi_square <= DESCRIBED {
        found.known.verdict = Verdict::Described;
        found.trust(&bounced.band(&found.judged_times(&[motion]), seed), &[motion]);
        found.set_posterior(vec![bounced.drawn_laws(DRAWN_LAWS, seed)], &[motion]);
    }
    if bounced.error > MOST_AFTER_IMPACT * bounced.path() {
        found.known.verdict = Verdict::Outside;
    }
    Some(found)
}

/// Widens the band of a law by what is not known of a contact that was not seen.
fn expect(found: &mut GeneralisedLaw, bounced: &Bounced, motion: &SharedMotion, seed: u64) {
    if found.known.verdict == Verdict::Outside {
        return;
    }
    let times = found.judged_times(&[motion]);
    let before = found.known.band.radius.iter().map(|radius| radius.unwrap_or(f64::INFINITY));
    let impact = bounced.first_impact(times[times.len() - 1]);
    let own = bounced.band(&times, seed);
    let wider = before.zip(own).zip(&times).map(|((before, own), time)| match impact {
        Some(impact) if *time >= impact => own,
        _ => own.max(before),
    });
    let radius: Vec<f64> = wider.collect();
    found.known.verdict = Verdict::Described;
    found.known.posterior = None;
    found.trust(&radius, &[motion]);
}
