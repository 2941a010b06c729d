//! Settings of the training of FreeGave's velocity field.

use serde::{Deserialize, Serialize};

/// How FreeGave's velocity field is trained: between the time of the deformation and that of the image
/// (method §3.2).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct AdvectionConfig {
    /// Time between the two, to either side, up to T* (paper: 1/60). Longer advections see more of a
    /// velocity's error.
    pub length: f32,
    /// Share of the iterations up to T* with an advection step; the others train the deformation at the
    /// image's own time (paper: 1).
    pub share: f32,
    /// Longest step of the integration (paper: 0, a single step of any length).
    pub longest_step: f32,
    /// Whether Gaussians also turn on the way (paper: false).
    pub turns: bool,
    /// Weight of the mean squared difference between the mean velocity over an advection step and that of the
    /// deformation, in which the deformation is a constant (paper: 0, none). It shows the velocity field all
    /// of the window at once, where images show a frame.
    pub agreement: f32,
}

impl AdvectionConfig {
    /// Images alone show velocities where the deformation has ended; before, its agreement with the velocity
    /// field does.
    #[must_use]
    pub fn quick() -> Self {
        Self { length: 0.1, share: 0.0, longest_step: 0.05, turns: true, agreement: 3.0 }
    }

    /// The published values.
    #[must_use]
    pub fn paper() -> Self {
        Self { length: 1.0 / 60.0, share: 1.0, longest_step: 0.0, turns: false, agreement: 0.0 }
    }

    /// Checks the values; a refusal is (field, reason).
    ///
    /// # Errors
    /// The first value out of range.
    pub fn validate(&self) -> Result<(), (String, String)> {
        let refuse = |field: &str, reason: String| Err((field.to_owned(), reason));
        let Self { length, share, longest_step, agreement, .. } = *self;
        if !(length > 0.0 && length.is_finite()) {
            return refuse("length", format!("{length} is not a positive time"));
        }
        if !(0.0..=1.0).contains(&share) {
            return refuse("share", format!("{share} is not in [0, 1]"));
        }
        match [("longest_step", longest_step), ("agreement", agreement)]
            .into_iter()
            .find(|(_, v)| !(*v >= 0.0 && v.is_finite()))
        {
            Some((field, value)) => refuse(field, format!("{value} is negative or not finite")),
            None => Ok(()),
        }
    }
}

impl Default for AdvectionConfig {
    fn default() -> Self {
        Self::quick()
    }
}
