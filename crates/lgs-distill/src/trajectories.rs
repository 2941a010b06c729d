//! Positions of many particles at equally spaced times, checked once where they enter.

use crate::error::DistillError;
use crate::thresholds::{FEWEST_SAMPLES, SPACING_TOLERANCE};
use glam::DVec3;
use lgs_core::geometry::wide;
use lgs_core::median;

/// Positions of `n` particles at `T` times, as a source model gives them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Trajectories {
    /// `[T]` sample times, ascending with one spacing `dt`, units of the capture's time.
    pub times: Vec<f32>,
    /// `[T][n]` positions, world units.
    pub positions: Vec<Vec<[f32; 3]>>,
    /// `[n]` weight of each particle in every fit (its opacity, for example); without weights all count
    /// alike.
    pub weights: Option<Vec<f32>>,
}

impl Trajectories {
    /// Trajectories whose particles count alike.
    #[must_use]
    pub fn unweighted(times: Vec<f32>, positions: Vec<Vec<[f32; 3]>>) -> Self {
        Self { times, positions, weights: None }
    }

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
        Self {
            times: self.times.clone(),
            positions: self.positions.iter().map(|row| indices.iter().map(|&i| row[i]).collect()).collect(),
            weights: self.weights.as_ref().map(|weights| indices.iter().map(|&i| weights[i]).collect()),
        }
    }

    /// All particles at some of the samples.
    #[must_use]
    pub(crate) fn part(&self, samples: std::ops::Range<usize>) -> Self {
        Self {
            times: self.times[samples.clone()].to_vec(),
            positions: self.positions[samples].to_vec(),
            weights: self.weights.clone(),
        }
    }

    /// Checks lengths, spacing and finiteness.
    ///
    /// # Errors
    /// The first defect found.
    pub fn validate(&self) -> Result<(), DistillError> {
        let samples = self.times.len();
        if samples < FEWEST_SAMPLES {
            return Err(DistillError::TooFewSamples { expected: FEWEST_SAMPLES, found: samples });
        }
        same_length("positions", samples, self.positions.len())?;
        if let Some(index) = self.first_uneven_time() {
            return Err(DistillError::UnevenTimes { index });
        }
        for (sample, row) in self.positions.iter().enumerate() {
            same_length("positions of a sample", self.len(), row.len())?;
            if let Some(particle) = row.iter().position(|p| p.iter().any(|v| !v.is_finite())) {
                return Err(DistillError::NonFinite { sample, particle });
            }
        }
        match &self.weights {
            Some(weights) => same_length("weights", self.len(), weights.len()),
            None => Ok(()),
        }
    }

    /// Index of the first sample time that is off the even spacing.
    fn first_uneven_time(&self) -> Option<usize> {
        let dt = f64::from(self.dt());
        let is_even = |pair: &[f32]| {
            let gap = f64::from(pair[1]) - f64::from(pair[0]);
            dt > 0.0 && (gap - dt).abs() <= SPACING_TOLERANCE * dt
        };
        self.times.windows(2).position(|pair| !is_even(pair)).map(|index| index + 1)
    }

    /// `[n]` weights in double precision, none negative; all 1 where there are none.
    pub(crate) fn particle_weights(&self) -> Vec<f64> {
        match &self.weights {
            Some(weights) => weights.iter().map(|&w| f64::from(w).max(0.0)).collect(),
            None => vec![1.0; self.len()],
        }
    }

    /// A position in double precision.
    #[inline]
    pub(crate) fn at(&self, sample: usize, particle: usize) -> DVec3 {
        wide(self.positions[sample][particle])
    }

    /// The path of a particle in double precision, `[T]`.
    pub(crate) fn path(&self, particle: usize) -> Vec<DVec3> {
        (0..self.times.len()).map(|sample| self.at(sample, particle)).collect()
    }

    /// Where a particle is on average over the samples, world units.
    #[must_use]
    pub fn mean_place(&self, particle: usize) -> DVec3 {
        self.path(particle).into_iter().sum::<DVec3>() / self.times.len() as f64
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
        median(magnitudes).unwrap_or(0.0) / (0.6745 * 70f64.sqrt())
    }

    /// Root mean square over samples and particles of the displacement from the first sample.
    pub(crate) fn rms_displacement(&self) -> f64 {
        let mut sum = 0.0;
        for row in &self.positions {
            for (now, start) in row.iter().zip(&self.positions[0]) {
                sum += wide(*now).distance_squared(wide(*start));
            }
        }
        (sum / (self.len().max(1) * self.times.len()) as f64).sqrt()
    }
}

/// Checks the length of an array.
pub(crate) fn same_length(field: &'static str, expected: usize, found: usize) -> Result<(), DistillError> {
    if found == expected { Ok(()) } else { Err(DistillError::Length { field, expected, found }) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(samples: usize) -> Trajectories {
        let times: Vec<f32> = (0..samples).map(|i| 0.01 * i as f32).collect();
        let positions = times.iter().map(|&t| vec![[t, 0.0, 0.0], [0.0, t, 1.0]]).collect();
        Trajectories::unweighted(times, positions)
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
