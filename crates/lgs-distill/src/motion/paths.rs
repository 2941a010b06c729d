//! Smooth paths of an object's particles, and the states and accelerations to match at their samples.
//!
//! Eq. 5 reads `q⁺ − 2q + q⁻ = dt² a(q, (q − q⁻)/dt)`: accelerations are second differences of the smooth
//! path, velocities backward differences, so that a perfect match rolls out onto the path itself and the
//! start needs no correction for half a kick.

use super::curve::{Curve, Order};
use super::smooth_motion::SmoothMotion;
use crate::trajectories::Trajectories;
use glam::DVec3;
use lgs_core::geometry::narrow;
use rayon::prelude::*;
use std::ops::RangeInclusive;

/// Paths on the grid from one step before the first sample to one after the last: `[n][T + 2]`.
pub(crate) struct Paths {
    rows: Vec<Vec<DVec3>>,
    dt: f64,
}

impl Paths {
    /// All particles follow the shared pose.
    pub(crate) fn shared(motion: &SmoothMotion, dt: f64) -> Self {
        let poses: Vec<_> =
            extended(&motion.shared.times, dt).into_iter().map(|t| motion.at(t, Order::Value)).collect();
        let row = |&b: &DVec3| poses.iter().map(|pose| pose.apply(b)).collect();
        Self { rows: motion.shared.shape.iter().map(row).collect(), dt }
    }

    /// Every particle is smoothed by itself, all with the degree that cross validation chooses for
    /// `validation` of them together.
    pub(crate) fn independent(
        trajectories: &Trajectories,
        degrees: RangeInclusive<usize>,
        validation: usize,
    ) -> (Self, usize) {
        let (times, dt) = (trajectories.grid(), f64::from(trajectories.dt()));
        let stride = trajectories.len().div_ceil(validation.max(1)).max(1);
        let chosen: Vec<usize> = (0..trajectories.len()).step_by(stride).collect();
        let values: Vec<f64> = (0..times.len())
            .flat_map(|s| chosen.iter().flat_map(move |&j| trajectories.at(s, j).to_array()))
            .collect();
        let (_, degree) =
            Curve::fit_by_cross_validation(&times, &values, &vec![1.0; 3 * chosen.len()], degrees);
        let grid = extended(&times, dt);
        let row = |j: usize| {
            let values: Vec<f64> = (0..times.len()).flat_map(|s| trajectories.at(s, j).to_array()).collect();
            let curve = Curve::fit(&times, &values, 3, degree);
            grid.iter().map(|&t| curve.at(t, Order::Value)).map(|p| DVec3::from_slice(&p)).collect()
        };
        (Self { rows: (0..trajectories.len()).into_par_iter().map(row).collect(), dt }, degree)
    }

    /// Spacing of the samples.
    pub(crate) fn dt(&self) -> f32 {
        self.dt as f32
    }

    /// Number of samples.
    pub(crate) fn samples(&self) -> usize {
        self.rows.first().map_or(0, |row| row.len() - 2)
    }

    /// Number of particles.
    pub(crate) fn len(&self) -> usize {
        self.rows.len()
    }

    /// Position at a sample.
    pub(crate) fn position(&self, particle: usize, sample: usize) -> DVec3 {
        self.rows[particle][sample + 1]
    }

    /// Positions of all particles at all samples, `[T][n]`.
    pub(crate) fn positions(&self) -> Vec<Vec<[f32; 3]>> {
        let row = |sample: usize| (0..self.len()).map(|j| narrow(self.position(j, sample))).collect();
        (0..self.samples()).map(row).collect()
    }

    /// Velocity that Eq. 5 has at a sample.
    pub(crate) fn velocity(&self, particle: usize, sample: usize) -> DVec3 {
        let row = &self.rows[particle];
        (row[sample + 1] - row[sample]) / self.dt
    }

    /// Acceleration that takes Eq. 5 from a sample to the next.
    pub(crate) fn acceleration(&self, particle: usize, sample: usize) -> DVec3 {
        let row = &self.rows[particle];
        (row[sample] + row[sample + 2] - 2.0 * row[sample + 1]) / (self.dt * self.dt)
    }

    /// The first `samples` samples of these particles.
    pub(crate) fn part(&self, particles: &[usize], samples: usize) -> Self {
        Self { rows: particles.iter().map(|&j| self.rows[j][..samples + 2].to_vec()).collect(), dt: self.dt }
    }

    /// Up to `count` particles, evenly spread over the list.
    pub(crate) fn spread(&self, count: usize) -> Vec<usize> {
        let n = self.len();
        let kept = count.clamp(1, n.max(1));
        (0..kept.min(n)).map(|i| i * n / kept).collect()
    }
}

/// The sample times with one step more on either side.
fn extended(times: &[f64], dt: f64) -> Vec<f64> {
    let mut grid = vec![times[0] - dt];
    grid.extend(times);
    grid.push(times[times.len() - 1] + dt);
    grid
}
