//! Laws of motion linear in position and velocity, and their steps by Eq. 5 in double precision.
//!
//! `a = g + S (q − center) − d v + w × v`: a quadratic potential (uniform field `g`, symmetric stiffness `S`)
//! and a structured force (method §4.2) with constant coefficients (damping `d ≥ 0`, gyroscopic rate `w`).
//! [`super::terms::Terms`] says which parts a law has; a law with few parts extrapolates far better than one
//! whose extra parts have fitted noise.

use glam::{DMat3, DVec3};
use lgs_core::geometry::{cross_matrix, principal_axes, scalar};
use serde::{Deserialize, Serialize};

/// Constants of a law (world units and axes).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Law {
    /// Position at which the stiffness part vanishes.
    pub center: DVec3,
    /// Uniform acceleration.
    pub gravity: DVec3,
    /// Symmetric matrix, acceleration per displacement from `center`; in files a list of rows.
    #[serde(with = "rows")]
    pub stiffness: DMat3,
    /// Damping rate, ≥ 0.
    pub damping: f64,
    /// Gyroscopic rate: acceleration `gyration × v`.
    pub gyration: DVec3,
}

impl Law {
    /// The law of a free body: no force at all.
    pub(crate) fn free(center: DVec3) -> Self {
        Self { center, gravity: DVec3::ZERO, stiffness: DMat3::ZERO, damping: 0.0, gyration: DVec3::ZERO }
    }

    /// The acceleration at a state.
    #[inline]
    pub(crate) fn acceleration(&self, q: DVec3, v: DVec3) -> DVec3 {
        self.field(q) + self.gyration.cross(v) - self.damping * v
    }

    /// The acceleration at a position for a body at rest, which the potential gives.
    #[inline]
    fn field(&self, q: DVec3) -> DVec3 {
        self.gravity + self.stiffness * (q - self.center)
    }

    /// Derivative of the acceleration by the position.
    #[inline]
    pub(crate) fn position_derivative(&self) -> DMat3 {
        self.stiffness
    }

    /// Derivative of the acceleration by the velocity.
    #[inline]
    pub(crate) fn velocity_derivative(&self) -> DMat3 {
        cross_matrix(self.gyration) - scalar(self.damping)
    }

    /// The velocity that Eq. 5 starts from so that its positions pass through `q` with the derivative
    /// `velocity`: half a kick back.
    #[inline]
    pub(crate) fn starting_velocity(&self, q: DVec3, velocity: DVec3, dt: f64) -> DVec3 {
        velocity - 0.5 * dt * self.acceleration(q, velocity)
    }

    /// One step of Eq. 5.
    #[inline]
    pub(crate) fn step(&self, q: &mut DVec3, v: &mut DVec3, dt: f64) {
        *v += dt * self.acceleration(*q, *v);
        *q += dt * *v;
    }

    /// The exact inverse of [`Self::step`]; not finite where there is none.
    #[inline]
    pub(crate) fn step_back(&self, q: &mut DVec3, v: &mut DVec3, dt: f64) {
        *q -= dt * *v;
        let kick = DMat3::IDENTITY + dt * self.velocity_derivative();
        *v = kick.inverse() * (*v - dt * self.field(*q));
    }

    /// Whether the law is one that a body can have: it does not drive its own motion.
    pub(crate) fn is_passive(&self) -> bool {
        self.damping >= 0.0
    }

    /// The law with the nearest constants that a body can have.
    pub(crate) fn made_passive(self) -> Self {
        Self { damping: self.damping.max(0.0), ..self }
    }

    /// The largest rate at which the law moves anything by itself, 1/time; a step of a few hundredths of its
    /// inverse resolves it.
    pub(crate) fn fastest_rate(&self) -> f64 {
        let stiffness = self.stiffness.to_cols_array().iter().map(|s| s * s).sum::<f64>().sqrt().sqrt();
        stiffness.max(self.damping.abs()).max(self.gyration.length())
    }

    /// The exponent per time at which the potential alone drives positions apart, 0 for a stable one.
    pub(crate) fn growth_rate(&self) -> f64 {
        principal_axes(&self.stiffness)[0].0.max(0.0).sqrt()
    }
}

/// A symmetric matrix in a file: a list of three rows.
mod rows {
    use glam::DMat3;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub(super) fn serialize<S: Serializer>(matrix: &DMat3, serializer: S) -> Result<S::Ok, S::Error> {
        matrix.transpose().to_cols_array_2d().serialize(serializer)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<DMat3, D::Error> {
        Ok(DMat3::from_cols_array_2d(&<[[f64; 3]; 3]>::deserialize(deserializer)?).transpose())
    }
}

/// A law with every term, for tests.
#[cfg(test)]
pub(crate) fn example() -> Law {
    Law {
        center: DVec3::new(0.5, -0.25, 1.0),
        gravity: DVec3::new(0.5, -1.0, -2.0),
        stiffness: DMat3::from_cols_array(&[-4.0, 0.5, 0.1, 0.5, -3.0, 0.2, 0.1, 0.2, 1.0]),
        damping: 0.7,
        gyration: DVec3::new(0.3, -0.8, 2.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stepping_back_undoes_stepping() {
        let law = example();
        let start = (DVec3::new(0.3, 0.1, -0.2), DVec3::new(1.0, 0.5, -2.0));
        let (mut q, mut v) = start;
        (0..50).for_each(|_| law.step(&mut q, &mut v, 0.01));
        (0..50).for_each(|_| law.step_back(&mut q, &mut v, 0.01));
        assert!(q.distance(start.0) < 1e-10 && v.distance(start.1) < 1e-10);
    }

    #[test]
    fn derivatives_are_those_of_the_acceleration() {
        let law = example();
        let (q, v, h) = (DVec3::new(0.3, 0.1, -0.2), DVec3::new(1.0, 0.5, -2.0), 0.5);
        for axis in DVec3::AXES {
            let by_q = (law.acceleration(q + h * axis, v) - law.acceleration(q, v)) / h;
            let by_v = (law.acceleration(q, v + h * axis) - law.acceleration(q, v)) / h;
            assert!(by_q.distance(law.position_derivative() * axis) < 1e-12);
            assert!(by_v.distance(law.velocity_derivative() * axis) < 1e-12);
        }
    }
}
