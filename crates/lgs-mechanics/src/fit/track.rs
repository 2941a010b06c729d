//! Observed paths with their noise.

use crate::coordinates::{Coordinates, State};
use crate::noise::{Noise, SampleTimes, Sampling, SmoothPath};
use crate::terms::Scales;
use glam::{DMat3, DVec3};
use lgs_core::geometry::{outer, principal_axes};

/// Configurations of one object over time with their noise and a smooth path through them.
#[derive(Clone, Debug)]
pub struct Track {
    /// Times in ascending order, normalised time.
    pub times: Vec<f64>,
    /// Configurations, one for each time.
    pub x: Vec<Vec<f64>>,
    /// Noise of each component of the change of a configuration.
    pub noise: Vec<Noise>,
    /// Distances of the samples in time, and how well each is known.
    pub sampling: Sampling,
    /// Configuration, velocity and acceleration of the smooth path at each time.
    pub smooth: Vec<(State, Vec<f64>)>,
}

impl Track {
    /// Estimates the noise of configurations and the smooth path through them.
    #[must_use]
    pub fn new<'a>(coordinates: &Coordinates, samples: impl Into<SampleTimes<'a>>, x: &[Vec<f64>]) -> Self {
        let samples = samples.into();
        let path = SmoothPath::fit(samples, x);
        let smooth = path.states(coordinates, samples.times);
        Self {
            times: samples.times.to_vec(),
            x: x.to_vec(),
            noise: path.noise_of_changes(coordinates),
            sampling: Sampling::of(samples),
            smooth,
        }
    }

    /// The part of the track in a range of samples, with the same noise and smooth path; its times count from
    /// its first sample.
    #[must_use]
    pub fn part(&self, range: std::ops::Range<usize>) -> Self {
        let first = self.times[range.start];
        Self {
            times: self.times[range.clone()].iter().map(|time| time - first).collect(),
            x: self.x[range.clone()].to_vec(),
            noise: self.noise.clone(),
            sampling: self.sampling.part(range.clone()),
            smooth: self.smooth[range].to_vec(),
        }
    }

    /// The same, no better known than to a standard deviation: of rotations in radians, of everything else in
    /// world units.
    #[must_use]
    pub fn coarsened(mut self, coordinates: &Coordinates, [turn, place]: [f64; 2]) -> Self {
        let turns = if coordinates.has_rotation() { 3 } else { 0 };
        for (i, noise) in self.noise.iter_mut().enumerate() {
            noise.deviation = noise.deviation.hypot(if i < turns { turn } else { place });
        }
        self
    }

    /// The times of the samples, with how well each is known.
    #[must_use]
    pub fn samples(&self) -> SampleTimes<'_> {
        SampleTimes { times: &self.times, deviations: self.sampling.deviations() }
    }

    /// Gives tracks of one object the same noise: the mean of their variances and correlations, each counted
    /// by the samples that are left over by position and velocity.
    pub fn share_noise(tracks: &mut [Self]) {
        let weights: Vec<f64> = tracks.iter().map(|track| track.times.len() as f64 - 2.0).collect();
        let total: f64 = weights.iter().sum();
        let components = tracks.iter().map(|track| track.noise.len()).min().unwrap_or(0);
        for i in 0..components {
            let mean = |value: &dyn Fn(&Noise) -> f64| {
                let parts =
                    tracks.iter().zip(&weights).map(|(track, weight)| weight * value(&track.noise[i]));
                parts.sum::<f64>() / total
            };
            let deviation = mean(&|noise| noise.deviation.powi(2)).sqrt();
            let correlation = mean(&|noise| noise.correlation);
            tracks.iter_mut().for_each(|track| track.noise[i] = Noise { deviation, correlation });
        }
    }

    /// Scales of the path: extent, duration, centre and principal axes. Rotations have no extent of their
    /// own: that of a ball joint is its arm.
    #[must_use]
    pub fn scales(&self, coordinates: &Coordinates) -> Scales {
        let states = self.smooth.iter().map(|(state, _)| state.x.as_slice());
        let places: Vec<&[f64]> = match coordinates {
            Coordinates::Ball(ball) => {
                let length = ball.arm.iter().map(|a| a * a).sum::<f64>().sqrt();
                let length = if length > 0.0 { length } else { 1.0 };
                return Scales { length, time: duration(&self.times), ..Scales::UNIT };
            }
            Coordinates::Rigid(_) => states.map(|x| &x[4..]).collect(),
            Coordinates::Pair => states.flat_map(|x| [&x[..3], &x[3..]]).collect(),
            _ => states.collect(),
        };
        scales_of(&places, &self.times)
    }

    /// Weights of the components of each sample, `[T][n]`, see [`Noise::weights`].
    #[must_use]
    pub fn weights(&self) -> Vec<Vec<f64>> {
        let columns: Vec<Vec<f64>> = self.noise.iter().map(|noise| noise.weights(&self.sampling)).collect();
        (0..self.times.len()).map(|k| columns.iter().map(|column| column[k]).collect()).collect()
    }

    /// Number of samples that count as independent, summed over components.
    #[must_use]
    pub fn independent_samples(&self) -> f64 {
        self.noise.iter().map(|noise| self.sampling.shares(noise.correlation).iter().sum::<f64>()).sum()
    }
}

/// Time from the first to the last sample.
fn duration(times: &[f64]) -> f64 {
    times.last().zip(times.first()).map_or(1.0, |(last, first)| last - first)
}

/// Scales of a path: its root mean square extent in each direction makes the axes, twice the largest one the
/// length.
fn scales_of(places: &[&[f64]], times: &[f64]) -> Scales {
    let point = |p: &&[f64]| DVec3::from(std::array::from_fn(|i| p.get(i).copied().unwrap_or(0.0)));
    let count = places.len().max(1) as f64;
    let mean = places.iter().map(point).sum::<DVec3>() / count;
    let spread: DMat3 = places.iter().map(|p| outer(point(p) - mean, point(p) - mean)).sum();
    let axes = principal_axes(&(spread * count.recip()));
    let length = 2.0 * axes[0].0.max(0.0).sqrt();
    Scales {
        length: length.max(f64::MIN_POSITIVE),
        time: duration(times),
        origin: mean.to_array(),
        axes: axes.map(|(_, axis)| axis.to_array()),
    }
}
