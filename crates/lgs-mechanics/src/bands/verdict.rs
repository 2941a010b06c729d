//! How far a scene may claim to know an object's motion.

use super::Band;
use crate::choose::Choice;
use crate::coordinates::State;
use serde::{Deserialize, Serialize};

/// What is known of a motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// The law describes the window and its forecast can be told.
    Explained,
    /// The law describes the window; rival laws disagree soon beyond it.
    Described,
    /// No law describes the window.
    Outside,
}

/// χ² for each degree of freedom up to which a law describes a window. Over random laws of a point it was at
/// most 1.4 for chosen laws and at least 2.6 for random paths; this is between.
pub const DESCRIBED: f64 = 2.0;

/// The verdict of a choice, from its χ² and from its band over the window and half as long beyond it:
/// explained needs a radius within `tolerance` there.
#[must_use]
pub fn verdict(
    choice: &Choice,
    band: &Band,
    tolerance: f64,
    distance: &dyn Fn(&State, &State) -> f64,
) -> Verdict {
    if choice.chi_square_per_sample() > DESCRIBED {
        return Verdict::Outside;
    }
    let known = band.radius(0.9, distance).iter().all(|radius| *radius <= tolerance);
    if known { Verdict::Explained } else { Verdict::Described }
}
