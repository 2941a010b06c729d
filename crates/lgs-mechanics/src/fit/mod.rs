//! Fits of laws to tracks: first values by regression on smoothed tracks, then shooting.
//!
//! All residuals are in units of the tracks' own noise, see [`crate::noise`], so no number here depends
//! on units of the world.

mod levenberg;
mod regression;
mod shooting;
mod starts;
#[cfg(test)]
mod tests;

pub use levenberg::{Minimum, Problem, Settings, Unknown, finite_differences, minimise};
pub use regression::{Regression, regress};
pub use shooting::{Fitted, shoot};
pub use starts::first_values;

use crate::coordinates::{Coordinates, State};
use crate::noise::{Noise, SmoothPath};
use crate::terms::Scales;

/// Configurations of one object over time with their noise and a smooth path through them.
#[derive(Clone, Debug)]
pub struct Track {
    /// Times in ascending order, normalised time.
    pub times: Vec<f64>,
    /// Configurations, one for each time.
    pub x: Vec<Vec<f64>>,
    /// Noise of each component of the change of a configuration.
    pub noise: Vec<Noise>,
    /// Configuration, velocity and acceleration of the smooth path at each time.
    pub smooth: Vec<(State, Vec<f64>)>,
}

impl Track {
    /// Estimates the noise of configurations and the smooth path through them.
    #[must_use]
    pub fn new(coordinates: &Coordinates, times: &[f64], x: &[Vec<f64>]) -> Self {
        let path = SmoothPath::fit(times, x);
        let smooth = path.states(coordinates, times);
        Self { times: times.to_vec(), x: x.to_vec(), noise: path.noise_of_changes(coordinates), smooth }
    }

    /// The part of the track in a range of samples, with the same noise and smooth path.
    #[must_use]
    pub fn part(&self, range: std::ops::Range<usize>) -> Self {
        Self {
            times: self.times[range.clone()].to_vec(),
            x: self.x[range.clone()].to_vec(),
            noise: self.noise.clone(),
            smooth: self.smooth[range].to_vec(),
        }
    }

    /// Scales of the path: extent, duration, centre and principal axes; the rotation of a body is left out.
    #[must_use]
    pub fn scales(&self, coordinates: &Coordinates) -> Scales {
        let first = if coordinates.has_rotation() { 4 } else { 0 };
        let places: Vec<&[f64]> = self.smooth.iter().map(|(state, _)| &state.x[first..]).collect();
        starts::scales_of(&places, &self.times)
    }

    /// Number of samples that count as independent, summed over components.
    #[must_use]
    pub fn independent_samples(&self) -> f64 {
        self.noise.iter().map(|noise| noise.share() * self.times.len() as f64).sum()
    }
}
