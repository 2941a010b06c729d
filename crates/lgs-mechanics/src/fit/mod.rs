//! Fits of laws to tracks: first values by regression on smoothed tracks, then shooting.
//!
//! All residuals are in units of the tracks' own noise, see [`crate::noise`], so no number here depends
//! on units of the world.

mod fitted;
mod levenberg;
mod open_inertia;
mod regression;
mod segments;
mod shared;
mod shooting;
mod starts;
#[cfg(test)]
mod tests;
mod track;

pub use fitted::{Fitted, covariance_of, shoot};
pub use levenberg::{Minimum, Problem, Settings, Unknown, finite_differences, minimise};
pub use regression::{Regression, regress};
pub use segments::approach;
pub use shared::{Shared, shoot_each};
pub(crate) use shooting::interval;
pub use starts::first_values;
pub(crate) use starts::regressions;
pub use track::Track;
