//! Settings of stage 1.

mod networks;
mod partition;

pub use networks::{Alignment, MatchingConfig, RolloutConfig, TargetKind};
pub use partition::{PartitionConfig, PartitionMethod};

use crate::error::DistillError;
use crate::thresholds::{HIGHEST_DEGREE, UNRESOLVED_ERRORS, UNRESOLVED_FRACTION};
use burn::tensor::Device;
use lgs_dynamics::tensor::processor;
use lgs_dynamics::{ForceKind, PotentialKind};
use serde::{Deserialize, Serialize};
use std::fmt::Display;
use std::ops::RangeInclusive;

/// Which motion the particles of an object are taken to share when noise is removed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SharedMotionKind {
    /// By measurement: rigid, else affine, else none.
    #[default]
    Auto,
    /// One rotation and shift per sample.
    Rigid,
    /// One linear map and shift per sample.
    Affine,
    /// Every particle is smoothed by itself.
    None,
}

/// What moves objects.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DynamicsKind {
    /// Laws made of terms, chosen by evidence, and networks for what they leave.
    #[default]
    Terms,
    /// The paper's networks U and Q of every particle, learned by Eq. 7.
    Networks,
}

/// The coordinates in which objects move.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum CoordinatesKind {
    /// Those of joints and rigid bodies, where a law in them describes the motion; else those of particles.
    #[default]
    Generalised,
    /// Every particle by itself, as in the paper.
    Particles,
}

/// Stage 1 for one object. The default is the `quick` preset; [`Self::networks`] is the paper's system.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct DistillConfig {
    /// What moves objects: `terms`, or `networks` as published. It also decides the defaults of other keys
    /// (see [`Self::networks`]).
    pub dynamics: DynamicsKind,
    /// With `terms`: whether networks learn what laws of particles leave of an object's motion.
    pub neural_remainder: bool,
    /// Coordinates in which laws are looked for.
    pub coordinates: CoordinatesKind,
    /// Form of U.
    pub potential: PotentialKind,
    /// Form of Q.
    pub force: ForceKind,
    /// Hidden units.
    pub hidden: usize,
    /// Hidden layers.
    pub hidden_layers: usize,
    /// Motion that particles share.
    pub shared_motion: SharedMotionKind,
    /// A shared motion is taken if its residual is below 1.5 times the independent noise plus this part of
    /// the displacement.
    pub shared_residual: f32,
    /// Lowest degree of the polynomials that smooth a motion over time.
    pub lowest_degree: usize,
    /// Highest degree.
    pub highest_degree: usize,
    /// Part of the window that forecasts are measured on.
    pub held_out: f32,
    /// A simpler law is taken if its forecast error is at most this many times the best one's …
    pub forecast_slack: f32,
    /// The same for laws without a force: what a potential explains belongs to the potential, so only a
    /// clearly better forecast brings in a force.
    pub conservative_slack: f32,
    /// … plus this part of the root mean square displacement.
    pub forecast_floor: f32,
    /// … plus, for laws without a force, this, world units: what the source of the trajectories cannot
    /// resolve. Training from images adds a tenth of a pixel.
    pub forecast_tolerance: f32,
    /// Particles of the shared support by which Eq. 6 keeps a whole object rigid, at least 4; a support of
    /// that many costs no more than one of nearest neighbours.
    pub shared_support_size: usize,
    /// Whether objects may be under the rigid constraint (Eq. 6 with one support that all particles share):
    /// those whose law needs it, and those that follow their law as well with it. Without it every particle
    /// moves by itself.
    pub rigid_constraint: bool,
    /// Networks are fitted to what the linear law leaves only if its forecast error is above this part of the
    /// displacement.
    pub remainder_threshold: f32,
    /// Networks' acceleration matching.
    pub matching: MatchingConfig,
    /// Rollout distillation.
    pub rollout: RolloutConfig,
    /// Alignment inside of the rollouts of the paper's networks, as the scene will have it; none without.
    #[serde(skip)]
    pub alignment: Option<Alignment>,
    /// Where the paper's networks roll particles; all else is computed on the processor.
    #[serde(skip)]
    pub device: Device,
}

impl Default for DistillConfig {
    fn default() -> Self {
        Self {
            dynamics: DynamicsKind::Terms,
            neural_remainder: true,
            coordinates: CoordinatesKind::Generalised,
            potential: PotentialKind::QuadraticMlp,
            force: ForceKind::Structured,
            hidden: 32,
            hidden_layers: 3,
            shared_motion: SharedMotionKind::Auto,
            shared_residual: 0.08,
            lowest_degree: 2,
            highest_degree: 10,
            held_out: 0.2,
            forecast_slack: 1.25,
            conservative_slack: 2.0,
            forecast_floor: 1e-3,
            forecast_tolerance: 0.0,
            shared_support_size: 20,
            rigid_constraint: true,
            remainder_threshold: 0.04,
            matching: MatchingConfig::default(),
            rollout: RolloutConfig::default(),
            alignment: None,
            device: processor(),
        }
    }
}

impl DistillConfig {
    /// The paper's networks, in minutes on two processor cores: three hidden layers of 128, free-form U and
    /// Q, Eq. 7 alone on the source's own trajectories, no law and no constraint beside Eq. 6. Variants add
    /// acceleration matching (`matching.steps`), denoising (`rollout.targets`, `shared_motion`) or the
    /// structured force (`force`).
    #[must_use]
    pub fn networks() -> Self {
        Self {
            dynamics: DynamicsKind::Networks,
            coordinates: CoordinatesKind::Particles,
            potential: PotentialKind::Mlp,
            force: ForceKind::Mlp,
            hidden: 128,
            shared_motion: SharedMotionKind::None,
            rigid_constraint: false,
            matching: MatchingConfig { steps: 0, ..MatchingConfig::default() },
            rollout: RolloutConfig::networks(),
            ..Self::default()
        }
    }

    /// The same, trained long.
    #[must_use]
    pub fn paper() -> Self {
        let networks = Self::networks();
        let rollout = RolloutConfig { steps: 10_000, particles: 4096, ..networks.rollout.clone() };
        Self { rollout, ..networks }
    }

    /// The same for tracks from images, whose pixels span `pixel_size` at the scene (world units): forecasts
    /// that differ by less than a tenth of one are equally good.
    #[must_use]
    pub fn resolving(&self, pixel_size: f32) -> Self {
        let forecast_tolerance = self.forecast_tolerance + UNRESOLVED_FRACTION * pixel_size;
        Self { forecast_tolerance, ..self.clone() }
    }

    /// Whether laws in generalised coordinates are sought: not where the paper's particles or its networks
    /// are asked for.
    #[must_use]
    pub fn chooses_laws(&self) -> bool {
        self.coordinates != CoordinatesKind::Particles && self.dynamics != DynamicsKind::Networks
    }

    /// Errors of a place that no image shows, world units; 0 where the tracks are not from images.
    #[must_use]
    pub fn unresolved(&self) -> f64 {
        UNRESOLVED_ERRORS * f64::from(self.forecast_tolerance)
    }

    /// Range of smoothing degrees.
    pub(crate) fn degrees(&self) -> RangeInclusive<usize> {
        self.lowest_degree..=self.highest_degree
    }

    /// Number of a window's samples that forecasts are measured on, at least one and at most half of them.
    #[must_use]
    pub fn held_out_samples(&self, samples: usize) -> usize {
        ((samples as f32 * self.held_out) as usize).clamp(1, (samples / 2).max(1))
    }

    /// Checks the ranges.
    ///
    /// # Errors
    /// The first value out of range, by name.
    pub fn validate(&self) -> Result<(), DistillError> {
        let counts = [
            ("hidden", self.hidden, 1),
            ("hidden_layers", self.hidden_layers, 1),
            ("lowest_degree", self.lowest_degree, 2),
            ("highest_degree", self.highest_degree, self.lowest_degree),
            ("shared_support_size", self.shared_support_size, 4),
            ("matching.batch", self.matching.batch, 1),
            ("matching.particles", self.matching.particles, 1),
            ("rollout.particles", self.rollout.particles, 1),
        ];
        for (field, count, least) in counts {
            at_least(field, count, least)?;
        }
        let is_mixed =
            self.dynamics == DynamicsKind::Networks && self.coordinates != CoordinatesKind::Particles;
        if is_mixed {
            let expected = "`particles`, which the networks move".to_owned();
            return Err(out_of_range("coordinates", expected, &"`generalised`"));
        }
        within("highest_degree", self.highest_degree, 0..=HIGHEST_DEGREE)?;
        within("held_out", self.held_out, f32::MIN_POSITIVE..=0.5)?;
        at_least("forecast_slack", self.forecast_slack, 1.0)?;
        at_least("conservative_slack", self.conservative_slack, 1.0)?;
        at_least("forecast_floor", self.forecast_floor, 0.0)?;
        at_least("forecast_tolerance", self.forecast_tolerance, 0.0)?;
        at_least("shared_residual", self.shared_residual, 0.0)
    }
}

/// Checks a value against its lower bound.
fn at_least<T: PartialOrd + Display + Copy>(
    field: &'static str,
    found: T,
    least: T,
) -> Result<(), DistillError> {
    let expected = format!("at least {least}");
    if found >= least { Ok(()) } else { Err(out_of_range(field, expected, &found)) }
}

/// Checks a value against both of its bounds.
fn within<T: PartialOrd + Display + Copy>(
    field: &'static str,
    found: T,
    range: RangeInclusive<T>,
) -> Result<(), DistillError> {
    let expected = format!("between {} and {}", range.start(), range.end());
    if range.contains(&found) { Ok(()) } else { Err(out_of_range(field, expected, &found)) }
}

fn out_of_range(field: &'static str, expected: String, found: &dyn Display) -> DistillError {
    DistillError::Config { field, expected, found: found.to_string() }
}
