//! Laws of a part of the window: something is let go, or taken hold of, while it is watched, and no law
//! explains all that it does (method §5.4).

use super::Surroundings;
use super::choice::choose_law;
use super::known::GeneralisedLaw;
use super::law::smooth;
use super::observed::{Laws, ObservedPoses};
use crate::motion::shared_motion::SharedMotion;
use crate::thresholds::{BACKWARD, FEWEST_OF_PART, PART_SHARES};
use lgs_mechanics::FORECAST_ERROR;
use lgs_mechanics::bands::Verdict;
use lgs_mechanics::choose::DESCRIBED;
use std::ops::Range;

/// A law that explains some of the samples.
pub(crate) struct PartOfWindow {
    /// The samples.
    pub(crate) samples: Range<usize>,
    /// The law, with times since the first of them.
    pub(crate) law: GeneralisedLaw,
}

/// How laws of parts are sought.
#[derive(Clone, Copy)]
pub(crate) struct PartSearch<'a> {
    /// Which laws are admitted.
    pub(crate) laws: Laws,
    /// Length that the source of the tracks does not resolve, world units.
    pub(crate) resolution: f64,
    /// Size of errors that neighbouring poses have in common, world units.
    pub(crate) slow_error: f64,
    /// Times at which the velocity is known to change suddenly: no smooth law is of a part that holds one.
    pub(crate) impacts: &'a [f64],
    pub(crate) seed: u64,
}

impl PartSearch<'_> {
    /// The law of a part at the end of the window that forecasts thirds of its part best, among those that
    /// explain theirs.
    pub(crate) fn last(&self, motion: &SharedMotion) -> Option<PartOfWindow> {
        let samples = motion.times.len();
        let explains = |law: &GeneralisedLaw, _: f64| law.known.verdict == Verdict::Explained;
        self.best(motion, |count| samples - count..samples, explains)
    }

    /// The same at its beginning, of a law whose forecast is trusted as far backward.
    pub(crate) fn first(&self, motion: &SharedMotion) -> Option<PartOfWindow> {
        self.best(motion, |count| 0..count, is_carried_back)
    }

    /// The law of a part that is known, which the motion is of, if it explains it as that of the end of the
    /// window has to.
    pub(crate) fn last_part(&self, part: &SharedMotion) -> Option<GeneralisedLaw> {
        self.law(part).filter(|law| law.known.verdict == Verdict::Explained)
    }

    /// The same as that of its beginning has to.
    pub(crate) fn first_part(&self, part: &SharedMotion) -> Option<GeneralisedLaw> {
        self.law(part).filter(|law| is_carried_back(law, part.duration()))
    }

    fn best(
        &self,
        motion: &SharedMotion,
        part: impl Fn(usize) -> Range<usize>,
        explains: impl Fn(&GeneralisedLaw, f64) -> bool,
    ) -> Option<PartOfWindow> {
        let counts = PART_SHARES.map(|share| (motion.times.len() as f64 * share).round() as usize);
        let mut found: Vec<PartOfWindow> = Vec::new();
        for count in counts.into_iter().filter(|count| *count >= FEWEST_OF_PART) {
            let samples = part(count);
            let during = motion.times[samples.start]..motion.times[samples.end - 1];
            if self.impacts.iter().any(|time| during.contains(time)) {
                break;
            }
            let part = motion.part(samples.clone());
            // No law describes a longer part where none describes this one.
            let Some(law) = self.law(&part) else { break };
            if explains(&law, part.duration()) {
                found.push(PartOfWindow { samples, law });
            }
        }
        let error = |part: &PartOfWindow| part.law.known.forecast_error.unwrap_or(f64::INFINITY);
        found.into_iter().rev().min_by(|a, b| error(a).total_cmp(&error(b)))
    }

    /// The likeliest smooth law of a motion, if one describes it.
    fn law(&self, motion: &SharedMotion) -> Option<GeneralisedLaw> {
        let resolution = self.resolution.max(FORECAST_ERROR * motion.rms_displacement());
        let mut observed = ObservedPoses::new(motion, self.laws, resolution);
        let mut rated = choose_law(&observed)?;
        if observed.allow_for(self.slow_error, rated.chi_square()) {
            rated = choose_law(&observed)?;
        }
        if rated.chi_square() > DESCRIBED {
            return None;
        }
        smooth(&rated, (&[motion], Surroundings::default()), self.seed)
    }
}

/// Whether a law of a part of some duration is trusted half as far backward.
fn is_carried_back(law: &GeneralisedLaw, duration: f64) -> bool {
    law.known.verdict != Verdict::Outside && law.known.trusted[0] <= -BACKWARD * duration
}
