//! A rigid body on a hinge.

use super::super::pose::Pose;
use super::law::Law;
use crate::edit::MotionEdit;
use crate::thresholds::CREEPING_SPEED;
use glam::{DMat3, DVec3};
use serde_json::{Value, json};

/// Rotation by an angle θ about an axis through a fixed pivot: θ'' = −k sin θ − s θ + τ − d θ' − μ sign θ'.
///
/// Conservative: gravity `k` (θ = 0 hangs down) and the torsion spring `s`. Not conservative: the constant
/// torque `τ`, the drag `d` and the dry friction `μ`. The body's origin is the pivot.
#[derive(Clone, Debug)]
pub(in super::super) struct Hinge {
    pub(in super::super) law: &'static str,
    pub(in super::super) kind: &'static str,
    pub(in super::super) pivot: DVec3,
    /// Unit vector.
    pub(in super::super) axis: DVec3,
    /// World axes from body axes at θ = 0.
    pub(in super::super) base: DMat3,
    pub(in super::super) angle: f64,
    pub(in super::super) rate: f64,
    pub(in super::super) gravity: f64,
    pub(in super::super) stiffness: f64,
    pub(in super::super) torque: f64,
    pub(in super::super) drag: f64,
    pub(in super::super) friction: f64,
    /// Way along the axis per radian, as of a screw.
    pub(in super::super) pitch: f64,
}

impl Hinge {
    /// A body at rest at θ = 0 about an axis through the origin, free of forces, with world axes from body
    /// axes `base`.
    pub(in super::super) fn about(axis: DVec3, base: DMat3) -> Self {
        Self {
            law: "",
            kind: "",
            pivot: DVec3::ZERO,
            axis,
            base,
            angle: 0.0,
            rate: 0.0,
            gravity: 0.0,
            stiffness: 0.0,
            torque: 0.0,
            drag: 0.0,
            friction: 0.0,
            pitch: 0.0,
        }
    }
}

impl Law for Hinge {
    fn start(&self) -> Vec<f64> {
        vec![self.angle, self.rate]
    }

    fn rate(&self, state: &[f64]) -> Vec<f64> {
        let (angle, rate) = (state[0], state[1]);
        let conservative = -self.gravity * angle.sin() - self.stiffness * angle;
        let friction = self.friction * rate / rate.hypot(CREEPING_SPEED);
        vec![rate, conservative + self.torque - self.drag * rate - friction]
    }

    fn poses(&self, state: &[f64]) -> Vec<Pose> {
        let place = self.pivot + self.pitch * state[0] * self.axis;
        vec![Pose::rigid(DMat3::from_axis_angle(self.axis, state[0]) * self.base, place)]
    }

    #[cfg(test)]
    fn energy(&self, state: &[f64]) -> f64 {
        let (angle, rate) = (state[0], state[1]);
        0.5 * rate * rate + self.gravity * (1.0 - angle.cos()) + 0.5 * self.stiffness * angle * angle
    }

    fn edited(&self, edit: MotionEdit) -> Box<dyn Law> {
        Box::new(Self {
            rate: edit.velocity_scale * self.rate,
            gravity: edit.potential_scale * self.gravity,
            stiffness: edit.potential_scale * self.stiffness,
            torque: edit.force_scale * self.torque,
            drag: edit.force_scale * self.drag,
            friction: edit.force_scale * self.friction,
            ..self.clone()
        })
    }

    fn describe(&self, _: usize) -> Value {
        let all = [
            ("k_gravity", self.gravity),
            ("k_spring", self.stiffness),
            ("torque", self.torque),
            ("drag", self.drag),
            ("friction", self.friction),
        ];
        let constants: serde_json::Map<String, Value> =
            all.iter().filter(|(_, v)| *v != 0.0).map(|&(name, v)| (name.to_owned(), json!(v))).collect();
        json!({
            "law": self.law, "kind": self.kind, "coordinates": "joint", "constants": constants,
            "pitch": self.pitch,
            "pivot": self.pivot.to_array(), "axis": self.axis.to_array(),
            "angle": self.angle, "rate": self.rate,
            "conservative": ["k_gravity", "k_spring"], "nonconservative": ["torque", "drag", "friction"],
        })
    }
}
