//! Explanation of one object's motion: law, start, rivals, noise, bands and verdict from its configurations
//! over time.
//!
//! [`explain`] is the one entry for every kind of [`Coordinates`];
//! [`crate::choose::candidates`] lists laws for each of them.

mod bodies;
mod forecast;
mod input;

pub use forecast::Forecast;
pub(crate) use input::check_track;

use crate::bands::{Band, Verdict, trusted};
use crate::choose::{Choice, choose};
use crate::coordinates::{Coordinates, State};
use crate::fit::Track;
use crate::{Candidate, Edit, Law, MechanicsError, System};
use serde::{Deserialize, Serialize};

/// How an explanation is sought.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Options {
    /// Radius of the 90 % band up to which a forecast is trusted, over the path moved until then.
    pub tolerance: f64,
    /// World length by which a point of the object typically moves per unit of each component of a change of
    /// the configuration, `[freedoms]`; [`Coordinates::levers`] if empty.
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
    seed: u64,
}

/// Times of a window at which bands are compared with the tolerance.
const COMPARED: usize = 20;

/// Explains the configurations `x` of one object at ascending `times` by one of the candidates.
///
/// Each row of `x` is a configuration in the candidates' coordinates, e. g. quaternion and centre of a rigid
/// body. Times may lie unevenly apart and have gaps. All candidates must have coordinates of the same size.
///
/// Errors: fewer than five times, times that do not ascend, rows of the wrong size or not finite, no
/// candidate, and none that could be fitted.
pub fn explain(
    candidates: &[Candidate],
    times: &[f64],
    x: &[Vec<f64>],
    options: &Options,
) -> Result<Explanation, MechanicsError> {
    let x = check_track(candidates, times, x)?;
    let coordinates = &candidates[0].coordinates;
    input::check_options(coordinates, options)?;
    let no_fit = || MechanicsError::NoFit { candidates: candidates.len() };
    let (choice, track) = match coordinates {
        Coordinates::Rigid(_) => bodies::choose(candidates, times, &x).ok_or_else(no_fit)?,
        _ => {
            let track = Track::new(coordinates, times, &x);
            let choice = choose(candidates, &track, &track.scales(coordinates)).ok_or_else(no_fit)?;
            (choice, track)
        }
    };
    let levers = match options.levers.is_empty() {
        true => coordinates.levers(),
        false => options.levers.clone(),
    };
    let first = times[0];
    let mut explanation = Explanation {
        candidates: candidates.to_vec(),
        choice,
        track,
        levers,
        path: 0.0,
        forecasts: [None, None],
        trusted: [first, first],
        verdict: Verdict::Outside,
        seed: options.seed,
    };
    explanation.judge(options)?;
    Ok(explanation)
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
    fn window(&self) -> [f64; 2] {
        [self.track.times[0], self.track.times[self.track.times.len() - 1]]
    }

    /// Fills in path, forecasts, trust and verdict.
    fn judge(&mut self, options: &Options) -> Result<(), MechanicsError> {
        let smooth = &self.track.smooth;
        self.path = smooth.windows(2).map(|pair| self.distance(&pair[0].0, &pair[1].0)).sum();
        let [first, last] = self.window();
        let compared = COMPARED as f64;
        let beyond = (options.horizon * compared).round();
        let count = (compared + 2.0 * beyond) as usize;
        let time = |k: usize| first + (last - first) * (k as f64 - beyond) / compared;
        let times: Vec<f64> = (0..=count).map(time).collect();
        let relative = self.relative_radius(&times, options);
        self.trusted = trusted(&times, &relative, [first, last], options.tolerance);
        self.forecasts = forecast::both(self);
        let failed = |forecast: &Option<Forecast>| {
            forecast.as_ref().is_some_and(|f| f.fails() && f.error > options.tolerance * self.path)
        };
        let known = self.trusted[1] >= last + 0.5 * (last - first) - f64::EPSILON * last.abs();
        self.verdict = match self.choice.describes() {
            false => Verdict::Outside,
            true if known && !self.forecasts.iter().any(failed) => Verdict::Explained,
            true => Verdict::Described,
        };
        Ok(())
    }

    /// Radius of the band over the path that was moved until then from the nearer end of the window, at least
    /// the window's own.
    fn relative_radius(&self, times: &[f64], options: &Options) -> Vec<f64> {
        let Some(band) = self.band(times) else { return vec![f64::INFINITY; times.len()] };
        let [first, last] = self.window();
        let moved = |k: usize| self.distance(&band.middle[k - 1], &band.middle[k]);
        let mut path = vec![self.path; times.len()];
        for k in (1..times.len()).filter(|&k| times[k] > last) {
            path[k] = path[k - 1] + moved(k);
        }
        for k in (1..times.len()).rev().filter(|&k| times[k - 1] < first) {
            path[k - 1] = path[k] + moved(k);
        }
        let radius = band.radius(0.9, &|a: &State, b: &State| self.distance(a, b));
        let relative = |(radius, path): (f64, f64)| match radius <= options.negligible {
            true => 0.0,
            false => radius / path.max(f64::MIN_POSITIVE),
        };
        radius.into_iter().zip(path).map(relative).collect()
    }
}
