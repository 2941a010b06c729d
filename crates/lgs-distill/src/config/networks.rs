//! Settings of the networks' training.

use lgs_dynamics::VelocityPolicy;
use serde::{Deserialize, Serialize};

/// The trajectories that rollouts of the paper's networks learn from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum TargetKind {
    /// Those of the source model, as in the paper.
    #[default]
    Source,
    /// Those with the noise removed, by the motion that particles share (see
    /// [`super::DistillConfig::shared_motion`]) or particle by particle.
    Denoised,
}

/// Local rigid alignment inside of the rollouts (Eq. 6).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Alignment {
    /// Particles of a support, the particle itself among them.
    pub support: usize,
    /// Velocities after an alignment.
    pub velocity_policy: VelocityPolicy,
}

/// Acceleration matching of the networks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct MatchingConfig {
    /// Adam steps; 0 leaves it out, and networks learn from rollouts alone, as in the paper (Eq. 7).
    pub steps: usize,
    /// States per step.
    pub batch: usize,
    /// First learning rate; it falls to a hundredth along a cosine.
    pub learning_rate: f32,
    /// Weight of the mean squared force in the loss, accelerations in units of their scale.
    pub force_penalty: f32,
    /// Particles that states are drawn from, evenly over the object.
    pub particles: usize,
}

impl Default for MatchingConfig {
    fn default() -> Self {
        Self { steps: 600, batch: 256, learning_rate: 3e-3, force_penalty: 1e-4, particles: 256 }
    }
}

/// Rollout distillation (Eq. 7).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RolloutConfig {
    /// Adam steps; 0 leaves it out.
    pub steps: usize,
    /// Particles per step.
    pub particles: usize,
    /// First learning rate of U and Q; it falls to a hundredth along a cosine.
    pub learning_rate: f32,
    /// First learning rate of starting velocities, in units of the speed scale.
    pub velocity_learning_rate: f32,
    /// Weight of the mean squared force.
    pub force_penalty: f32,
    /// Samples of the first horizon; it grows to the whole window over the first half of the steps.
    pub first_horizon: usize,
    /// The paper's networks: positions that rollouts are compared with (Eq. 7), `source` or `denoised`.
    pub targets: TargetKind,
    /// The paper's networks: gradients reach back this many samples (truncated backpropagation); 0 reaches
    /// back to the first.
    pub window_steps: usize,
    /// The paper's networks, with truncation: every so many steps gradients reach back to the first sample,
    /// so that starting velocities learn from all of them; 0 is never.
    pub full_window_every: usize,
}

impl Default for RolloutConfig {
    fn default() -> Self {
        Self {
            steps: 60,
            particles: 96,
            learning_rate: 3e-4,
            velocity_learning_rate: 1e-3,
            force_penalty: 1e-4,
            first_horizon: 20,
            targets: TargetKind::Source,
            window_steps: 0,
            full_window_every: 0,
        }
    }
}

impl RolloutConfig {
    /// Eq. 7 from a random start: minutes on two processor cores. What the paper leaves open (learning rates,
    /// the growing horizon, the length of the truncation, that of stage 2) is our own choice.
    #[must_use]
    pub fn networks() -> Self {
        Self {
            steps: 300,
            particles: 192,
            learning_rate: 1e-3,
            velocity_learning_rate: 1e-2,
            force_penalty: 1e-4,
            first_horizon: 10,
            targets: TargetKind::Source,
            window_steps: 15,
            full_window_every: 4,
        }
    }
}
