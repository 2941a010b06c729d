//! Edits of a motion: the scales under which a split of a dataset was made.

use std::ops::RangeInclusive;

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

/// The edits that every synthetic scene with a law shows, by the names of their splits.
pub const SYNTHETIC_EDITS: [(&str, MotionEdit); 5] = [
    ("edit-velocity-half", scaled(0.5, 1.0, 1.0)),
    ("edit-potential-half", scaled(1.0, 0.5, 1.0)),
    ("edit-potential-double", scaled(1.0, 2.0, 1.0)),
    ("edit-force-none", scaled(1.0, 1.0, 0.0)),
    ("edit-force-double", scaled(1.0, 1.0, 2.0)),
];

const fn scaled(velocity_scale: f64, potential_scale: f64, force_scale: f64) -> MotionEdit {
    MotionEdit { velocity_scale, potential_scale, force_scale }
}

impl Default for MotionEdit {
    /// The motion as it was.
    fn default() -> Self {
        Self { velocity_scale: 1.0, potential_scale: 1.0, force_scale: 1.0 }
    }
}

impl MotionEdit {
    /// The declared range of each scale. Ten times the velocity, or three times the frequencies (their root),
    /// are still resolved by the steps of a scene; negative scales turn the start or a force around.
    pub const SCALES: RangeInclusive<f64> = -10.0..=10.0;

    /// Checks the scales against [`Self::SCALES`].
    ///
    /// # Errors
    /// The first scale that is outside, and the range.
    pub fn check(&self) -> Result<(), String> {
        let named = [
            ("velocity_scale", self.velocity_scale),
            ("potential_scale", self.potential_scale),
            ("force_scale", self.force_scale),
        ];
        named.into_iter().try_for_each(|(name, value)| {
            Self::checked_scale(value).map(|_| ()).map_err(|reason| format!("`{name}`: {reason}"))
        })
    }

    /// A scale within [`Self::SCALES`].
    ///
    /// # Errors
    /// What the value is and what the range is, if it is outside or not a number.
    pub fn checked_scale(value: f64) -> Result<f64, String> {
        let (low, high) = (Self::SCALES.start(), Self::SCALES.end());
        if Self::SCALES.contains(&value) {
            Ok(value)
        } else {
            Err(format!("the scale {value} of an edit is outside its range, {low} to {high}"))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scales_outside_of_the_declared_range_are_refused_by_name() {
        assert_eq!(MotionEdit::default().check(), Ok(()));
        for value in [10.5, -11.0, f64::NAN, f64::INFINITY] {
            let refused = MotionEdit { potential_scale: value, ..MotionEdit::default() }.check();
            let message = refused.expect_err("outside");
            assert!(message.contains("`potential_scale`") && message.contains("-10 to 10"), "{message}");
        }
    }
}
