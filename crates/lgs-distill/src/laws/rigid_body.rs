//! A linear law acting on a rigid body, stepped exactly as a rollout with a shared support steps its
//! particles.
//!
//! With an angular velocity `ω`, kicked velocities around the support's centroid are `N r`, where `N = [ω]× +
//! dt (S + B [ω]×)` has the law's derivatives `S` and `B` by position and velocity. Candidates are `(I + dt
//! N) r`, so that Eq. 6 needs only the support's moments, not its members. The next velocities are the twist
//! of the kicked ones, taken at the aligned positions: a free spin stays as it is for ever. A spring pulls
//! all of a ball towards its centre, yet the ball keeps its shape: only with the constraint is such a motion
//! one U and one Q for all particles.

use super::linear::law::Law;
use crate::shared_support::moments::SupportMoments;
use glam::{DMat3, DVec3};
use lgs_core::geometry::{axial, cross_matrix, inverse, nearest_rotation, scalar, trace};

/// State of a rigid body.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Body {
    /// World axes from shape axes.
    pub(crate) rotation: DMat3,
    /// World position of the support's centroid.
    pub(crate) center: DVec3,
    /// Velocity of the centroid that Eq. 5 starts from.
    pub(crate) velocity: DVec3,
    /// Angular velocity, world axes.
    pub(crate) spin: DVec3,
}

impl Body {
    /// Position of a shape point.
    #[inline]
    pub(crate) fn position(&self, shape: DVec3, support: &SupportMoments) -> DVec3 {
        self.center + self.rotation * (shape - support.centroid)
    }

    /// Velocity of a shape point.
    #[inline]
    pub(crate) fn velocity_at(&self, shape: DVec3, support: &SupportMoments) -> DVec3 {
        self.velocity + self.spin.cross(self.position(shape, support) - self.center)
    }

    /// One step of Eq. 5 and Eq. 6.
    pub(crate) fn step(&mut self, law: &Law, support: &SupportMoments, dt: f64) {
        law.step(&mut self.center, &mut self.velocity, dt);
        let (turn, spin) = turned(law, &self.world_covariance(support), self.spin, dt);
        self.rotation = turn * self.rotation;
        self.spin = spin;
    }

    /// The inverse of a step; rotation and spin before it by a fixed point of the forward map.
    pub(crate) fn step_back(&mut self, law: &Law, support: &SupportMoments, dt: f64) {
        law.step_back(&mut self.center, &mut self.velocity, dt);
        let after = *self;
        // Each iteration gains a factor of (spin · dt), until the error is that of rounding.
        let mut error = f64::INFINITY;
        loop {
            let (turn, spin) = turned(law, &self.world_covariance(support), self.spin, dt);
            self.rotation = turn.transpose() * after.rotation;
            let correction = after.spin - spin;
            let is_closer = correction.length() < error;
            if !is_closer {
                return;
            }
            self.spin += correction;
            error = correction.length();
        }
    }

    /// The support's covariance in world axes.
    fn world_covariance(&self, support: &SupportMoments) -> DMat3 {
        self.rotation * support.covariance * self.rotation.transpose()
    }
}

/// Rotation over a step, and the spin after it.
fn turned(law: &Law, covariance: &DMat3, spin: DVec3, dt: f64) -> (DMat3, DVec3) {
    let turning = cross_matrix(spin);
    let kicked = turning + dt * (law.position_derivative() + law.velocity_derivative() * turning);
    let momentum = kicked * *covariance;
    let candidate = *covariance + dt * momentum;
    let inertia = scalar(trace(covariance)) - *covariance;
    (nearest_rotation(&candidate), inverse(&inertia).map_or(spin, |inverse| inverse * axial(&momentum)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_body_steps_back_where_it_came_from() {
        let law = Law {
            gravity: DVec3::new(0.1, 0.0, -2.0),
            stiffness: DMat3::from_cols_array(&[-3.0, 0.2, 0.0, 0.2, -1.0, 0.1, 0.0, 0.1, -2.0]),
            damping: 0.3,
            gyration: DVec3::new(0.2, 0.5, -0.7),
            ..Law::free(DVec3::ZERO)
        };
        let support = SupportMoments::of(&crate::testing::block([0.3, 0.2, 0.1], 16, 1));
        let start = Body {
            rotation: DMat3::IDENTITY,
            center: DVec3::new(0.2, 0.1, 0.0),
            velocity: DVec3::new(1.0, 0.0, 0.5),
            spin: DVec3::new(1.0, 2.0, -3.0),
        };
        let mut body = start;
        (0..40).for_each(|_| body.step(&law, &support, 0.01));
        (0..40).for_each(|_| body.step_back(&law, &support, 0.01));
        assert!(body.center.distance(start.center) < 1e-9, "{body:?}");
        assert!(body.spin.distance(start.spin) < 1e-7, "{body:?}");
        assert!(body.rotation.abs_diff_eq(start.rotation, 1e-6), "{body:?}");
    }
}
