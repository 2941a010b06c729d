//! The law of an object in generalised coordinates, with what is known of it.

use super::choice::{Chosen, choose_law, unknowns};
use super::contact::{self, Impacted, Surroundings};
use super::modal::choose_modal;
use super::observed::{Laws, ObservedPoses};
use crate::motion::pose::{Pose, PoseKind};
use crate::motion::shared_motion::SharedMotion;
use crate::thresholds::{
    EXPLAINED_WINDOWS, JUDGED_WINDOWS, LEAST_WEIGHT, MOST_AFTER_IMPACT, RESIDUAL_TOLERANCE, STEP_ERROR,
    TIMES_IN_WINDOW, TRUSTED_FRACTION,
};
use glam::{DMat3, DVec3};
use lgs_core::geometry::narrow;
use lgs_mechanics::bands::{Band, Known, PositionBand, Rival, Verdict, trusted};
use lgs_mechanics::choose::{Choice, DESCRIBED, Judged};
use lgs_mechanics::collisions::Bounced;
use lgs_mechanics::contact::Origin;
use lgs_mechanics::coordinates::{Embedding, State};
use lgs_mechanics::{Edit, Law, System};

/// A law with its start, and what is known of it.
pub(crate) struct GeneralisedLaw {
    /// The law, at a step that resolves it.
    pub(crate) law: Law,
    /// State at the first sample.
    pub(crate) start: State,
    /// Pose of the shape at the first sample.
    pub(crate) base: Pose,
    /// Root mean square position error over the window.
    pub(crate) window_error: f64,
    /// How well it is known.
    pub(crate) known: Known,
}

/// What laws are sought among, and the points at rest around the body.
pub(crate) type Around<'a> = (Laws, Surroundings<'a>);

/// Finds the law of a shared motion whose source does not resolve `resolution`, world units. Where no law
/// explains it, the source makes errors that its roughness does not tell of, and the simplest law within such
/// errors describes the motion.
pub(crate) fn find_law(
    motion: &SharedMotion,
    around: Around<'_>,
    resolution: f64,
    seed: u64,
) -> Option<GeneralisedLaw> {
    let found = law_within(motion, around, Errors::resolving(resolution), seed)?;
    if found.known.chi_square <= DESCRIBED {
        return Some(found);
    }
    let smooth_errors = RESIDUAL_TOLERANCE * motion.rms_displacement();
    let described = law_within(motion, around, Errors::resolving(resolution.max(smooth_errors)), seed);
    let Some(mut law) = described.filter(|law| law.known.chi_square <= DESCRIBED) else { return Some(found) };
    law.known.verdict = Verdict::Described;
    Some(law)
}

/// Errors of poses beside those that their scatter tells of, world units.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Errors {
    /// Length that their source does not resolve: no pose is known better.
    pub(crate) resolution: f64,
    /// Size of errors that change slowly from pose to pose, and may or may not be there.
    pub(crate) slow: f64,
}

impl Errors {
    fn resolving(resolution: f64) -> Self {
        Self { resolution, slow: 0.0 }
    }
}

/// The same for poses with known errors.
pub(crate) fn law_within(
    motion: &SharedMotion,
    (laws, surroundings): Around<'_>,
    errors: Errors,
    seed: u64,
) -> Option<GeneralisedLaw> {
    let resolution = errors.resolution.max(STEP_ERROR * motion.rms_displacement());
    if motion.kind == PoseKind::Affine {
        return GeneralisedLaw::smooth(choose_modal(motion, laws, resolution)?, (motion, &[]), seed);
    }
    let mut observed = ObservedPoses::new(motion, laws, resolution);
    let impacted = contact::through_impacts(&observed, motion, surroundings);
    tracing::debug!(impacted = ?impacted.as_ref().map(|found| told(&found.bounced)), "a law through impacts");
    let is_sure = |found: &&Impacted| found.bounced.is_within_noise() && is_on_observed_plane(&found.bounced);
    if let Some(impacted) = impacted.as_ref().filter(is_sure) {
        return GeneralisedLaw::impacted(impacted, &observed, motion, seed);
    }
    let chosen = choose_law(&observed);
    if let Some(impacted) = impacted.filter(|found| is_likelier(found, chosen.as_ref(), &observed)) {
        return GeneralisedLaw::impacted(&impacted, &observed, motion, seed);
    }
    let mut chosen = chosen?;
    if observed.allow_for(errors.slow, chosen.chi_square) {
        chosen = choose_law(&observed)?;
    }
    GeneralisedLaw::smooth(chosen, (motion, surroundings), seed)
}

/// What is told of a law through impacts.
fn told(bounced: &Bounced) -> (&Law, f64, f64, f64) {
    (&bounced.law, bounced.chi_square, bounced.error, bounced.evidence())
}

fn is_on_observed_plane(bounced: &Bounced) -> bool {
    bounced.law.contact.as_ref().is_some_and(|contact| contact.origin == Origin::Observed)
}

/// Whether a law through impacts is likelier than a smooth one. On a plane that nothing at rest shows, it has
/// to say where the body is after the impact: what stops a body in the air may be a hand.
fn is_likelier(impacted: &Impacted, chosen: Option<&Chosen>, observed: &ObservedPoses) -> bool {
    let bounced = &impacted.bounced;
    if !is_on_observed_plane(bounced) && bounced.error > MOST_AFTER_IMPACT * bounced.path() {
        return false;
    }
    let Some(Chosen { system, choice, .. }) = chosen else { return true };
    let fitted = &choice.law().fitted;
    let Ok(states) = System::new(&fitted.law, Edit::NONE).states(&fitted.start, &observed.times) else {
        return true;
    };
    let poses: Vec<Pose> = states.iter().map(|state| system.pose_in(&state.x)).collect();
    // The start of the law with a contact is not counted, so as many are left out of the other's.
    let beyond_start = unknowns(system, choice.law()) - 2.0 * bounced.start.v.len() as f64;
    let smooth = impacted.evidence_of(observed, &poses, beyond_start);
    tracing::debug!(
        smooth,
        bounced = bounced.evidence(),
        "evidence of a smooth law and of one with a contact"
    );
    bounced.evidence() < smooth
}

impl GeneralisedLaw {
    /// A law without impacts; with a contact, if the body is about to go through a plane at rest.
    fn smooth(
        chosen: Chosen,
        (motion, surroundings): (&SharedMotion, Surroundings<'_>),
        seed: u64,
    ) -> Option<Self> {
        let Chosen { system, choice, chi_square } = chosen;
        let fitted = choice.law().fitted.clone();
        let duration = JUDGED_WINDOWS[1] * motion.duration();
        let law = fitted.law.clone().resolved(&fitted.start, duration, STEP_ERROR).ok()?;
        let base = system.pose_in(&fitted.start.x);
        let known = Known { chi_square, ..Known::default() };
        let mut found = Self { window_error: 0.0, known, law, start: fitted.start.clone(), base };
        found.window_error = found.error_over(motion)?;
        found.judge(motion, &choice, seed);
        if let Some(bounced) = contact::expected(&fitted, &base, motion, surroundings) {
            found.law.contact.clone_from(&bounced.law.contact);
            found.expect(&bounced, motion, seed);
        }
        Some(found)
    }

    /// A law through impacts.
    fn impacted(
        impacted: &Impacted,
        observed: &ObservedPoses,
        motion: &SharedMotion,
        seed: u64,
    ) -> Option<Self> {
        let bounced = &impacted.bounced;
        let known = Known { chi_square: bounced.chi_square, ..Known::default() };
        let base = impacted.base(observed);
        let (law, start) = (bounced.law.clone(), bounced.start.clone());
        let mut found = Self { window_error: 0.0, known, law, start, base };
        found.window_error = found.error_over(motion)?;
        let names: Vec<&str> = found.law.terms.iter().map(|term| term.kind.name()).collect();
        found.known.rivals = vec![Rival { terms: names.join(" + "), weight: 1.0 }];
        if bounced.chi_square <= DESCRIBED {
            found.known.verdict = Verdict::Described;
            found.trust(&bounced.band(&found.judged_times(motion), seed), motion);
        }
        if bounced.error > MOST_AFTER_IMPACT * bounced.path() {
            found.known.verdict = Verdict::Outside;
        }
        Some(found)
    }

    /// Widens the band by what is not known of a contact that was not seen.
    fn expect(&mut self, bounced: &Bounced, motion: &SharedMotion, seed: u64) {
        if self.known.verdict == Verdict::Outside {
            return;
        }
        let times = self.judged_times(motion);
        let before = self.known.band.radius.iter().map(|radius| radius.unwrap_or(f64::INFINITY));
        let impact = bounced.first_impact(times[times.len() - 1]);
        let own = bounced.band(&times, seed);
        let wider = before.zip(own).zip(&times).map(|((before, own), time)| match impact {
            Some(impact) if *time >= impact => own,
            _ => own.max(before),
        });
        let radius: Vec<f64> = wider.collect();
        self.known.verdict = Verdict::Described;
        self.trust(&radius, motion);
    }

    /// Times at which a forecast is judged.
    fn judged_times(&self, motion: &SharedMotion) -> Vec<f64> {
        let spacing = motion.duration() / TIMES_IN_WINDOW as f64;
        let [first, last] = JUDGED_WINDOWS.map(|windows| (windows * TIMES_IN_WINDOW as f64) as i32);
        (first..=last).map(|i| f64::from(i) * spacing).collect()
    }

    /// Positions of shape points at the first sample, and their velocities.
    pub(crate) fn initial_states(&self, shape: &[DVec3]) -> (Vec<[f32; 3]>, Vec<[f32; 3]>) {
        let rate =
            Embedding::new(&self.law.coordinates, &self.start.x).rates(&self.start.x, &self.start.v)[0];
        let state = |&b: &DVec3| {
            let position = self.base.apply(b);
            (narrow(position), narrow(rate.apply(position)))
        };
        shape.iter().map(state).unzip()
    }

    /// The pose of the shape in a configuration.
    fn pose_in(&self, x: &[f64]) -> (DMat3, DVec3) {
        let place = Embedding::new(&self.law.coordinates, &self.start.x).placements(x)[0];
        (place.linear * self.base.linear, place.apply(self.base.shift))
    }

    /// Root mean square error of the particles' positions over the window.
    fn error_over(&self, motion: &SharedMotion) -> Option<f64> {
        let times: Vec<f64> = motion.times.iter().map(|t| t - motion.times[0]).collect();
        let states = System::new(&self.law, Edit::NONE).states(&self.start, &times).ok()?;
        let points = motion.sigma_points();
        let of_sample = |(state, pose): (&State, &Pose)| {
            let (linear, shift) = self.pose_in(&state.x);
            points.iter().map(|&b| (linear * b + shift).distance_squared(pose.apply(b))).sum::<f64>()
        };
        let sum: f64 = states.iter().zip(&motion.poses).map(of_sample).sum();
        Some((sum / (points.len() * motion.poses.len()) as f64).sqrt())
    }

    /// Distance of the particles in two states, root mean square.
    fn distance(&self, points: &[DVec3], a: &State, b: &State) -> f64 {
        let [(linear, shift), (other, to)] = [a, b].map(|state| self.pose_in(&state.x));
        let squares = points.iter().map(|&p| (linear * p + shift).distance_squared(other * p + to));
        (squares.sum::<f64>() / points.len() as f64).sqrt()
    }

    /// The verdict, and the times between which the forecast is trusted: those where the 90 % band over the
    /// law's posterior and its rivals is narrower than a fraction of the path.
    fn judge(&mut self, motion: &SharedMotion, choice: &Choice, seed: u64) {
        self.known.rivals = rivals(choice);
        if self.known.chi_square > DESCRIBED {
            return;
        }
        self.known.verdict = Verdict::Described;
        let Some(band) = Band::new(choice, &self.judged_times(motion), seed) else { return };
        let points = motion.sigma_points();
        self.trust(&band.radius(0.9, &|a, b| self.distance(&points, a, b)), motion);
    }

    /// Takes the radius of a band at the times at which a forecast is judged.
    fn trust(&mut self, radius: &[f64], motion: &SharedMotion) {
        let (times, window) = (self.judged_times(motion), motion.duration());
        let path = self.path(motion, &times);
        self.known.trusted = trusted(&times, radius, [0.0, window], TRUSTED_FRACTION * path);
        if self.known.trusted[1] >= EXPLAINED_WINDOWS * window {
            self.known.verdict = Verdict::Explained;
        }
        let radius = radius.iter().map(|radius| radius.is_finite().then_some(*radius)).collect();
        self.known.band = PositionBand { times, radius };
    }

    /// Length of the path in a window, the mean over the times that the law can be followed to.
    fn path(&self, motion: &SharedMotion, times: &[f64]) -> f64 {
        let system = System::new(&self.law, Edit::NONE);
        let states = |times: &[f64]| system.states(&self.start, times).unwrap_or_default();
        let zero = times.partition_point(|time| *time < 0.0);
        let halves = [states(&times[..zero]), states(&times[zero..])];
        let points = motion.sigma_points();
        let mut sum = 0.0;
        for pair in halves.iter().flat_map(|half| half.windows(2)) {
            sum += self.distance(&points, &pair[0], &pair[1]);
        }
        let followed: usize = halves.iter().map(|half| half.len().saturating_sub(1)).sum();
        sum * TIMES_IN_WINDOW as f64 / followed.max(1) as f64
    }
}

/// Laws in the same coordinates with a weight worth telling, the likeliest first.
fn rivals(choice: &Choice) -> Vec<Rival> {
    let weighted = choice.judged.iter().zip(choice.weights());
    let told = weighted.filter(|(_, weight)| *weight >= LEAST_WEIGHT);
    let rival = |(judged, weight): (&Judged, f64)| {
        let names: Vec<&str> = judged.fitted.law.terms.iter().map(|term| term.kind.name()).collect();
        Rival { terms: names.join(" + "), weight }
    };
    told.map(rival).collect()
}
