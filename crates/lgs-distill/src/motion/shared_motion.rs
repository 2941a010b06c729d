//! The motion that all particles of an object share: one pose per sample and one averaged shape.

use super::pose::{Pose, PoseKind};
use glam::{DMat3, DVec3};
use lgs_core::geometry::{outer, principal_axes};
use lgs_mechanics::noise::SampleTimes;
use std::ops::Range;

/// An object's shared motion.
#[derive(Clone, Debug)]
pub(crate) struct SharedMotion {
    /// The kind of its poses.
    pub(crate) kind: PoseKind,
    /// Sample times.
    pub(crate) times: Vec<f64>,
    /// One pose per sample.
    pub(crate) poses: Vec<Pose>,
    /// Standard deviation of each pose in units of the usual one; empty where all are alike.
    pub(crate) deviations: Vec<f64>,
    /// `[n]` particles in shape axes; the weighted centroid is the origin.
    pub(crate) shape: Vec<DVec3>,
    /// `[n]` weights of the particles after the fit, sum 1.
    pub(crate) weights: Vec<f64>,
    /// Weighted root mean square residual per coordinate.
    pub(crate) residual: f64,
}

impl SharedMotion {
    /// Spacing of the samples.
    pub(crate) fn dt(&self) -> f64 {
        self.duration() / (self.times.len() - 1) as f64
    }

    /// Time from the first sample to the last.
    pub(crate) fn duration(&self) -> f64 {
        self.times[self.times.len() - 1] - self.times[0]
    }

    /// The same at some of the samples.
    pub(crate) fn part(&self, samples: Range<usize>) -> Self {
        Self {
            times: self.times[samples.clone()].to_vec(),
            poses: self.poses[samples.clone()].to_vec(),
            deviations: self.deviations.get(samples).unwrap_or_default().to_vec(),
            ..self.clone()
        }
    }

    /// How well the poses are known at their times, which count from another one here.
    pub(crate) fn samples<'a>(&'a self, times: &'a [f64]) -> SampleTimes<'a> {
        SampleTimes { times, deviations: &self.deviations }
    }

    /// Standard deviation of a pose in units of the usual one.
    pub(crate) fn deviation(&self, sample: usize) -> f64 {
        self.samples(&self.times).deviation(sample)
    }

    /// Weighted covariance of the shape.
    pub(crate) fn covariance(&self) -> DMat3 {
        self.shape.iter().zip(&self.weights).map(|(&b, &w)| w * outer(b, b)).sum()
    }

    /// Points whose mean square under any affine error equals that of all particles: `±√3·σ_i` along the
    /// principal axes of the shape.
    pub(crate) fn sigma_points(&self) -> Vec<DVec3> {
        let axes = principal_axes(&self.covariance());
        axes.into_iter()
            .flat_map(|(variance, axis)| {
                let offset = (3.0 * variance.max(0.0)).sqrt() * axis;
                [offset, -offset]
            })
            .collect()
    }

    /// Root mean square over samples and shape of the displacement from the first sample.
    pub(crate) fn rms_displacement(&self) -> f64 {
        let points = self.sigma_points();
        let displacement = |pose: &Pose, b: DVec3| pose.apply(b).distance_squared(self.poses[0].apply(b));
        let sum: f64 =
            self.poses.iter().flat_map(|pose| points.iter().map(move |&b| displacement(pose, b))).sum();
        (sum / (points.len() * self.poses.len()) as f64).sqrt()
    }

    /// Root mean square of the displacements of some bodies.
    pub(crate) fn rms_displacement_of(bodies: &[&Self]) -> f64 {
        let squares = bodies.iter().map(|motion| motion.rms_displacement().powi(2));
        (squares.sum::<f64>() / bodies.len() as f64).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::procrustes::fit_shared_motion;
    use crate::testing::tumbling;

    #[test]
    fn sigma_points_carry_the_second_moments() {
        let motion = fit_shared_motion(&tumbling(0.0), PoseKind::Rigid);
        let moments: DMat3 = motion.sigma_points().into_iter().map(|p| outer(p, p) / 6.0).sum();
        assert!(moments.abs_diff_eq(motion.covariance(), 1e-12));
    }
}
