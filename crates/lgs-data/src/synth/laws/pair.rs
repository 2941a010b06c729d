//! Two bodies joined by a spring, or that attract each other, thrown.

use super::super::pose::Pose;
use super::law::{Law, joined, vector};
use crate::edit::MotionEdit;
use glam::{DMat3, DVec3};
use serde_json::{Value, json};

/// What pulls two bodies together, per unit of mass of the first.
#[derive(Clone, Copy, Debug)]
pub(in super::super) enum Pull {
    /// A spring with a rest length.
    Spring { k: f64, length: f64 },
    /// An attraction `k / r²`.
    Attraction { k: f64 },
}

impl Pull {
    fn at(self, distance: f64) -> f64 {
        match self {
            Self::Spring { k, length } => k * (distance - length),
            Self::Attraction { k } => k / (distance * distance),
        }
    }

    #[cfg(test)]
    fn energy(self, distance: f64) -> f64 {
        match self {
            Self::Spring { k, length } => 0.5 * k * (distance - length).powi(2),
            Self::Attraction { k } => -k / distance,
        }
    }

    fn scaled(self, factor: f64) -> Self {
        match self {
            Self::Spring { k, length } => Self::Spring { k: factor * k, length },
            Self::Attraction { k } => Self::Attraction { k: factor * k },
        }
    }
}

/// Two balls that keep their orientation, pulled together at their centres, and uniform gravity along −z.
///
/// Conservative: the pull's `k` and gravity `g`. There is no force that is not. The first ball has unit mass.
#[derive(Clone, Debug)]
pub(in super::super) struct Pair {
    pub(in super::super) starts: [DVec3; 2],
    pub(in super::super) velocities: [DVec3; 2],
    /// Mass of the second ball over that of the first.
    pub(in super::super) mass_ratio: f64,
    pub(in super::super) pull: Pull,
    pub(in super::super) gravity: f64,
}

impl Law for Pair {
    fn start(&self) -> Vec<f64> {
        joined(&[self.starts[0], self.starts[1], self.velocities[0], self.velocities[1]])
    }

    fn rate(&self, state: &[f64]) -> Vec<f64> {
        let arm = vector(state, 3) - vector(state, 0);
        let pull = self.pull.at(arm.length()) * arm.normalize();
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
            + self.pull.energy(p.distance(q))
            + self.gravity * (p.z + m * q.z)
    }

    fn edited(&self, edit: MotionEdit) -> Box<dyn Law> {
        Box::new(Self {
            velocities: self.velocities.map(|v| edit.velocity_scale * v),
            pull: self.pull.scaled(edit.potential_scale),
            gravity: edit.potential_scale * self.gravity,
            ..self.clone()
        })
    }

    fn describe(&self, body: usize) -> Value {
        let mut constants = json!({"mass_ratio": self.mass_ratio, "g": self.gravity});
        let law = match self.pull {
            Pull::Spring { k, length } => {
                (constants["k"], constants["length"]) = (json!(k), json!(length));
                "spring pair"
            }
            Pull::Attraction { k } => {
                constants["k"] = json!(k);
                "attracting pair"
            }
        };
        json!({
            "law": law, "kind": "conservative", "coordinates": "rigid", "part": body,
            "constants": constants,
            "start": self.starts[body].to_array(), "velocity": self.velocities[body].to_array(),
            "conservative": ["k", "g"], "nonconservative": [],
        })
    }
}
