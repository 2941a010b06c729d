//! Stage 1 for one object: from its trajectories to its dynamics.

use crate::config::{CoordinatesKind, DistillConfig};
use crate::distilled::{Distilled, DistilledLaw};
use crate::error::DistillError;
use crate::laws::generalised::{GeneralisedLaw, Laws, find_law};
use crate::motion::denoise::denoise;
use crate::motion::object_motion::ObjectMotion;
use crate::particles::distill_particles;
use crate::progress::DistillProgress;
use crate::report::{DistillReport, GeneralisedReport};
use crate::thresholds::KNOWN_FRACTION;
use crate::trajectories::Trajectories;
use lgs_dynamics::ForceKind;
use lgs_mechanics::bands::Verdict;

/// Finds the dynamics behind an object's trajectories: a law in generalised coordinates if one describes its
/// motion, else a system of particles.
///
/// # Errors
/// If trajectories or configuration are malformed, or a fit left the finite numbers.
pub fn distill(
    trajectories: &Trajectories,
    config: &DistillConfig,
    seed: u64,
    progress: &mut dyn FnMut(DistillProgress),
) -> Result<Distilled, DistillError> {
    config.validate()?;
    trajectories.validate()?;
    if trajectories.is_empty() {
        return Err(DistillError::Empty);
    }
    let motion = denoise(trajectories, config);
    if let Some(law) = law_of(&motion, config, seed).map(|found| found.distilled(&motion, config))
        && law.report.describes_window(config)
    {
        return Ok(Distilled::Generalised(Box::new(law)));
    }
    Ok(Distilled::Particles(Box::new(distill_particles(motion, config, seed, progress)?)))
}

/// The law in generalised coordinates, where the configuration wants one and the particles share a motion.
fn law_of(motion: &ObjectMotion, config: &DistillConfig, seed: u64) -> Option<GeneralisedLaw> {
    let shared = motion.shared.as_ref().filter(|_| config.coordinates == CoordinatesKind::Generalised)?;
    let laws = if config.force == ForceKind::None { Laws::Conservative } else { Laws::All };
    let found = find_law(&shared.shared, laws, KNOWN_FRACTION * f64::from(config.forecast_tolerance), seed)?;
    tracing::debug!(law = ?found.law, found.chi_square, ?found.verdict, ?found.trusted, "a law of the motion");
    Some(found)
}

impl GeneralisedLaw {
    fn distilled(self, motion: &ObjectMotion, config: &DistillConfig) -> DistilledLaw {
        let shape = motion.shared.as_ref().map_or(&[][..], |motion| &motion.shared.shape);
        let (q0, v0) = self.initial_states(shape);
        let mut report = DistillReport {
            window_error: self.window_error,
            generalised: Some(GeneralisedReport {
                law: self.law.clone(),
                chi_square: self.chi_square,
                verdict: self.verdict,
                trusted: self.trusted,
                rivals: self.rivals(),
                band: self.band.clone(),
            }),
            ..DistillReport::of_motion(motion)
        };
        // Images do not show what is below their resolution, however well the tracks are known.
        let describes = report.describes_window(config);
        if let Some(law) =
            report.generalised.as_mut().filter(|law| describes && law.verdict == Verdict::Outside)
        {
            law.verdict = Verdict::Described;
        }
        DistilledLaw { law: self.law, start: self.start, q0, v0, report }
    }
}
