//! Two pendulums, one hung on the other.

use super::super::pose::Pose;
use super::law::Law;
use crate::edit::MotionEdit;
use glam::{DMat3, DVec3};
use serde_json::{Value, json};

/// Two point masses on massless rods with parallel hinges, in the plane across `axis`.
///
/// Angles are measured from the downward vertical, each in the world. Conservative: gravity `g`. There is no
/// force that is not. The origin of each body is its upper hinge, its z axis points up along the rod.
#[derive(Clone, Debug)]
pub(in super::super) struct DoublePendulum {
    pub(in super::super) pivot: DVec3,
    /// Horizontal unit vector.
    pub(in super::super) axis: DVec3,
    pub(in super::super) lengths: [f64; 2],
    /// Mass of the lower point over that of the upper.
    pub(in super::super) mass_ratio: f64,
    pub(in super::super) gravity: f64,
    pub(in super::super) angles: [f64; 2],
    pub(in super::super) rates: [f64; 2],
}

impl DoublePendulum {
    /// World axes from body axes of a rod that hangs down.
    fn hanging(&self) -> DMat3 {
        DMat3::from_cols(self.axis.cross(DVec3::Z), self.axis, DVec3::Z)
    }
}

impl Law for DoublePendulum {
    fn start(&self) -> Vec<f64> {
        [self.angles, self.rates].concat()
    }

    fn rate(&self, state: &[f64]) -> Vec<f64> {
        let (a, b, u, v) = (state[0], state[1], state[2], state[3]);
        let ([p, q], m, g) = (self.lengths, self.mass_ratio, self.gravity);
        let (sin, cos) = (a - b).sin_cos();
        let inertia = 1.0 + m * sin * sin;
        let upper = m * g * b.sin() * cos - m * sin * (p * u * u * cos + q * v * v) - (1.0 + m) * g * a.sin();
        let lower =
            (1.0 + m) * (p * u * u * sin - g * b.sin() + g * a.sin() * cos) + m * q * v * v * sin * cos;
        vec![u, v, upper / (p * inertia), lower / (q * inertia)]
    }

    fn poses(&self, state: &[f64]) -> Vec<Pose> {
        let turned = |angle| DMat3::from_axis_angle(self.axis, angle) * self.hanging();
        let (upper, lower) = (turned(state[0]), turned(state[1]));
        let joint = self.pivot - self.lengths[0] * upper.z_axis;
        vec![Pose::rigid(upper, self.pivot), Pose::rigid(lower, joint)]
    }

    #[cfg(test)]
    fn energy(&self, state: &[f64]) -> f64 {
        let (a, b, u, v) = (state[0], state[1], state[2], state[3]);
        let ([p, q], m) = (self.lengths, self.mass_ratio);
        let kinetic =
            0.5 * (1.0 + m) * (p * u).powi(2) + 0.5 * m * (q * v).powi(2) + m * p * q * u * v * (a - b).cos();
        kinetic - self.gravity * ((1.0 + m) * p * a.cos() + m * q * b.cos())
    }

    fn edited(&self, edit: MotionEdit) -> Box<dyn Law> {
        Box::new(Self {
            rates: self.rates.map(|rate| edit.velocity_scale * rate),
            gravity: edit.potential_scale * self.gravity,
            ..self.clone()
        })
    }

    fn describe(&self, body: usize) -> Value {
        json!({
            "law": "double pendulum", "kind": "conservative", "coordinates": "tree", "part": body,
            "constants": {
                "g": self.gravity, "mass_ratio": self.mass_ratio,
                "length_upper": self.lengths[0], "length_lower": self.lengths[1],
            },
            "pivot": self.pivot.to_array(), "axis": self.axis.to_array(),
            "angle": self.angles[body], "rate": self.rates[body],
            "conservative": ["g"], "nonconservative": [],
        })
    }
}
