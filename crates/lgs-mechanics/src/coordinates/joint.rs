//! Joints of one body with the world.

use super::Inertia;
use serde::{Deserialize, Serialize};

/// A body that turns by `θ` about a fixed axis: `q = pivot + exp(θ axis) (q₀ − pivot)`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Hinge {
    /// Unit vector, world axes.
    pub axis: [f64; 3],
    /// A point on the axis, world units.
    pub pivot: [f64; 3],
}

/// A body that moves by `s` along a line: `q = q₀ + s direction`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Slider {
    /// Unit vector, world axes.
    pub direction: [f64; 3],
}

/// A round body that rolls by `s` along a line: its centre moves by `s direction`, and it turns by
/// `s / radius` about the axis.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rolling {
    /// Unit vector along which the centre moves, world axes.
    pub direction: [f64; 3],
    /// Unit vector about which the body turns, world axes.
    pub axis: [f64; 3],
    /// Path of the centre per radian, world units.
    pub radius: f64,
    /// Centre at `s = 0`, world units.
    pub center: [f64; 3],
}

/// A body that turns about a fixed point, with its inertia about that point.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ball {
    /// The fixed point, world units.
    pub pivot: [f64; 3],
    /// From the pivot to the centre, principal axes of the inertia, world units.
    pub arm: [f64; 3],
    /// Inertia about the pivot.
    pub inertia: Inertia,
}
