//! A ball that rolls without slipping.

use super::super::pose::Pose;
use super::law::Law;
use crate::edit::MotionEdit;
use glam::{DMat3, DVec3};
use serde_json::{Value, json};

/// Rolling straight on a plane: s'' = −a − k s − c s', and the ball turns by s over its radius.
///
/// Conservative: the slope's `a`, against the direction, and a spring `k` towards the start. Not
/// conservative: the rolling resistance `c`, proportional to the speed.
#[derive(Clone, Debug)]
pub(in super::super) struct Rolling {
    pub(in super::super) start: DVec3,
    /// Unit vector.
    pub(in super::super) direction: DVec3,
    /// Unit vector across the direction, out of the plane.
    pub(in super::super) normal: DVec3,
    pub(in super::super) radius: f64,
    /// Distance from the start along the direction at t = 0.
    pub(in super::super) place: f64,
    pub(in super::super) speed: f64,
    pub(in super::super) slope: f64,
    pub(in super::super) stiffness: f64,
    pub(in super::super) resistance: f64,
}

impl Rolling {
    /// A ball that rolls freely along x from a place, on a plane across z.
    pub(in super::super) fn at(start: DVec3) -> Self {
        Self {
            start,
            direction: DVec3::X,
            normal: DVec3::Z,
            radius: 1.0,
            place: 0.0,
            speed: 0.0,
            slope: 0.0,
            stiffness: 0.0,
            resistance: 0.0,
        }
    }
}

impl Law for Rolling {
    fn start(&self) -> Vec<f64> {
        vec![self.place, self.speed]
    }

    fn rate(&self, state: &[f64]) -> Vec<f64> {
        vec![state[1], -self.slope - self.stiffness * state[0] - self.resistance * state[1]]
    }

    fn poses(&self, state: &[f64]) -> Vec<Pose> {
        let axis = self.normal.cross(self.direction);
        let rotation = DMat3::from_axis_angle(axis, state[0] / self.radius);
        vec![Pose::rigid(rotation, self.start + state[0] * self.direction)]
    }

    #[cfg(test)]
    fn energy(&self, state: &[f64]) -> f64 {
        0.5 * state[1] * state[1] + self.slope * state[0] + 0.5 * self.stiffness * state[0] * state[0]
    }

    fn edited(&self, edit: MotionEdit) -> Box<dyn Law> {
        Box::new(Self {
            speed: edit.velocity_scale * self.speed,
            slope: edit.potential_scale * self.slope,
            stiffness: edit.potential_scale * self.stiffness,
            resistance: edit.force_scale * self.resistance,
            ..self.clone()
        })
    }

    fn describe(&self, _: usize) -> Value {
        let mut description = json!({
            "law": "rolling resistance", "kind": "dissipative", "coordinates": "joint",
            "constants": {"drag": self.resistance, "radius": self.radius},
            "start": self.start.to_array(), "direction": self.direction.to_array(), "speed": self.speed,
            "conservative": [], "nonconservative": ["drag"],
        });
        if self.stiffness != 0.0 {
            description["law"] = json!("rolling on a spring");
            description["constants"]["k"] = json!(self.stiffness);
            description["conservative"] = json!(["k"]);
        }
        if self.slope != 0.0 {
            description["law"] = json!("rolling on a slope");
            description["constants"]["slope"] = json!(self.slope);
            description["conservative"] = json!(["slope"]);
        }
        description
    }
}
