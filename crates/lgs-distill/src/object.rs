//! Stage 1 for one object: from its trajectories to its dynamics.

use crate::config::{CoordinatesKind, DistillConfig, DynamicsKind};
use crate::distilled::{Distilled, DistilledLaw, DistilledParticles};
use crate::error::DistillError;
use crate::laws::generalised::{
    GeneralisedLaw, Laws, PartOfWindow, PartSearch, Surroundings, within_errors, within_noise,
};
use crate::motion::denoise::denoise;
use crate::motion::object_motion::ObjectMotion;
use crate::motion::pose::PoseKind;
use crate::motion::shared_motion::SharedMotion;
use crate::networks::per_particle::distill_networks;
use crate::particles::distill_particles;
use crate::progress::{DistillProgress, DistillStage, LawSearch};
use crate::report::{DistillReport, GeneralisedReport, PartLaw, PartLaws};
use crate::thresholds::KNOWN_FRACTION;
use crate::trajectories::Trajectories;
use glam::DVec3;
use lgs_dynamics::ForceKind;
use lgs_mechanics::bands::{Known, Verdict};
use lgs_mechanics::coordinates::Bodies;
use lgs_mechanics::{Law, TRUSTED_FRACTION};

/// Finds the dynamics behind an object's trajectories: a law in generalised coordinates if one describes its
/// motion, else a system of particles; or the paper's networks, if the configuration asks for them.
///
/// # Errors
/// If trajectories or configuration are malformed, or a fit left the finite numbers.
pub fn distill(
    trajectories: &Trajectories,
    config: &DistillConfig,
    seed: u64,
    progress: &mut dyn FnMut(DistillProgress),
) -> Result<Distilled, DistillError> {
    let mut prepared = Prepared::new(trajectories, (config, seed), progress)?;
    for search in LawSearch::OF_OBJECT {
        prepared.seek(search, Surroundings::default(), config, seed);
    }
    prepared.distilled((config, seed), None, progress)
}

/// Checks what an object is distilled from: well-formed trajectories, of one particle at least.
pub(crate) fn check(trajectories: &Trajectories, config: &DistillConfig) -> Result<(), DistillError> {
    config.validate()?;
    trajectories.validate()?;
    if trajectories.is_empty() { Err(DistillError::Empty) } else { Ok(()) }
}

/// An object before it is known whether it moves by itself.
pub(crate) enum Prepared {
    /// The paper's networks.
    Networks(Box<Distilled>),
    /// Its denoised motion, the law of it as that of a single body, and laws of parts of the window.
    Body(Box<ObjectMotion>, Option<Box<GeneralisedLaw>>, Box<PartLaws>),
}

impl Prepared {
    /// Denoises trajectories, or trains the paper's networks on them.
    pub(crate) fn new(
        trajectories: &Trajectories,
        (config, seed): (&DistillConfig, u64),
        progress: &mut dyn FnMut(DistillProgress),
    ) -> Result<Self, DistillError> {
        check(trajectories, config)?;
        if config.dynamics == DynamicsKind::Networks {
            let found = distill_networks(trajectories, config, seed, progress)?;
            return Ok(Self::Networks(Box::new(Distilled::Particles(Box::new(found)))));
        }
        let motion = denoise(trajectories, config);
        progress(DistillProgress { stage: DistillStage::Law, step: 0, steps: 1, loss: None });
        Ok(Self::Body(Box::new(motion), None, Box::default()))
    }

    /// Goes through one of the searches for the law of a single body, among points at rest on which it may
    /// fall.
    pub(crate) fn seek(
        &mut self,
        search: LawSearch,
        surroundings: Surroundings<'_>,
        config: &DistillConfig,
        seed: u64,
    ) {
        if !self.is_open_to(search, config) {
            return;
        }
        let Self::Body(motion, law, parts) = self else { return };
        let (Some(motion), Some(laws)) = (&motion.shared, laws(config)) else { return };
        let (motion, resolution) = (&motion.shared, resolution(config));
        let around = (laws, surroundings);
        match search {
            LawSearch::WithinNoise => *law = within_noise(&[motion], around, resolution, seed).map(Box::new),
            LawSearch::WithinErrors => {
                let within = within_errors(&[motion], around, resolution, seed);
                *law = law.take().map(|law| Box::new(law.replaced_by(within)));
            }
            LawSearch::OfParts => {
                let impacts = law.as_ref().map_or_else(Vec::new, |law| known_impacts(&law.law, &law.known));
                **parts = parts_of(motion, &impacts, [resolution, 0.0], config, seed);
            }
            LawSearch::OfPairs => {}
        }
    }

    /// Whether what has been found so far leaves a search for a law of this object alone something to find.
    pub(crate) fn is_open_to(&self, search: LawSearch, config: &DistillConfig) -> bool {
        let Self::Body(motion, law, _) = self else { return false };
        let Some(motion) = motion.shared.as_ref().map(|motion| &motion.shared) else { return false };
        match search {
            LawSearch::WithinNoise => true,
            LawSearch::WithinErrors => law.as_ref().is_some_and(|law| law.leaves_errors(&[motion])),
            LawSearch::OfParts => {
                let will_do =
                    |law: &GeneralisedLaw| law.is_within_noise() || law.known.trusted[1] > motion.duration();
                // Images show poses better than their source's tracks do: there, parts are sought in these.
                let is_from_images = config.unresolved() > 0.0;
                let is_rigid = motion.kind == PoseKind::Rigid;
                !law.as_ref().is_some_and(|law| will_do(law)) && is_rigid && !is_from_images
            }
            LawSearch::OfPairs => false,
        }
    }

    /// The motion of a body with a law of it, if one has been found.
    pub(crate) fn law(&self) -> Option<(&ObjectMotion, &GeneralisedLaw)> {
        match self {
            Self::Body(motion, Some(law), _) => Some((motion, law)),
            _ => None,
        }
    }

    /// The object by its own law, or as particles where that does not describe it; `known` is what they are,
    /// if that has been found before.
    pub(crate) fn distilled(
        self,
        (config, seed): (&DistillConfig, u64),
        known: Option<&DistilledParticles>,
        progress: &mut dyn FnMut(DistillProgress),
    ) -> Result<Distilled, DistillError> {
        let (motion, law, parts) = match self {
            Self::Networks(found) => return Ok(*found),
            Self::Body(motion, law, parts) => (motion, law, parts),
        };
        let law = law.filter(|law| !parts.forecast_better(&law.known));
        if let (Some(law), Some(shared)) = (law.filter(|law| !law.is_refuted), &motion.shared) {
            // Images put a rigid body right that its tracks have a little wrong, but not a shape.
            let is_open = shared.shared.kind == PoseKind::Rigid || law.known.verdict != Verdict::Outside;
            let law = law.distilled(&[&shared.shared], &DistillReport::of_motion(&motion), config);
            if is_open && law.report.describes_window(config) {
                return Ok(Distilled::Generalised(Box::new(law)));
            }
        }
        let mut particles = match known {
            Some(known) => known.clone(),
            None => distill_particles(*motion, config, seed, progress)?,
        };
        particles.report.parts = *parts;
        Ok(Distilled::Particles(Box::new(particles)))
    }
}

impl PartLaws {
    /// Whether one of them forecasts better than a law of all the window, of which so much is known, and
    /// whose own forecasts are not to be trusted.
    #[must_use]
    pub fn forecast_better(&self, all: &Known) -> bool {
        let error = |known: &Known| known.forecast_error.unwrap_or(f64::INFINITY);
        let least = [&self.first, &self.last].into_iter().flatten().map(|part| error(&part.known));
        error(all) > TRUSTED_FRACTION && least.fold(f64::INFINITY, f64::min) < error(all)
    }
}

/// Times of the impacts and impulses that a law tells of, ascending, if it describes the motion.
#[must_use]
pub fn known_impacts(law: &Law, known: &Known) -> Vec<f64> {
    if known.verdict == Verdict::Outside {
        return Vec::new();
    }
    let mut times: Vec<f64> = law.events().map(|event| event.time).collect();
    times.sort_by(f64::total_cmp);
    times
}

/// Laws of parts of the window that explain these, where the source does not resolve a length, and errs
/// slowly by another one.
pub(crate) fn parts_of(
    motion: &SharedMotion,
    impacts: &[f64],
    [resolution, slow_error]: [f64; 2],
    config: &DistillConfig,
    seed: u64,
) -> PartLaws {
    let Some(laws) = laws(config) else { return PartLaws::default() };
    let search = PartSearch { laws, resolution, slow_error, impacts, seed };
    let told = |part: PartOfWindow| {
        let PartOfWindow { samples, law: GeneralisedLaw { law, start, known, .. } } = part;
        tracing::debug!(?samples, ?law, "a law of a part of the window");
        PartLaw {
            times: [samples.start, samples.end - 1].map(|sample| motion.times[sample]),
            law,
            start,
            known,
        }
    };
    let (first, last) = rayon::join(|| search.first(motion), || search.last(motion));
    PartLaws { first: first.map(told), last: last.map(told) }
}

/// Length that the source of tracks does not resolve, world units.
pub(crate) fn resolution(config: &DistillConfig) -> f64 {
    KNOWN_FRACTION * f64::from(config.forecast_tolerance)
}

/// The laws that the configuration admits.
pub(crate) fn laws(config: &DistillConfig) -> Option<Laws> {
    if config.coordinates == CoordinatesKind::Particles {
        return None;
    }
    Some(if config.force == ForceKind::None { Laws::Conservative } else { Laws::All })
}

impl GeneralisedLaw {
    /// The same for its bodies, in the order of its coordinates.
    pub(crate) fn distilled(
        self,
        bodies: &[&SharedMotion],
        before: &DistillReport,
        config: &DistillConfig,
    ) -> DistilledLaw {
        let shapes: Vec<&[DVec3]> = bodies.iter().map(|motion| motion.shape.as_slice()).collect();
        let (q0, v0) = self.initial_states(&shapes);
        let mut report = DistillReport {
            window_error: self.window_error,
            generalised: Some(GeneralisedReport { law: self.law.clone(), known: self.known.clone() }),
            ..before.clone()
        };
        // Images do not show what is below their resolution, however well the tracks are known.
        let describes = self.law.is_smooth() && report.describes_window(config);
        if let Some(law) =
            report.generalised.as_mut().filter(|law| describes && law.known.verdict == Verdict::Outside)
        {
            law.known.verdict = Verdict::Described;
        }
        let known = report.generalised.as_ref().map(|law| law.known.clone()).unwrap_or_default();
        let bases = self.bases.iter().map(|base| (base.linear, base.shift)).collect();
        let bodies = Bodies::of_sizes(&shapes.iter().map(|shape| shape.len()).collect::<Vec<_>>());
        DistilledLaw { law: self.law, start: self.start, bodies, bases, known, q0, v0, report }
    }
}
