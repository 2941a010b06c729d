//! The search for the law of an object in two parts: within the noise of the poses and, where no law explains
//! them, within the errors that a source makes.

use super::known::GeneralisedLaw;
use super::law::{Around, Errors, has_impacts, law_within};
use crate::motion::shared_motion::SharedMotion;
use crate::thresholds::{BEYOND_SMOOTH, RESIDUAL_TOLERANCE};
use lgs_mechanics::bands::Verdict;
use lgs_mechanics::choose::DESCRIBED;

/// Finds the law of shared motions at the same times, whose source does not resolve `resolution`, world
/// units: of one body, or of two that act on each other; where no law explains them, within the errors that
/// a source makes ([`within_errors`]).
pub(crate) fn find_law(
    bodies: &[&SharedMotion],
    around: Around<'_>,
    resolution: f64,
    seed: u64,
) -> Option<GeneralisedLaw> {
    let found = within_noise(bodies, around, resolution, seed)?;
    let allows = found.leaves_errors(bodies);
    let within = allows.then(|| within_errors(bodies, around, resolution, seed)).flatten();
    Some(found.replaced_by(within))
}

/// The law of shared motions whose poses have no errors but those that their scatter tells of, and what their
/// source does not resolve.
pub(crate) fn within_noise(
    bodies: &[&SharedMotion],
    around: Around<'_>,
    resolution: f64,
    seed: u64,
) -> Option<GeneralisedLaw> {
    law_within(bodies, around, Errors::resolving(resolution), seed)
}

/// The simplest law within the errors of a source that its roughness does not tell of, if there is one: it
/// describes the motion.
pub(crate) fn within_errors(
    bodies: &[&SharedMotion],
    around: Around<'_>,
    resolution: f64,
    seed: u64,
) -> Option<GeneralisedLaw> {
    let smooth_errors = RESIDUAL_TOLERANCE * SharedMotion::rms_displacement_of(bodies);
    let allowance = Errors { is_allowance: true, ..Errors::resolving(resolution.max(smooth_errors)) };
    // A law that leaves the motion by more than was allowed is none of it, though it is simpler.
    let stays = |law: &GeneralisedLaw| !law.law.is_smooth() || law.window_error <= allowance.resolution;
    let mut law = law_within(bodies, around, allowance, seed)?;
    if law.known.chi_square > DESCRIBED || !stays(&law) {
        return None;
    }
    law.known.verdict = Verdict::Described;
    Some(GeneralisedLaw { is_within_allowance: true, ..law })
}

impl GeneralisedLaw {
    /// Whether it leaves of shared motions what may be errors of their source.
    pub(crate) fn leaves_errors(&self, bodies: &[&SharedMotion]) -> bool {
        let smooth_errors = RESIDUAL_TOLERANCE * SharedMotion::rms_displacement_of(bodies);
        // No smooth law comes nearer; one through impacts, whose samples are smeared, may.
        let is_beyond = self.window_error > BEYOND_SMOOTH * smooth_errors;
        self.known.chi_square > DESCRIBED && (!is_beyond || bodies.iter().any(|body| has_impacts(body)))
    }

    /// The law within errors that takes its place, judged against others by what speaks for this one.
    pub(crate) fn replaced_by(self, within: Option<Self>) -> Self {
        match within {
            Some(law) => Self { evidence: self.evidence, ..law },
            None => self,
        }
    }
}
