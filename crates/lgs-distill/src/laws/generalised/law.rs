//! The law of an object in generalised coordinates, with what is known of it.

use super::choice::{Chosen, choose_law};
use super::modal::choose_modal;
use super::observed::{Laws, ObservedPoses};
use crate::motion::pose::{Pose, PoseKind};
use crate::motion::shared_motion::SharedMotion;
use crate::thresholds::{
    EXPLAINED_WINDOWS, JUDGED_WINDOWS, LEAST_WEIGHT, RESIDUAL_TOLERANCE, STEP_ERROR, TIMES_IN_WINDOW,
    TRUSTED_FRACTION,
};
use glam::{DMat3, DVec3};
use lgs_core::geometry::narrow;
use lgs_mechanics::bands::{Band, Known, PositionBand, Rival, Verdict, trusted};
use lgs_mechanics::choose::{Choice, DESCRIBED, Judged};
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
    /// All laws in the same coordinates.
    pub(crate) choice: Choice,
}

/// Finds the law of a shared motion whose source does not resolve `resolution`, world units. Where no law
/// explains it, the source makes errors that its roughness does not tell of, and the simplest law within such
/// errors describes the motion.
pub(crate) fn find_law(
    motion: &SharedMotion,
    laws: Laws,
    resolution: f64,
    seed: u64,
) -> Option<GeneralisedLaw> {
    let found = law_within(motion, laws, Errors::resolving(resolution), seed)?;
    if found.known.chi_square <= DESCRIBED {
        return Some(found);
    }
    let smooth_errors = RESIDUAL_TOLERANCE * motion.rms_displacement();
    let described = law_within(motion, laws, Errors::resolving(resolution.max(smooth_errors)), seed);
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
    laws: Laws,
    errors: Errors,
    seed: u64,
) -> Option<GeneralisedLaw> {
    let resolution = errors.resolution.max(STEP_ERROR * motion.rms_displacement());
    let chosen = match motion.kind {
        PoseKind::Rigid => {
            let mut observed = ObservedPoses::new(motion, laws, resolution);
            let chosen = choose_law(&observed)?;
            if observed.allow_for(errors.slow, chosen.chi_square) {
                choose_law(&observed)
            } else {
                Some(chosen)
            }
        }
        PoseKind::Affine => choose_modal(motion, laws, resolution),
    };
    let Chosen { system, choice, chi_square } = chosen?;
    let fitted = choice.law().fitted.clone();
    let duration = motion.duration();
    let law = fitted.law.clone().resolved(&fitted.start, JUDGED_WINDOWS[1] * duration, STEP_ERROR).ok()?;
    let base = system.pose_in(&fitted.start.x);
    let mut found = GeneralisedLaw {
        window_error: 0.0,
        known: Known { chi_square, ..Known::default() },
        law,
        start: fitted.start,
        base,
        choice,
    };
    found.window_error = found.error_over(motion)?;
    found.judge(motion, seed);
    Some(found)
}

impl GeneralisedLaw {
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

    /// Laws in the same coordinates with a weight worth telling, the likeliest first.
    fn rivals(&self) -> Vec<Rival> {
        let weighted = self.choice.judged.iter().zip(self.choice.weights());
        let told = weighted.filter(|(_, weight)| *weight >= LEAST_WEIGHT);
        let rival = |(judged, weight): (&Judged, f64)| {
            let names: Vec<&str> = judged.fitted.law.terms.iter().map(|term| term.kind.name()).collect();
            Rival { terms: names.join(" + "), weight }
        };
        told.map(rival).collect()
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
    fn judge(&mut self, motion: &SharedMotion, seed: u64) {
        self.known.rivals = self.rivals();
        if self.known.chi_square > DESCRIBED {
            return;
        }
        self.known.verdict = Verdict::Described;
        let window = motion.duration();
        let spacing = window / TIMES_IN_WINDOW as f64;
        let [first, last] = JUDGED_WINDOWS.map(|windows| (windows * TIMES_IN_WINDOW as f64) as i32);
        let times: Vec<f64> = (first..=last).map(|i| f64::from(i) * spacing).collect();
        let Some(band) = Band::new(&self.choice, &times, seed) else { return };
        let points = motion.sigma_points();
        let radius = band.radius(0.9, &|a, b| self.distance(&points, a, b));
        let steps = band.middle.windows(2).map(|pair| self.distance(&points, &pair[0], &pair[1]));
        let path = steps.sum::<f64>() * window / (times[times.len() - 1] - times[0]);
        self.known.trusted = trusted(&times, &radius, [0.0, window], TRUSTED_FRACTION * path);
        if self.known.trusted[1] >= EXPLAINED_WINDOWS * window {
            self.known.verdict = Verdict::Explained;
        }
        let radius = radius.into_iter().map(|radius| radius.is_finite().then_some(radius)).collect();
        self.known.band = PositionBand { times, radius };
    }
}
