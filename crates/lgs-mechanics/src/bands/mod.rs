//! Bands of a forecast: all fitted candidates, weighted by their evidence, each with its own posterior.
//!
//! Draws of start and parameters go through the rollout, so that a band holds the rival laws and widens as
//! the motions part.

mod draws;
mod edited;
#[cfg(test)]
mod edited_tests;
mod known;
mod verdict;

pub use draws::{Probability, changes};
pub use edited::{DrawnLaws, PosteriorLaws, StartedLaw};
pub use known::{Known, PositionBand, Rival};
pub use verdict::Verdict;

use crate::choose::Choice;
use crate::coordinates::State;
use crate::edit::Edit;
use crate::fit::Fitted;
use crate::system::System;
use crate::thresholds::DRAWS;
use draws::Draws;
use lgs_core::holding;

/// Share of the posterior of positions that a band holds.
pub const HELD: f64 = 0.9;

/// Motions drawn from the posterior over all candidates.
#[derive(Clone, Debug)]
pub struct Band {
    /// Times of the motions.
    pub times: Vec<f64>,
    /// Motion of the chosen law.
    pub middle: Vec<State>,
    /// Drawn motions with the same weight each; `None` from where a motion could not be followed.
    draws: Vec<Option<Vec<State>>>,
}

/// Number of draws of each of several laws, by their weights.
#[must_use]
pub fn shares(weights: &[f64]) -> Vec<usize> {
    shares_of(DRAWS, weights)
}

/// The share of each weight in a number, rounded so that the sum is kept.
#[must_use]
pub fn shares_of(all: usize, weights: &[f64]) -> Vec<usize> {
    let mut sum = 0.0;
    let mut given = 0;
    let share = |weight: &f64| {
        sum += weight * all as f64;
        let count = (sum.round() as usize).saturating_sub(given);
        given += count;
        count
    };
    weights.iter().map(share).collect()
}

/// Motions at the given times from draws of the posterior of one fit, `None` where one cannot be followed;
/// `index` is that of the law among its rivals.
#[must_use]
pub fn drawn(
    fitted: &Fitted,
    count: usize,
    times: &[f64],
    (seed, index): (u64, u64),
) -> Vec<Option<Vec<State>>> {
    let mut source = Draws::new(fitted, seed, index);
    let motion = |_| {
        let (law, start) = source.next();
        System::new(&law, Edit::NONE).states(&start, times).ok()
    };
    (0..count).map(motion).collect()
}

impl Band {
    /// Follows the chosen law and the draws to the given times; `None` if the chosen law cannot be followed.
    #[must_use]
    pub fn new(choice: &Choice, times: &[f64], seed: u64) -> Option<Self> {
        let chosen = &choice.law().fitted;
        let middle = System::new(&chosen.law, Edit::NONE).states(&chosen.start, times).ok()?;
        let mut draws = Vec::with_capacity(DRAWS);
        for (index, (judged, count)) in choice.judged.iter().zip(shares(&choice.weights())).enumerate() {
            draws.extend(drawn(&judged.fitted, count, times, (seed, index as u64)));
        }
        Some(Self { times: times.to_vec(), middle, draws })
    }

    /// Radius around the chosen motion that holds a share of the draws, for each time; `distance` compares
    /// two states. Infinite where too many draws cannot be followed.
    #[must_use]
    pub fn radius(&self, share: f64, distance: &dyn Fn(&State, &State) -> f64) -> Vec<f64> {
        radius(&self.draws, &self.middle, share, distance)
    }
}

/// Radius around a motion that holds a share of drawn ones, for each time.
pub(crate) fn radius(
    draws: &[Option<Vec<State>>],
    middle: &[State],
    share: f64,
    distance: &dyn Fn(&State, &State) -> f64,
) -> Vec<f64> {
    let one = |time: usize| {
        let from = |draw: &Option<Vec<State>>| {
            draw.as_ref().map_or(f64::INFINITY, |states| distance(&middle[time], &states[time]))
        };
        holding(share, draws.iter().map(from).collect())
    };
    (0..middle.len()).map(one).collect()
}

/// The range of times around a window, [since, until], in which a radius stays within a tolerance; times
/// ascend. The window's own middle is returned twice if it is exceeded there.
#[must_use]
pub fn trusted(times: &[f64], radius: &[f64], window: [f64; 2], tolerance: f64) -> [f64; 2] {
    let middle = 0.5 * (window[0] + window[1]);
    let good = |&(_, r): &(&f64, &f64)| *r <= tolerance;
    let after = times.iter().zip(radius).filter(|(t, _)| **t >= middle);
    let before = times.iter().zip(radius).rev().filter(|(t, _)| **t <= middle);
    let until = after.take_while(good).last().map_or(middle, |(t, _)| *t);
    let since = before.take_while(good).last().map_or(middle, |(t, _)| *t);
    [since, until]
}
