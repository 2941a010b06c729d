//! Options of an explanation.

use serde::{Deserialize, Serialize};

/// How an explanation is sought.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Options {
    /// Radius of the 90 % band up to which a forecast is trusted, over the path moved until then.
    pub tolerance: f64,
    /// World length by which a point of the object typically moves per unit of each component of a change of
    /// the configuration, `[freedoms]`; [`crate::coordinates::Coordinates::levers`] if empty.
    pub levers: Vec<f64>,
    /// Error that never matters, world units: the least radius that trust can fail by.
    pub negligible: f64,
    /// Time beyond either end of the window within which trust is sought, in windows.
    pub horizon: f64,
    /// Seed of the draws behind bands.
    pub seed: u64,
}

impl Default for Options {
    /// Forecasts are trusted to 4 % of the path, up to two windows beyond the window.
    fn default() -> Self {
        Self { tolerance: 0.04, levers: Vec::new(), negligible: 0.0, horizon: 2.0, seed: 0 }
    }
}
