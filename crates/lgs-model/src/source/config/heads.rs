//! The outputs of the deformation network: their number, their meaning and their first values.

use serde::{Deserialize, Serialize};

/// Numbers per row, raw or pose.
pub const DELTAS: usize = 10;

/// Meaning of the network's third output for a Gaussian's scale.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ScaleMode {
    /// `exp(log_scale) + Δs`, floored: DefGS.
    Additive,
    /// `exp(log_scale + Δs)`.
    Exponent,
    /// The scale never changes: a rigid body's Gaussians only move and turn, which is what a Lagrangian scene
    /// can represent.
    Fixed,
}

/// Meaning of the network's first two outputs for a Gaussian.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum MotionHead {
    /// A displacement, and a change of the quaternion: DefGS.
    Displacement,
    /// A displacement, and a quaternion of any length that turns the Gaussian: FreeGave.
    Turn,
    /// A rotation about the scene's centre and a translation, which also turn the Gaussian: all of a rigid
    /// body share one output (in the spirit of DefGS's six-DoF option, without its singularity at rest).
    Rigid,
}

/// Initial values of the output layer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum HeadInit {
    /// Uniform in ±1/√fan_in as every other layer: DefGS.
    Uniform,
    /// A hundredth of that: motion starts near rest.
    Small,
    /// Zero: motion starts at rest.
    Zero,
}
