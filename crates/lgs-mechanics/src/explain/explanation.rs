//! What is known of an object's motion.

use super::forecast::Forecast;
use crate::bands::{Band, Verdict};
use crate::candidate::Candidate;
use crate::choose::Choice;
use crate::coordinates::State;
use crate::edit::Edit;
use crate::error::MechanicsError;
use crate::fit::Track;
use crate::law::Law;
use crate::system::System;

/// What is known of an object's motion.
#[derive(Clone, Debug)]
pub struct Explanation {
    /// The candidates that were offered.
    pub candidates: Vec<Candidate>,
    /// All that could be fitted, with their evidence and weights, and the chosen one.
    pub choice: Choice,
    /// The track with its noise and smooth path. Starts of fitted laws lie at its first time.
    pub track: Track,
    /// World length per unit of each component of a change, `[freedoms]`.
    pub levers: Vec<f64>,
    /// Length of the smooth path in the window, world units.
    pub path: f64,
    /// Forecasts of the last and of the first third from the other two; `None` where none could be made.
    pub forecasts: [Option<Forecast>; 2],
    /// First and last time between which the 90 % band stays within the tolerance, normalised time.
    pub trusted: [f64; 2],
    /// Verdict on the chosen law.
    pub verdict: Verdict,
    pub(super) seed: u64,
}

impl Explanation {
    /// The chosen law.
    #[must_use]
    pub fn law(&self) -> &Law {
        &self.choice.law().fitted.law
    }

    /// The chosen law's state at a time; an error if it cannot be followed to there.
    pub fn start_at(&self, time: f64) -> Result<State, MechanicsError> {
        Ok(self.states(&[time])?.swap_remove(0))
    }

    /// The chosen law's states at times of any order.
    pub fn states(&self, times: &[f64]) -> Result<Vec<State>, MechanicsError> {
        let system = System::new(self.law(), Edit::NONE);
        system.states(&self.choice.law().fitted.start, &self.since_start(times))
    }

    /// Motions drawn from all candidates at ascending times; `None` if the chosen law cannot be followed.
    #[must_use]
    pub fn band(&self, times: &[f64]) -> Option<Band> {
        let mut band = Band::new(&self.choice, &self.since_start(times), self.seed)?;
        band.times = times.to_vec();
        Some(band)
    }

    /// Distance of two states, world units: root mean square over the points of the object, by the levers.
    #[must_use]
    pub fn distance(&self, a: &State, b: &State) -> f64 {
        let change = self.law().coordinates.difference(&a.x, &b.x);
        change.iter().zip(&self.levers).map(|(d, lever)| (lever * d).powi(2)).sum::<f64>().sqrt()
    }

    /// Radius around the chosen motion that holds 90 % of the posterior of positions, for each time; world
    /// units, infinite where a motion cannot be followed.
    #[must_use]
    pub fn radius(&self, times: &[f64]) -> Vec<f64> {
        let distance = |a: &State, b: &State| self.distance(a, b);
        self.band(times).map_or_else(|| vec![f64::INFINITY; times.len()], |band| band.radius(0.9, &distance))
    }

    fn since_start(&self, times: &[f64]) -> Vec<f64> {
        times.iter().map(|time| time - self.track.times[0]).collect()
    }

    /// The window.
    pub(super) fn window(&self) -> [f64; 2] {
        [self.track.times[0], self.track.times[self.track.times.len() - 1]]
    }
}
