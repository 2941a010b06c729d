//! Two bodies joined by a spring, thrown.

use super::super::pose::Pose;
use super::law::{Law, joined, vector};
use crate::edit::MotionEdit;
use glam::{DMat3, DVec3};
use serde_json::{Value, json};

/// Two balls that keep their orientation, a spring between their centres, and uniform gravity along −z.
///
/// Conservative: the spring's `k` and gravity `g`. There is no force that is not. The first ball has unit
/// mass.
#[derive(Clone, Debug)]
pub(in super::super) struct SpringPair {
    pub(in super::super) starts: [DVec3; 2],
    pub(in super::super) velocities: [DVec3; 2],
    /// Mass of the second ball over that of the first.
    pub(in super::super) mass_ratio: f64,
    pub(in super::super) k: f64,
    pub(in super::super) length: f64,
    pub(in super::super) gravity: f64,
}

impl Law for SpringPair {
    fn start(&self) -> Vec<f64> {
        joined(&[self.starts[0], self.starts[1], self.velocities[0], self.velocities[1]])
    }

    fn rate(&self, state: &[f64]) -> Vec<f64> {
        let arm = vector(state, 3) - vector(state, 0);
        let pull = self.k * (arm.length() - self.length) * arm.normalize();
        let fall = self.gravity * DVec3::NEG_Z;
        joined(&[vector(state, 6), vector(state, 9), fall + pull, fall - pull / self.mass_ratio])
    }

    fn poses(&self, state: &[f64]) -> Vec<Pose> {
        [0, 3].map(|at| Pose::rigid(DMat3::IDENTITY, vector(state, at))).to_vec()
    }

    #[cfg(test)]
    fn energy(&self, state: &[f64]) -> f64 {
        let (p, q, u, v) = (vector(state, 0), vector(state, 3), vector(state, 6), vector(state, 9));
        let m = self.mass_ratio;
        0.5 * u.length_squared()
            + 0.5 * m * v.length_squared()
            + 0.5 * self.k * (p.distance(q) - self.length).powi(2)
            + self.gravity * (p.z + m * q.z)
    }

    fn edited(&self, edit: MotionEdit) -> Box<dyn Law> {
        Box::new(Self {
            velocities: self.velocities.map(|v| edit.velocity_scale * v),
            k: edit.potential_scale * self.k,
            gravity: edit.potential_scale * self.gravity,
            ..self.clone()
        })
    }

    fn describe(&self, body: usize) -> Value {
        json!({
            "law": "spring pair", "kind": "conservative", "coordinates": "rigid", "part": body,
            "constants": {
                "k": self.k, "length": self.length, "mass_ratio": self.mass_ratio, "g": self.gravity,
            },
            "start": self.starts[body].to_array(), "velocity": self.velocities[body].to_array(),
            "conservative": ["k", "g"], "nonconservative": [],
        })
    }
}
