//! First and second moments of a shared support, all that Eq. 6 needs to know of it under a law linear in
//! position and velocity.

use glam::{DMat3, DVec3};
use lgs_core::geometry::outer;

/// Moments of a shared support, shape axes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SupportMoments {
    /// Mean of the members.
    pub(crate) centroid: DVec3,
    /// Covariance of the members.
    pub(crate) covariance: DMat3,
}

impl SupportMoments {
    /// Moments of these shape points.
    pub(crate) fn of(points: &[DVec3]) -> Self {
        let part = 1.0 / points.len().max(1) as f64;
        let centroid: DVec3 = part * points.iter().sum::<DVec3>();
        let covariance = points.iter().map(|&p| part * outer(p - centroid, p - centroid)).sum();
        Self { centroid, covariance }
    }
}
