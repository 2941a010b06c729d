//! A forecast and what it promised.

use crate::thresholds::FAILS;

/// A forecast of one third of the window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Forecast {
    /// Root mean square distance from the observed configurations, world units.
    pub error: f64,
    /// The same as the noise and the posterior of the law promise.
    pub expected: f64,
}

impl Forecast {
    /// Whether the error is far beyond what the law's own posterior promises.
    #[must_use]
    pub fn fails(&self) -> bool {
        self.error > FAILS * self.expected
    }
}
