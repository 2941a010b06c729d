//! A body that vibrates and stretches in two modes, at a place or in flight.

use super::super::pose::Pose;
use super::law::{Law, joined, vector};
use crate::edit::MotionEdit;
use glam::{DMat3, DVec3};
use serde_json::{Value, json};

/// Every point is the identity plus two amplitudes times a mode's matrix, applied to the point at rest, about
/// a centre that is fixed or falls: a'' = −ω² a − d a' for each amplitude.
///
/// Conservative: both `ω²` and gravity along −z. Not conservative: both dampings `d`.
#[derive(Clone, Debug)]
pub(in super::super) struct Modal {
    pub(in super::super) center: DVec3,
    /// Displacement of a point per unit of amplitude and of its place at rest.
    pub(in super::super) modes: [DMat3; 2],
    pub(in super::super) amplitudes: [f64; 2],
    pub(in super::super) rates: [f64; 2],
    pub(in super::super) stiffness: [f64; 2],
    pub(in super::super) damping: [f64; 2],
    /// Velocity of the centre.
    pub(in super::super) velocity: DVec3,
    pub(in super::super) gravity: f64,
}

impl Law for Modal {
    fn start(&self) -> Vec<f64> {
        let own = [self.amplitudes, self.rates].concat();
        [own, joined(&[self.center, self.velocity])].concat()
    }

    fn rate(&self, state: &[f64]) -> Vec<f64> {
        let acceleration = |i: usize| -self.stiffness[i] * state[i] - self.damping[i] * state[2 + i];
        let own = vec![state[2], state[3], acceleration(0), acceleration(1)];
        [own, joined(&[vector(state, 7), self.gravity * DVec3::NEG_Z])].concat()
    }

    fn poses(&self, state: &[f64]) -> Vec<Pose> {
        let stretch = DMat3::IDENTITY + self.modes[0] * state[0] + self.modes[1] * state[1];
        vec![Pose::affine(stretch, vector(state, 4))]
    }

    #[cfg(test)]
    fn energy(&self, state: &[f64]) -> f64 {
        let of = |i: usize| 0.5 * (state[2 + i].powi(2) + self.stiffness[i] * state[i].powi(2));
        of(0) + of(1) + 0.5 * vector(state, 7).length_squared() + self.gravity * state[6]
    }

    fn edited(&self, edit: MotionEdit) -> Box<dyn Law> {
        Box::new(Self {
            rates: self.rates.map(|v| edit.velocity_scale * v),
            stiffness: self.stiffness.map(|k| edit.potential_scale * k),
            damping: self.damping.map(|d| edit.force_scale * d),
            velocity: edit.velocity_scale * self.velocity,
            gravity: edit.potential_scale * self.gravity,
            ..self.clone()
        })
    }

    fn describe(&self, _: usize) -> Value {
        let columns = |m: DMat3| m.to_cols_array_2d();
        let mut description = json!({
            "law": "two vibration modes", "kind": "dissipative", "coordinates": "modal",
            "constants": {
                "omega2_first": self.stiffness[0], "omega2_second": self.stiffness[1],
                "damping_first": self.damping[0], "damping_second": self.damping[1],
            },
            "center_at_rest": self.center.to_array(), "modes": self.modes.map(columns),
            "amplitudes": self.amplitudes, "rates": self.rates,
            "conservative": ["omega2_first", "omega2_second"],
            "nonconservative": ["damping_first", "damping_second"],
        });
        if self.gravity != 0.0 {
            description["law"] = json!("two vibration modes in flight");
            description["constants"]["g"] = json!(self.gravity);
            description["conservative"] = json!(["omega2_first", "omega2_second", "g"]);
            description["velocity"] = json!(self.velocity.to_array());
        }
        description
    }
}
