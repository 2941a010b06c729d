//! Noise of tracks: its level and its correlation from sample to sample, for each object and coordinate.
//!
//! A track is a smooth path and an autoregressive process of first order, `e_{k+1} = ρ e_k + ε`. The smooth
//! path is a polynomial in time whose degree is chosen by the Bayesian information criterion; ρ and the
//! variance follow from the restricted likelihood, which accounts for what the path takes up of the noise.
//! Everything is in units of the track, and nothing depends on them.

mod polynomial;
mod restricted;
#[cfg(test)]
mod tests;

pub use restricted::SmoothPath;

use crate::coordinates::Coordinates;

/// Noise of one coordinate of a track.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    /// Standard deviation, units of the track.
    pub deviation: f64,
    /// Correlation of neighbouring samples, ρ.
    pub correlation: f64,
}

impl Noise {
    /// Share of the samples that count as independent, `(1 − ρ)/(1 + ρ)`.
    #[must_use]
    pub fn share(&self) -> f64 {
        (1.0 - self.correlation) / (1.0 + self.correlation)
    }

    /// Factor that turns residuals into ones whose sum of squares is a χ² of the independent samples.
    #[must_use]
    pub fn weight(&self) -> f64 {
        self.share().sqrt() / self.deviation
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
