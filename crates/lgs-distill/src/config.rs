//! Settings of stage 1.

use crate::DistillError;
use lgs_dynamics::{ForceKind, PotentialKind};
use serde::{Deserialize, Serialize};

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

/// How moving particles are grouped into objects.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PartitionMethod {
    /// Connected components of the graph of neighbours that move together (G14), refined by regrouping.
    #[default]
    Graph,
    /// k-means on displacements and first positions, into a given number of clusters (G15).
    KMeans,
}

/// Static/moving split and objects (0.01 rule, G14).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PartitionConfig {
    /// Graph or k-means.
    pub method: PartitionMethod,
    /// Objects that k-means looks for (G15: 1, but 2 on `fan`, 3 on `bat`, 10, 6, 10, 6 indoors).
    pub clusters: usize,
    /// A particle that never gets farther than this from its first position is static, world units.
    pub static_displacement: f32,
    /// Neighbours per particle in the graph of moving ones.
    pub neighbors: usize,
    /// An edge may change its length by this part of it …
    pub length_tolerance: f32,
    /// … plus this, world units, plus three times the noise that smoothing leaves.
    pub length_slack: f32,
    /// Root mean square difference of two displacements, as a part of the larger one, up to which an edge
    /// holds.
    pub displacement_tolerance: f32,
    /// Smaller components join the nearest object.
    pub smallest_object: usize,
    /// Objects whose root mean square displacement is below this part of the largest one's are static: a
    /// source's surroundings are never quite still.
    pub negligible_motion: f32,
    /// Where there are images: objects whose rest would raise the mean squared error of the source's images
    /// by less than this part are static, unless nothing else raises it much more (G14: 0, none). Plain walls
    /// slide along themselves, which no image tells from rest.
    pub unseen_motion: f32,
    /// Rounds in which particles go to the motion that explains them best; 0 leaves the graph's objects as
    /// they are (G14).
    pub regroup_rounds: usize,
    /// Degree of the polynomial that smooths each particle's path before the tests; 0 leaves it as it is.
    pub smoothing_degree: usize,
}

impl Default for PartitionConfig {
    fn default() -> Self {
        Self {
            method: PartitionMethod::Graph,
            clusters: 1,
            static_displacement: 0.01,
            neighbors: 16,
            length_tolerance: 0.1,
            length_slack: 0.002,
            displacement_tolerance: 0.25,
            smallest_object: 50,
            negligible_motion: 0.08,
            unseen_motion: 0.6,
            regroup_rounds: 4,
            smoothing_degree: 6,
        }
    }
}

impl PartitionConfig {
    /// Checks the counts.
    ///
    /// # Errors
    /// The key and the reason.
    pub fn validate(&self) -> Result<(), (&'static str, String)> {
        for (key, count) in [("clusters", self.clusters), ("neighbors", self.neighbors)] {
            if count == 0 {
                return Err((key, "0 is below 1".to_owned()));
            }
        }
        for (key, part) in
            [("negligible_motion", self.negligible_motion), ("unseen_motion", self.unseen_motion)]
        {
            if !(part.is_finite() && part >= 0.0) {
                return Err((key, format!("{part} is negative or not finite")));
            }
        }
        Ok(())
    }
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
    /// Weight of the mean squared force in the loss, accelerations in units of their scale (G30).
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
    /// Weight of the mean squared force (G30).
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

/// Stage 1 for one object. The default is the `quick` preset; [`Self::paper`] is the paper's system.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct DistillConfig {
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
    /// Part of the window that forecasts are judged on.
    pub held_out: f32,
    /// A simpler law is taken if its forecast error is at most this many times the best one's …
    pub forecast_slack: f32,
    /// The same for laws without a force: what a potential explains belongs to the potential (G42), so only a
    /// clearly better forecast brings in a force.
    pub conservative_slack: f32,
    /// … plus this part of the root mean square displacement.
    pub forecast_floor: f32,
    /// … plus, for laws without a force, this, world units: what the source of the trajectories cannot
    /// resolve. Training from images adds a tenth of a pixel.
    pub forecast_tolerance: f32,
    /// Particles that hold a rigid object together, at least 4; a support of that many costs no more than one
    /// of nearest neighbours.
    pub anchors: usize,
    /// Whether bodies may be held rigid by one support, for laws that need it and for those that they follow
    /// as well so; without it every particle moves by itself.
    pub rigid_constraint: bool,
    /// Networks are fitted to what the linear law leaves only if its forecast error is above this part of the
    /// displacement.
    pub remainder_threshold: f32,
    /// Networks' acceleration matching.
    pub matching: MatchingConfig,
    /// Rollout distillation.
    pub rollout: RolloutConfig,
}

impl Default for DistillConfig {
    fn default() -> Self {
        Self {
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
            anchors: 20,
            rigid_constraint: true,
            remainder_threshold: 0.04,
            matching: MatchingConfig::default(),
            rollout: RolloutConfig::default(),
        }
    }
}

impl DistillConfig {
    /// The paper's networks (three hidden layers of 128, free-form U and Q), trained long.
    #[must_use]
    pub fn paper() -> Self {
        Self {
            potential: PotentialKind::Mlp,
            force: ForceKind::Mlp,
            hidden: 128,
            matching: MatchingConfig {
                steps: 3000,
                batch: 512,
                learning_rate: 2e-3,
                force_penalty: 1e-3,
                particles: 4096,
            },
            rollout: RolloutConfig {
                steps: 400,
                particles: 512,
                learning_rate: 1e-4,
                first_horizon: 10,
                ..RolloutConfig::default()
            },
            ..Self::default()
        }
    }

    /// Range of smoothing degrees.
    pub(crate) fn degrees(&self) -> std::ops::RangeInclusive<usize> {
        self.lowest_degree..=self.highest_degree
    }

    /// Checks the ranges.
    ///
    /// # Errors
    /// The first value out of range, by name.
    pub fn validate(&self) -> Result<(), DistillError> {
        let checks = [
            (self.hidden > 0, "hidden", "at least 1", self.hidden.to_string()),
            (self.hidden_layers > 0, "hidden_layers", "at least 1", self.hidden_layers.to_string()),
            (self.lowest_degree >= 2, "lowest_degree", "at least 2", self.lowest_degree.to_string()),
            (
                (self.lowest_degree..=14).contains(&self.highest_degree),
                "highest_degree",
                "between lowest_degree and 14",
                self.highest_degree.to_string(),
            ),
            (
                self.held_out > 0.0 && self.held_out <= 0.5,
                "held_out",
                "in (0, 0.5]",
                self.held_out.to_string(),
            ),
            (self.forecast_slack >= 1.0, "forecast_slack", "at least 1", self.forecast_slack.to_string()),
            (
                self.conservative_slack >= 1.0,
                "conservative_slack",
                "at least 1",
                self.conservative_slack.to_string(),
            ),
            (self.forecast_floor >= 0.0, "forecast_floor", "at least 0", self.forecast_floor.to_string()),
            (
                self.forecast_tolerance >= 0.0,
                "forecast_tolerance",
                "at least 0",
                self.forecast_tolerance.to_string(),
            ),
            (self.shared_residual >= 0.0, "shared_residual", "at least 0", self.shared_residual.to_string()),
            (self.anchors >= 4, "anchors", "at least 4", self.anchors.to_string()),
            (self.matching.batch > 0, "matching.batch", "at least 1", self.matching.batch.to_string()),
            (
                self.matching.particles > 0,
                "matching.particles",
                "at least 1",
                self.matching.particles.to_string(),
            ),
            (
                self.rollout.particles > 0,
                "rollout.particles",
                "at least 1",
                self.rollout.particles.to_string(),
            ),
        ];
        for (holds, field, expected, found) in checks {
            if !holds {
                return Err(DistillError::Config { field, expected, found });
            }
        }
        Ok(())
    }
}
