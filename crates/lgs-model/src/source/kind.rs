//! Names of the kinds of source models.

use serde::{Deserialize, Serialize};

/// The name of a kind of source model, as configurations spell it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SourceKind {
    /// A deformation network ([`super::DefGs`]).
    #[default]
    Defgs,
    /// A deformation network that a velocity field carries on ([`super::FreeGave`]).
    Freegave,
    /// A network that moves control nodes, which Gaussians follow ([`super::ControlNodes`]).
    Nodes,
    /// Constant velocities, an affine function of the position ([`super::LinearMotion`]).
    Linear,
    /// Trajectories from files ([`super::ImportedFrames`]).
    Frames,
}
