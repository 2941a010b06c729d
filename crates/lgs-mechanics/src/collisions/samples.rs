//! The samples that a motion through impacts is compared with.

use crate::choose::DESCRIBED;
use crate::coordinates::Coordinates;
use crate::noise::{Noise, SampleTimes, Sampling};
use std::ops::Range;

/// Configurations of a track with their weights.
#[derive(Clone, Debug, Default)]
pub(super) struct Samples {
    pub(super) x: Vec<Vec<f64>>,
    /// Samples before the first impact.
    pub(super) free: usize,
    /// Weights of the components `[n]` of each sample, 0 for one that is left out.
    weights: Vec<Vec<f64>>,
    /// Independent values that each component of a sample counts as.
    shares: Vec<f64>,
    left_out: Vec<bool>,
}

/// Weights of the samples after the free flight.
#[derive(Clone, Copy, Debug)]
pub(super) enum Later {
    /// Those of the noise.
    OfNoise,
    /// One error of the model of contact, which all of them share: residuals are lengths over this one.
    Sharing(f64),
}

impl Samples {
    /// Samples of a track with known noise, of which the first `free` are before any impact.
    pub(super) fn new(
        samples: SampleTimes<'_>,
        x: Vec<Vec<f64>>,
        noise: &[Noise],
        (free, left_out): (usize, Vec<bool>),
    ) -> Self {
        let sampling = Sampling::of(samples);
        let columns: Vec<Vec<f64>> = noise.iter().map(|noise| noise.weights(&sampling)).collect();
        let row = |k: usize| -> Vec<f64> {
            columns.iter().map(|column| if left_out[k] { 0.0 } else { column[k] }).collect()
        };
        let count = x.len();
        let weights = (0..count).map(row).collect();
        let mean = |noise: &Noise| sampling.shares(noise.correlation).iter().sum::<f64>() / count as f64;
        Self { x, free, weights, shares: noise.iter().map(mean).collect(), left_out }
    }

    /// χ² of some samples, and the number of independent values.
    fn chi_square(
        &self,
        coordinates: &Coordinates,
        predicted: &[Vec<f64>],
        range: Range<usize>,
    ) -> (f64, f64) {
        let kept = range.filter(|&k| !self.left_out[k]);
        kept.fold((0.0, 0.0), |(sum, count), k| {
            let change = coordinates.difference(&self.x[k], &predicted[k]);
            let square: f64 = change.iter().zip(&self.weights[k]).map(|(d, w)| (d * w).powi(2)).sum();
            (sum + square, count + self.shares.iter().sum::<f64>())
        })
    }

    /// Mean logarithm of the weights of the samples that count: how well a place is known by one.
    pub(super) fn sharpness(&self) -> f64 {
        let kept = self.weights.iter().flatten().filter(|weight| **weight > 0.0);
        let (sum, count) = kept.fold((0.0, 0.0), |(sum, count), weight| (sum + weight.ln(), count + 1.0));
        sum / f64::max(count, 1.0)
    }

    fn later(&self) -> Range<usize> {
        self.free..self.x.len()
    }

    /// χ² of the free flight for each independent value.
    pub(super) fn chi_square_of_flight(&self, coordinates: &Coordinates, predicted: &[Vec<f64>]) -> f64 {
        let (sum, count) = self.chi_square(coordinates, predicted, 0..self.free);
        sum / count.max(1.0)
    }

    /// Mean distance of the samples after the free flight, world units; 0 without any.
    pub(super) fn later_error(&self, coordinates: &Coordinates, predicted: &[Vec<f64>]) -> f64 {
        let levers = coordinates.levers();
        let distance = |k: usize| {
            let change = coordinates.difference(&self.x[k], &predicted[k]);
            change.iter().zip(&levers).map(|(d, lever)| (lever * d).powi(2)).sum::<f64>().sqrt()
        };
        let later = self.later().filter(|&k| !self.left_out[k]);
        let (sum, count) = later.fold((0.0, 0.0), |(sum, count), k| (sum + distance(k), count + 1.0));
        if count > 0.0 { sum / count } else { 0.0 }
    }

    /// Whether a motion stays within the noise after the free flight.
    pub(super) fn is_within_noise_later(&self, coordinates: &Coordinates, predicted: &[Vec<f64>]) -> bool {
        let (sum, count) = self.chi_square(coordinates, predicted, self.later());
        sum <= DESCRIBED * count
    }

    /// How the samples after the free flight count: as their noise says if the motion stays within it.
    pub(super) fn weigh_later(&self, coordinates: &Coordinates, predicted: &[Vec<f64>]) -> Later {
        if self.is_within_noise_later(coordinates, predicted) {
            return Later::OfNoise;
        }
        let samples = self.later().filter(|&k| !self.left_out[k]).count();
        Later::Sharing(self.later_error(coordinates, predicted) * (samples.max(1) as f64).sqrt())
    }

    /// Weighted differences from the samples.
    pub(super) fn residuals(
        &self,
        coordinates: &Coordinates,
        predicted: &[Vec<f64>],
        later: Later,
    ) -> Vec<f64> {
        let levers = coordinates.levers();
        let mut residuals = Vec::with_capacity(predicted.len() * levers.len());
        for (k, predicted) in predicted.iter().enumerate() {
            let change = coordinates.difference(&self.x[k], predicted);
            match later {
                Later::Sharing(error) if k >= self.free => {
                    let factor = if self.left_out[k] { 0.0 } else { 1.0 / error };
                    residuals.extend(change.iter().zip(&levers).map(|(d, lever)| d * lever * factor));
                }
                _ => residuals.extend(change.iter().zip(&self.weights[k]).map(|(d, w)| d * w)),
            }
        }
        residuals
    }

    /// χ² of other configurations at the same times with the penalty of unknowns: the smaller, the likelier.
    /// The free flight and what comes after it each have an error of their own, at least that of the noise.
    /// Samples that are left out count as the others of their range do on average, so that leaving out more
    /// is no gain.
    pub(super) fn evidence(&self, coordinates: &Coordinates, predicted: &[Vec<f64>], unknowns: f64) -> f64 {
        let each: f64 = self.shares.iter().sum();
        let mut sum = 0.0;
        for range in [0..self.free, self.later()] {
            let all = each * range.len() as f64;
            let (square, count) = self.chi_square(coordinates, predicted, range);
            let mean = square / f64::max(count, 1.0);
            let inflation = mean.max(1.0);
            sum += all * (inflation.ln() + mean / inflation);
        }
        sum + unknowns * f64::max(each * self.x.len() as f64, 1.0).ln()
    }
}
