//! Presets of a configuration.

use serde::{Deserialize, Serialize};

/// Sets of defaults.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Preset {
    /// Minutes on two CPU cores.
    #[default]
    Quick,
    /// The published values (those that the paper and its supplement print), wherever measurement has not
    /// found better ones. The exceptions, with the published value in brackets:
    ///
    /// - `partition.smoothing_degree` 6 (0): a source's jitter makes walls move and cuts links of one body.
    /// - `partition.regroup_rounds` 4 (0): the graph joins a body with what wobbles beside it, and parts it
    ///   where nothing is observed.
    /// - `partition.unseen_motion` 0.6 (0): plain surfaces of a source slide along themselves, which no image
    ///   tells from rest.
    /// - `partition.negligible_motion` 0.08 (0): surroundings of a trained source are never quite static.
    /// - `distill.shared_motion` auto (none): particles of one body denoise each other.
    /// - `distill.matching.steps` 3000 (0): accelerations are matched state by state before rollouts refine
    ///   the networks; 0 is the paper's way (Eq. 7 alone).
    /// - `distill.matching.force_penalty` 1e-3 (1e-4): second differences are noisier than positions.
    /// - `distill.rollout.steps`, `.learning_rate`, `.particles` 400, 1e-4, 512 (10 000, 1e-3, 4 096):
    ///   rollouts only refine what matching has found.
    /// - `distill.rollout.velocity_learning_rate` 1e-3 (1e-2): one linear field corrects starting velocities,
    ///   not one vector per particle.
    Paper,
}
