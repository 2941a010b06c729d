//! Edits of a motion: the scales under which a split of a dataset was made.

use serde::{Deserialize, Serialize};

/// A change of physics under which a motion starts as before.
///
/// As JSON: `{"velocity_scale":…, "potential_scale":…, "force_scale":…}`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MotionEdit {
    /// α: multiplies the velocities at t = 0.
    pub velocity_scale: f64,
    /// β: multiplies every conservative force.
    pub potential_scale: f64,
    /// γ: multiplies every force that is not conservative.
    pub force_scale: f64,
}

impl Default for MotionEdit {
    /// The motion as it was.
    fn default() -> Self {
        Self { velocity_scale: 1.0, potential_scale: 1.0, force_scale: 1.0 }
    }
}
