//! Stage 1 for one object: from its trajectories to its dynamics.

use crate::config::{CoordinatesKind, DistillConfig, DynamicsKind};
use crate::distilled::{Distilled, DistilledLaw, DistilledParticles};
use crate::error::DistillError;
use crate::laws::generalised::{
    Evidence, GeneralisedLaw, Laws, PartOfWindow, PartSearch, Surroundings, find_law,
};
use crate::motion::denoise::denoise;
use crate::motion::object_motion::ObjectMotion;
use crate::motion::pose::PoseKind;
use crate::motion::shared_motion::SharedMotion;
use crate::networks::per_particle::distill_networks;
use crate::particles::distill_particles;
use crate::progress::{DistillProgress, DistillStage};
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
    prepared.find_law(Surroundings::default(), config, seed);
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

    /// Seeks the law of a single body among points at rest, on which it may fall.
    pub(crate) fn find_law(&mut self, surroundings: Surroundings<'_>, config: &DistillConfig, seed: u64) {
        if let Self::Body(motion, law, parts) = self
            && let Some(motion) = &motion.shared
        {
            let motion = &motion.shared;
            *law = law_of(&[motion], surroundings, config, seed).map(Box::new);
            let will_do =
                |law: &GeneralisedLaw| law.is_within_noise() || law.known.trusted[1] > motion.duration();
            // Images show poses better than their source's tracks do: there, parts are sought in these.
            let is_from_images = config.unresolved() > 0.0;
            let is_rigid = motion.kind == PoseKind::Rigid;
            if !law.as_ref().is_some_and(|law| will_do(law)) && is_rigid && !is_from_images {
                let resolution = KNOWN_FRACTION * f64::from(config.forecast_tolerance);
                let impacts = law.as_ref().map_or_else(Vec::new, |law| known_impacts(&law.law, &law.known));
                **parts = parts_of(motion, &impacts, [resolution, 0.0], config, seed);
            }
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

/// Whether two objects can be one system of two bodies, by what is known of their own laws: not if these
/// explain both and one of them needs no force but a constant one, nor if one hits something, since laws of
/// two bodies have neither contact nor impulses. A force towards a place may be the other body's.
#[must_use]
pub fn may_be_a_pair(own: [Option<(&Law, &Known)>; 2]) -> bool {
    let is_explained = |(_, known): (&Law, &Known)| known.verdict == Verdict::Explained;
    let is_moved_alone = |(law, _): (&Law, &Known)| !law.has_varying_potential();
    let hits = |(law, known): (&Law, &Known)| !law.is_smooth() && known.verdict != Verdict::Outside;
    let any = |is: &dyn Fn((&Law, &Known)) -> bool| own.into_iter().flatten().any(is);
    let are_explained = own.iter().all(|law| law.is_some_and(is_explained));
    let are_apart = are_explained && any(&is_moved_alone);
    !are_apart && !any(&hits)
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

/// The law in generalised coordinates of one body, or of two that act on each other, where the configuration
/// wants one.
fn law_of(
    bodies: &[&SharedMotion],
    surroundings: Surroundings<'_>,
    config: &DistillConfig,
    seed: u64,
) -> Option<GeneralisedLaw> {
    let resolution = KNOWN_FRACTION * f64::from(config.forecast_tolerance);
    let found = find_law(bodies, (laws(config)?, surroundings), resolution, seed)?;
    tracing::debug!(law = ?found.law, known = ?found.known, "a law of the motion");
    Some(found)
}

/// The laws that the configuration admits.
pub(crate) fn laws(config: &DistillConfig) -> Option<Laws> {
    if config.coordinates == CoordinatesKind::Particles {
        return None;
    }
    Some(if config.force == ForceKind::None { Laws::Conservative } else { Laws::All })
}

/// Two objects that act on each other.
pub(crate) struct Couple {
    /// The law of both.
    pub(crate) law: DistilledLaw,
    /// The order in which its coordinates take them.
    pub(crate) order: [usize; 2],
    /// How much likelier it is than a law for each of them, in units of χ².
    pub(crate) gain: f64,
}

/// How much likelier a law of two bodies together is than a law for each of them, in units of χ²; `None` if
/// it is not.
pub(crate) fn gain(both: &GeneralisedLaw, [a, b]: [&GeneralisedLaw; 2]) -> Option<f64> {
    let (together, apart) = (both.evidence?, a.evidence?.and(b.evidence?));
    let inflation = Evidence::inflation([together, apart].into_iter());
    let gain = apart.score(inflation) - together.score(inflation);
    tracing::debug!(gain, inflation, ?together, ?apart, "two objects as one system?");
    (gain > 0.0).then_some(gain)
}

/// The law of two objects that may be a pair, if it describes them and is likelier than a law for each of
/// them.
pub(crate) fn couple(objects: [&Prepared; 2], config: &DistillConfig, seed: u64) -> Option<Couple> {
    let [a, b] = objects.map(|object| match object {
        Prepared::Body(motion, Some(law), _) => Some((motion, law)),
        _ => None,
    });
    let (a, b) = (a?, b?);
    if !may_be_a_pair([a.1, b.1].map(|law| Some((&law.law, &law.known)))) {
        return None;
    }
    let shared = [&a.0.shared.as_ref()?.shared, &b.0.shared.as_ref()?.shared];
    let found = law_of(&shared, Surroundings::default(), config, seed)?;
    if found.is_refuted || found.known.verdict == Verdict::Outside {
        return None;
    }
    let gain = gain(&found, [a.1, b.1])?;
    let order = [found.order[0], found.order[1]];
    let reports = [&a.0, &b.0].map(|motion| DistillReport::of_motion(motion));
    let law = found.distilled(&order.map(|i| shared[i]), &DistillReport::joined(&reports), config);
    law.report.describes_window(config).then_some(Couple { law, order, gain })
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

#[cfg(test)]
mod tests {
    use super::*;
    use lgs_mechanics::coordinates::{Coordinates, Port};
    use lgs_mechanics::terms::Term;

    #[test]
    fn a_force_towards_a_place_may_be_that_of_another_body() {
        let law = |name: &str, parameters: usize| {
            let term = Term::named(name, Port::Whole).unwrap();
            Law::new(Coordinates::Point, vec![term], vec![1.0; parameters], 0.1).unwrap()
        };
        let [falls, is_pulled] = [law("uniform-field", 3), law("central-inverse-square", 4)];
        let known = Known { verdict: Verdict::Explained, ..Known::default() };
        let may = |a, b| may_be_a_pair([Some((a, &known)), Some((b, &known))]);
        assert!(may(&is_pulled, &is_pulled));
        assert!(!may(&is_pulled, &falls) && !may(&falls, &falls));
        assert!(may_be_a_pair([Some((&falls, &known)), None]));
    }
}
