//! Stage 1 for one object: from its trajectories to its dynamics.

use crate::config::{CoordinatesKind, DistillConfig, DynamicsKind};
use crate::distilled::{Distilled, DistilledLaw};
use crate::error::DistillError;
use crate::laws::generalised::{Errors, GeneralisedLaw, Laws, Surroundings, find_law, law_within};
use crate::motion::denoise::denoise;
use crate::motion::object_motion::ObjectMotion;
use crate::motion::pose::{Pose, PoseKind};
use crate::motion::shared_motion::SharedMotion;
use crate::networks::per_particle::distill_networks;
use crate::particles::distill_particles;
use crate::progress::{DistillProgress, DistillStage};
use crate::report::{DistillReport, GeneralisedReport};
use crate::thresholds::KNOWN_FRACTION;
use crate::trajectories::Trajectories;
use glam::{DMat3, DVec3};
use lgs_dynamics::ForceKind;
use lgs_mechanics::bands::Verdict;

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
    distill_among(trajectories, &[], config, seed, progress)
}

/// The same for an object among points at rest, on which it may fall.
pub(crate) fn distill_among(
    trajectories: &Trajectories,
    surroundings: Surroundings<'_>,
    config: &DistillConfig,
    seed: u64,
    progress: &mut dyn FnMut(DistillProgress),
) -> Result<Distilled, DistillError> {
    config.validate()?;
    trajectories.validate()?;
    if trajectories.is_empty() {
        return Err(DistillError::Empty);
    }
    if config.dynamics == DynamicsKind::Networks {
        let found = distill_networks(trajectories, config, seed, progress)?;
        return Ok(Distilled::Particles(Box::new(found)));
    }
    let motion = denoise(trajectories, config);
    progress(DistillProgress { stage: DistillStage::Law, step: 0, steps: 1, loss: None });
    if let Some(law) = law_of(&motion, surroundings, config, seed)
        && law.report.describes_window(config)
    {
        return Ok(Distilled::Generalised(Box::new(law)));
    }
    Ok(Distilled::Particles(Box::new(distill_particles(motion, config, seed, progress)?)))
}

/// The law in generalised coordinates, where the configuration wants one and the particles share a motion.
fn law_of(
    motion: &ObjectMotion,
    surroundings: Surroundings<'_>,
    config: &DistillConfig,
    seed: u64,
) -> Option<DistilledLaw> {
    let shared = &motion.shared.as_ref()?.shared;
    let resolution = KNOWN_FRACTION * f64::from(config.forecast_tolerance);
    let find = |laws| find_law(shared, (laws, surroundings), resolution, seed);
    law_of_motion(shared, &DistillReport::of_motion(motion), config, find)
}

fn law_of_motion(
    motion: &SharedMotion,
    report: &DistillReport,
    config: &DistillConfig,
    find: impl FnOnce(Laws) -> Option<GeneralisedLaw>,
) -> Option<DistilledLaw> {
    if config.coordinates == CoordinatesKind::Particles {
        return None;
    }
    let laws = if config.force == ForceKind::None { Laws::Conservative } else { Laws::All };
    let found = find(laws)?;
    tracing::debug!(law = ?found.law, known = ?found.known, "a law of the motion");
    // Images put a rigid body right that its tracks have a little wrong, but not a shape.
    if motion.kind == PoseKind::Affine && found.known.verdict == Verdict::Outside {
        return None;
    }
    Some(found.distilled(&motion.shape, report, config))
}

/// Poses of a rigid body, each seen by itself.
#[derive(Clone, Debug)]
pub struct BodyPoses {
    /// Ascending times, normalised; the first is the start.
    pub times: Vec<f64>,
    /// Linear part and shift that take each point of the shape to where it is, one for each time.
    pub poses: Vec<(DMat3, DVec3)>,
    /// Points of the body.
    pub shape: Vec<DVec3>,
    /// Size of errors that the poses have in common with their neighbours in time, world units, as far as it
    /// is known; 0 if there are none.
    pub slow_error: f64,
    /// Places of points at rest, on which the body may fall.
    pub surroundings: Vec<[f64; 3]>,
}

/// Finds the law behind the poses of a rigid body. `None` if there is no law that stays with them, or the
/// configuration wants none.
#[must_use]
pub fn law_of_poses(observed: BodyPoses, config: &DistillConfig, seed: u64) -> Option<DistilledLaw> {
    let BodyPoses { times, poses, shape, slow_error, surroundings } = observed;
    let weights = vec![(shape.len() as f64).recip(); shape.len()];
    let poses = poses.into_iter().map(|(linear, shift)| Pose { linear, shift }).collect();
    let motion = SharedMotion { kind: PoseKind::Rigid, times, poses, shape, weights, residual: 0.0 };
    let report = DistillReport::of_poses(&motion);
    let errors = Errors { resolution: 0.0, slow: slow_error };
    let find = |laws| law_within(&motion, (laws, &surroundings), errors, seed);
    law_of_motion(&motion, &report, config, find).filter(|law| law.report.describes_window(config))
}

impl GeneralisedLaw {
    fn distilled(self, shape: &[DVec3], before: &DistillReport, config: &DistillConfig) -> DistilledLaw {
        let (q0, v0) = self.initial_states(shape);
        let mut report = DistillReport {
            window_error: self.window_error,
            generalised: Some(GeneralisedReport { law: self.law.clone(), known: self.known.clone() }),
            ..before.clone()
        };
        // Images do not show what is below their resolution, however well the tracks are known.
        let describes = self.law.contact.is_none() && report.describes_window(config);
        if let Some(law) =
            report.generalised.as_mut().filter(|law| describes && law.known.verdict == Verdict::Outside)
        {
            law.known.verdict = Verdict::Described;
        }
        let known = report.generalised.as_ref().map(|law| law.known.clone()).unwrap_or_default();
        let base = (self.base.linear, self.base.shift);
        DistilledLaw { law: self.law, start: self.start, base, known, q0, v0, report }
    }
}
