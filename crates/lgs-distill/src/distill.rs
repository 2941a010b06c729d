//! Stage 1 for one object: from its trajectories to U, Q and the initial state.
//!
//! Particles that share a motion are denoised together; a linear law is chosen by forecasts and fitted by
//! rollouts; networks learn what it leaves if that is worth it (or everything, in the paper's configuration),
//! and stay only if they forecast better.

use crate::config::DistillConfig;
use crate::report::DistillReport;
use crate::seen::Seen;
use crate::{DistillError, Trajectories};
use lgs_dynamics::{Supports, System};

/// How far stage 1 of an object is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DistillProgress {
    /// What is being done.
    pub stage: DistillStage,
    /// Steps done of it.
    pub step: usize,
    /// Steps in all.
    pub steps: usize,
    /// Loss of the step, if it has one.
    pub loss: Option<f32>,
}

/// Parts of stage 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DistillStage {
    /// Shared motion and linear law.
    Law,
    /// Acceleration matching of networks.
    Matching,
    /// Rollout distillation.
    Rollout,
}

/// A system with the state it starts from.
#[derive(Clone, Debug)]
pub struct Distilled {
    /// U and Q.
    pub system: System,
    /// Positions at the first sample, world units.
    pub q0: Vec<[f32; 3]>,
    /// Velocities that Eq. 5 starts from, world units per unit of time.
    pub v0: Vec<[f32; 3]>,
    /// Particles that hold the object together as the common support of all, if its law needs that.
    pub anchors: Option<Vec<u32>>,
    /// What was found.
    pub report: DistillReport,
}

impl Distilled {
    /// Supports for Eq. 6: the anchors for every particle where the law was fitted to a rigid body, else `k`
    /// nearest neighbours.
    ///
    /// Anchored supports belong with [`lgs_dynamics::VelocityPolicy::Rigid`].
    #[must_use]
    pub fn supports(&self, k: usize) -> Supports {
        match &self.anchors {
            Some(anchors) => anchored_supports(anchors, self.q0.len()),
            None => Supports::nearest(&self.q0, k),
        }
    }

    /// The same with its particles in another order: index of the first, of the second, …, each particle
    /// once.
    #[must_use]
    pub fn in_order(self, order: &[u32]) -> Self {
        let mut place = vec![0; order.len()];
        for (at, &particle) in (0..).zip(order) {
            place[particle as usize] = at;
        }
        let rows = |of_particles: &[[f32; 3]]| {
            order.iter().map(|&particle| of_particles[particle as usize]).collect()
        };
        let anchors =
            self.anchors.map(|anchors| anchors.iter().map(|&anchor| place[anchor as usize]).collect());
        Self { q0: rows(&self.q0), v0: rows(&self.v0), anchors, ..self }
    }
}

/// Supports with the same members for all `particles`, which makes Eq. 6 a rigid motion of the whole object.
#[must_use]
pub fn anchored_supports(anchors: &[u32], particles: usize) -> Supports {
    let rows = anchors.repeat(particles);
    // Indices come from the same object; an empty row is the only way to fail and falls back to single-point
    // supports.
    Supports::from_rows(rows, anchors.len())
        .unwrap_or_else(|_| Supports::nearest(&vec![[0.0; 3]; particles], 1))
}

/// Finds the system behind an object's trajectories. `weights` say how much each particle counts (opacity,
/// size).
///
/// # Errors
/// If trajectories, weights or configuration are malformed, or a fit left the finite numbers.
pub fn distill(
    trajectories: &Trajectories,
    weights: Option<&[f32]>,
    config: &DistillConfig,
    seed: u64,
    progress: &mut dyn FnMut(DistillProgress),
) -> Result<Distilled, DistillError> {
    config.validate()?;
    trajectories.validate()?;
    if trajectories.is_empty() {
        return Err(DistillError::Empty);
    }
    if let Some(found) = weights.map(<[f32]>::len).filter(|&len| len != trajectories.len()) {
        return Err(DistillError::Length { field: "weights", expected: trajectories.len(), found });
    }
    progress(DistillProgress { stage: DistillStage::Law, step: 0, steps: 1, loss: None });
    let seen = Seen::new(trajectories, weights, config);
    let law = seen.choose_law(config);
    progress(DistillProgress { stage: DistillStage::Law, step: 1, steps: 1, loss: None });
    let mut distilled = match &law {
        Some(chosen) => seen.of_law(chosen, config, seed),
        None => seen.plain(config, seed),
    };
    let unexplained = distilled
        .report
        .forecast_error
        .is_none_or(|e| e > f64::from(config.remainder_threshold) * seen.displacement);
    if unexplained {
        seen.train_networks(&mut distilled, config, seed, progress);
    }
    if let Some(held) = law.and_then(|chosen| chosen.held).filter(|_| !distilled.report.networks) {
        seen.hold(&mut distilled, &held);
    }
    let finite = |rows: &[[f32; 3]]| rows.as_flattened().iter().all(|v| v.is_finite());
    if !(finite(&distilled.q0)
        && finite(&distilled.v0)
        && distilled.system.params.iter().all(|p| p.is_finite()))
    {
        return Err(DistillError::Diverged { stage: "distillation" });
    }
    distilled.report.force_ratio = seen.force_ratio(&distilled.system);
    Ok(distilled)
}
