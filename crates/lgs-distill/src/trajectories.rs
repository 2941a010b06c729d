//! Positions of many particles at equally spaced times, checked once where they enter.

use crate::DistillError;
use crate::dense::{V3, median, wide};

/// Positions of `n` particles at `T` times, as a source model gives them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Trajectories {
    /// Sample times, ascending with one spacing `dt`.
    pub times: Vec<f32>,
    /// `[T][n]` positions, world units.
    pub positions: Vec<Vec<[f32; 3]>>,
}

/// Fewest samples a law of motion can be read from.
const FEWEST_SAMPLES: usize = 8;
/// How far sample times may be from an even spacing, as a part of it.
const SPACING_TOLERANCE: f64 = 0.02;

impl Trajectories {
    /// Number of particles.
    #[must_use]
    pub fn len(&self) -> usize {
        self.positions.first().map_or(0, Vec::len)
    }

    /// Whether there are no particles.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The spacing of the samples.
    #[must_use]
    pub fn dt(&self) -> f32 {
        match (self.times.first(), self.times.last()) {
            (Some(first), Some(last)) if self.times.len() > 1 => {
                (last - first) / (self.times.len() - 1) as f32
            }
            _ => 0.0,
        }
    }

    /// The particles at `indices`, in that order.
    #[must_use]
    pub fn select(&self, indices: &[usize]) -> Self {
        let positions = self.positions.iter().map(|row| indices.iter().map(|&i| row[i]).collect()).collect();
        Self { times: self.times.clone(), positions }
    }

    /// Checks lengths, spacing and finiteness.
    ///
    /// # Errors
    /// The first defect found.
    pub fn validate(&self) -> Result<(), DistillError> {
        let (samples, n, dt) = (self.times.len(), self.len(), f64::from(self.dt()));
        if samples < FEWEST_SAMPLES {
            return Err(DistillError::TooFewSamples { expected: FEWEST_SAMPLES, found: samples });
        }
        if self.positions.len() != samples {
            return Err(DistillError::Length {
                field: "positions",
                expected: samples,
                found: self.positions.len(),
            });
        }
        for (index, pair) in self.times.windows(2).enumerate() {
            let gap = f64::from(pair[1]) - f64::from(pair[0]);
            let even = dt > 0.0 && (gap - dt).abs() <= SPACING_TOLERANCE * dt;
            if !even {
                return Err(DistillError::UnevenTimes { index: index + 1 });
            }
        }
        for (sample, row) in self.positions.iter().enumerate() {
            if row.len() != n {
                return Err(DistillError::Length {
                    field: "positions of a sample",
                    expected: n,
                    found: row.len(),
                });
            }
            if let Some(particle) = row.iter().position(|p| p.iter().any(|v| !v.is_finite())) {
                return Err(DistillError::NonFinite { sample, particle });
            }
        }
        Ok(())
    }

    /// A position in double precision.
    #[inline]
    pub(crate) fn at(&self, sample: usize, particle: usize) -> V3 {
        wide(self.positions[sample][particle])
    }

    /// Sample times in double precision on the exact grid.
    pub(crate) fn grid(&self) -> Vec<f64> {
        let (start, dt) = (f64::from(self.times[0]), f64::from(self.dt()));
        (0..self.times.len()).map(|i| start + dt * i as f64).collect()
    }

    /// Standard deviation per coordinate of the part of the samples that is independent from one to the next.
    ///
    /// Fourth differences remove every smooth motion; independent noise of variance σ² leaves them a variance
    /// of 70 σ² (the sum of the squared binomials 1 4 6 4 1). The median over everything ignores outliers.
    pub(crate) fn independent_noise(&self) -> f64 {
        let stride = (self.len() / 2000).max(1);
        let mut magnitudes = Vec::new();
        for particle in (0..self.len()).step_by(stride) {
            for s in 4..self.times.len() {
                for axis in 0..3 {
                    let x = |back: usize| f64::from(self.positions[s - back][particle][axis]);
                    magnitudes.push((x(0) - 4.0 * x(1) + 6.0 * x(2) - 4.0 * x(3) + x(4)).abs());
                }
            }
        }
        median(magnitudes) / (0.6745 * 70f64.sqrt())
    }

    /// Root mean square over samples and particles of the displacement from the first sample.
    pub(crate) fn rms_displacement(&self) -> f64 {
        let mut sum = 0.0;
        for row in &self.positions {
            for (now, start) in row.iter().zip(&self.positions[0]) {
                sum += crate::dense::norm2(crate::dense::sub(wide(*now), wide(*start)));
            }
        }
        (sum / (self.len().max(1) * self.times.len()) as f64).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(samples: usize) -> Trajectories {
        let times: Vec<f32> = (0..samples).map(|i| 0.01 * i as f32).collect();
        let positions = times.iter().map(|&t| vec![[t, 0.0, 0.0], [0.0, t, 1.0]]).collect();
        Trajectories { times, positions }
    }

    #[test]
    fn defects_are_named() {
        assert!(line(20).validate().is_ok());
        assert!(matches!(line(3).validate(), Err(DistillError::TooFewSamples { .. })));
        let mut t = line(20);
        t.positions[4][1][2] = f32::NAN;
        assert!(matches!(t.validate(), Err(DistillError::NonFinite { sample: 4, particle: 1 })));
        let mut t = line(20);
        t.times[7] += 0.005;
        assert!(matches!(t.validate(), Err(DistillError::UnevenTimes { index: 7 })));
        let mut t = line(20);
        t.positions[3].pop();
        assert!(matches!(t.validate(), Err(DistillError::Length { .. })));
    }
}
