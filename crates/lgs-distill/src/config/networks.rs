//! Settings of the networks' training.

use serde::{Deserialize, Serialize};

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
        }
    }
}
