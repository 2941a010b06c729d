//! Presets of a configuration.

use lgs_distill::DynamicsKind;
use lgs_model::source::SourceKind;
use serde::{Deserialize, Serialize};

/// Sets of defaults.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Preset {
    /// Minutes on two CPU cores.
    #[default]
    Quick,
    /// For sets of any size: what depends on images, views and the world's scale is resolved from the data. A
    /// quarter of an hour to an hour on two CPU cores, or as long as a time budget says.
    Standard,
    /// The paper's system at the published lengths: its networks (`distill.dynamics`), its three stages, and
    /// the published values of the source. The grouping into objects, which the paper leaves open, is ours:
    ///
    /// - `partition.smoothing_degree` 6: a source's jitter makes walls move and cuts links of one body.
    /// - `partition.regroup_rounds` 4: the graph joins a body with what wobbles beside it, and parts it where
    ///   nothing is observed.
    /// - `partition.unseen_motion` 0.6: plain surfaces of a source slide along themselves, which no image
    ///   tells from rest.
    /// - `partition.negligible_motion` 0.08: surroundings of a trained source are never quite static.
    Paper,
}

impl Preset {
    /// The kind of source model unless the configuration names one.
    #[must_use]
    pub fn source(self) -> SourceKind {
        match self {
            // Motion costs next to nothing per Gaussian, of which there are many.
            Self::Standard => SourceKind::Nodes,
            Self::Quick | Self::Paper => SourceKind::Defgs,
        }
    }

    /// What moves objects unless the configuration says so.
    #[must_use]
    pub fn dynamics(self) -> DynamicsKind {
        match self {
            Self::Quick | Self::Standard => DynamicsKind::Terms,
            Self::Paper => DynamicsKind::Networks,
        }
    }
}
