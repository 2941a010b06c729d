//! A ball that rolls without slipping.

use super::super::pose::Pose;
use super::law::Law;
use crate::edit::MotionEdit;
use glam::{DMat3, DVec3};
use serde_json::{Value, json};

/// Rolling straight on a level floor: s'' = −c s', and the ball turns by s over its radius.
///
/// Not conservative: the rolling resistance `c`, proportional to the speed. There is no force that is.
#[derive(Clone, Debug)]
pub(in super::super) struct Rolling {
    pub(in super::super) start: DVec3,
    /// Horizontal unit vector.
    pub(in super::super) direction: DVec3,
    pub(in super::super) radius: f64,
    pub(in super::super) speed: f64,
    pub(in super::super) resistance: f64,
}

impl Law for Rolling {
    fn start(&self) -> Vec<f64> {
        vec![0.0, self.speed]
    }

    fn rate(&self, state: &[f64]) -> Vec<f64> {
        vec![state[1], -self.resistance * state[1]]
    }

    fn poses(&self, state: &[f64]) -> Vec<Pose> {
        let axis = DVec3::Z.cross(self.direction);
        let rotation = DMat3::from_axis_angle(axis, state[0] / self.radius);
        vec![Pose::rigid(rotation, self.start + state[0] * self.direction)]
    }

    #[cfg(test)]
    fn energy(&self, state: &[f64]) -> f64 {
        0.5 * state[1] * state[1]
    }

    fn edited(&self, edit: MotionEdit) -> Box<dyn Law> {
        Box::new(Self {
            speed: edit.velocity_scale * self.speed,
            resistance: edit.force_scale * self.resistance,
            ..self.clone()
        })
    }

    fn describe(&self, _: usize) -> Value {
        json!({
            "law": "rolling resistance", "kind": "dissipative", "coordinates": "joint",
            "constants": {"drag": self.resistance, "radius": self.radius},
            "start": self.start.to_array(), "direction": self.direction.to_array(), "speed": self.speed,
            "conservative": [], "nonconservative": ["drag"],
        })
    }
}
