//! Settings of FreeGave's velocity field (method §3.2).

use serde::{Deserialize, Serialize};

use super::ranges::within;

/// Accumulation of the rotation of a Gaussian that the velocity field carries (method §3.2).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RotationForm {
    /// As published: products of `I + h [ω]×`, never orthonormalised, then a quaternion by a formula that
    /// fails near half a turn. Gaussians swell in the plane of rotation, and what is not a number is not
    /// drawn.
    Reference,
    /// Products of exp(h ω), renormalised.
    Fixed,
}

/// Code field, segment head and velocity network, and how they are integrated.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct VelocityConfig {
    /// Hidden layers of the code field (paper: 4).
    pub code_depth: usize,
    /// Units per hidden layer of the code field (paper: 128).
    pub code_width: usize,
    /// The position enters the code field again after this layer, counted from 0 (paper: 2).
    pub code_skip_layer: usize,
    /// Hidden layers of the velocity network (paper: 5).
    pub depth: usize,
    /// Units per hidden layer of the velocity network (paper: 128).
    pub width: usize,
    /// Frequencies of its time encoding (paper: 3). With 1 velocities change more evenly beyond the captured
    /// window, but some motions are never followed.
    pub time_frequencies: usize,
    /// T*: the deformation ends and the velocity field takes over (paper: 0.70 to 0.75, by scene).
    pub max_time: f32,
    /// Steps of the integration per unit of time (paper: 60).
    pub fps: f32,
    /// Accumulation of rotations (paper: reference).
    pub rotation: RotationForm,
    /// A Gaussian that stays within this distance of where it is at t = 0 does not move at all when drawn,
    /// world units (paper: 0.01).
    pub still_within: f32,
}

impl Default for VelocityConfig {
    fn default() -> Self {
        Self::quick()
    }
}

impl VelocityConfig {
    /// As published, for the scenes that end at 0.75 (method §3.2).
    #[must_use]
    pub fn paper() -> Self {
        Self {
            code_depth: 4,
            code_width: 128,
            code_skip_layer: 2,
            depth: 5,
            width: 128,
            time_frequencies: 3,
            max_time: 0.75,
            fps: 60.0,
            rotation: RotationForm::Reference,
            still_within: 0.01,
        }
    }

    /// Small networks for the processor, and a velocity field that is also followed over the window's last
    /// part.
    #[must_use]
    pub fn quick() -> Self {
        Self {
            code_depth: 2,
            code_width: 32,
            code_skip_layer: 2,
            depth: 2,
            width: 64,
            max_time: 0.7,
            rotation: RotationForm::Fixed,
            ..Self::paper()
        }
    }
}

impl VelocityConfig {
    pub(in crate::source) fn validate(&self) -> Result<(), (&'static str, String)> {
        within(&[
            ("code_depth", self.code_depth, 1, 32),
            ("code_width", self.code_width, 1, 4096),
            ("depth", self.depth, 1, 32),
            ("width", self.width, 1, 4096),
            ("time_frequencies", self.time_frequencies, 0, 16),
        ])?;
        within(&[
            ("max_time", self.max_time, 0.0, 1e3),
            ("fps", self.fps, 1.0, 1e4),
            ("still_within", self.still_within, 0.0, 1e6),
        ])
    }
}
