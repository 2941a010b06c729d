//! Noise of tracks: its level and its correlation from sample to sample, for each object and coordinate.
//!
//! A track is a smooth path and an autoregressive process of first order, `e_{k+1} = ρ e_k + ε`, times how
//! uncertain each sample is beside the usual one. The smooth
//! path is a series of polynomials in time whose coefficients are integrated out of the likelihood, so that ρ
//! and the variance account for what the path takes up of the noise. Everything is in units of the track, and
//! nothing depends on them.

mod left;
mod polynomial;
mod sampling;
mod smooth;
#[cfg(test)]
mod tests;

pub use left::LeftNoise;
pub use sampling::{SampleTimes, Sampling};
pub use smooth::SmoothPath;

use crate::coordinates::Coordinates;

/// Noise of one coordinate of a track.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    /// Standard deviation of the usual sample, units of the track.
    pub deviation: f64,
    /// Correlation of samples at the usual distance in time, ρ.
    pub correlation: f64,
}

impl Noise {
    /// Factors, one for each sample, that turn residuals into ones whose sum of squares is a χ² of the
    /// samples that count as independent.
    #[must_use]
    pub fn weights(&self, sampling: &Sampling) -> Vec<f64> {
        let shares = sampling.shares(self.correlation);
        let deviations = sampling.deviations().iter().map(|deviation| deviation * self.deviation);
        shares.iter().zip(deviations).map(|(share, deviation)| share.sqrt() / deviation).collect()
    }
}

impl SmoothPath {
    /// Noise of the components of a change of a configuration (`Coordinates::difference`): rotation vectors
    /// vary twice as much as the components of a quaternion.
    #[must_use]
    pub fn noise_of_changes(&self, coordinates: &Coordinates) -> Vec<Noise> {
        if !coordinates.has_rotation() {
            return self.noise.clone();
        }
        let square: f64 = self.noise[..4].iter().map(|noise| noise.deviation.powi(2)).sum();
        // The four components vary in three directions.
        let turn = Noise { deviation: 2.0 * (square / 3.0).sqrt(), ..self.noise[0] };
        [vec![turn; 3], self.noise[4..].to_vec()].concat()
    }
}
