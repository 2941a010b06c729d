//! A rigid body on a hinge.

use super::super::pose::Pose;
use super::law::Law;
use crate::edit::MotionEdit;
use crate::thresholds::CREEPING_SPEED;
use glam::{DMat3, DVec3};
use serde_json::{Value, json};

/// Rotation by an angle θ about an axis through a fixed pivot: θ'' = −k sin θ − h sin 2θ − s θ + w + τ − d θ'
/// − d₂ |θ'| θ' − μ sign θ'.
///
/// Conservative: gravity `k` (θ = 0 hangs down), a second harmonic `h`, the torsion spring `s` and the torque
/// `w` of a weight on a string. Not conservative: the constant torque `τ`, the drags `d` and `d₂` and the dry
/// friction `μ`. The body's origin is the pivot, which may advance with the angle.
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
    pub(in super::super) second_harmonic: f64,
    pub(in super::super) stiffness: f64,
    pub(in super::super) torque_of_weight: f64,
    pub(in super::super) torque: f64,
    pub(in super::super) drag: f64,
    pub(in super::super) quadratic_drag: f64,
    pub(in super::super) friction: f64,
    /// Way of the pivot per radian: along the axis for a screw, across it for what unwinds from a string.
    pub(in super::super) advance: DVec3,
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
            second_harmonic: 0.0,
            stiffness: 0.0,
            torque_of_weight: 0.0,
            torque: 0.0,
            drag: 0.0,
            quadratic_drag: 0.0,
            friction: 0.0,
            advance: DVec3::ZERO,
        }
    }
}

impl Law for Hinge {
    fn start(&self) -> Vec<f64> {
        vec![self.angle, self.rate]
    }

    fn rate(&self, state: &[f64]) -> Vec<f64> {
        let (angle, rate) = (state[0], state[1]);
        let conservative = self.torque_of_weight
            - self.gravity * angle.sin()
            - self.second_harmonic * (2.0 * angle).sin()
            - self.stiffness * angle;
        let friction = self.friction * rate / rate.hypot(CREEPING_SPEED);
        let drag = self.drag + self.quadratic_drag * rate.abs();
        vec![rate, conservative + self.torque - drag * rate - friction]
    }

    fn poses(&self, state: &[f64]) -> Vec<Pose> {
        let place = self.pivot + state[0] * self.advance;
        vec![Pose::rigid(DMat3::from_axis_angle(self.axis, state[0]) * self.base, place)]
    }

    #[cfg(test)]
    fn energy(&self, state: &[f64]) -> f64 {
        let (angle, rate) = (state[0], state[1]);
        let gravity = self.gravity * (1.0 - angle.cos()) + self.second_harmonic * angle.sin().powi(2);
        0.5 * rate * rate + gravity + 0.5 * self.stiffness * angle * angle - self.torque_of_weight * angle
    }

    fn edited(&self, edit: MotionEdit) -> Box<dyn Law> {
        Box::new(Self {
            rate: edit.velocity_scale * self.rate,
            gravity: edit.potential_scale * self.gravity,
            second_harmonic: edit.potential_scale * self.second_harmonic,
            stiffness: edit.potential_scale * self.stiffness,
            torque_of_weight: edit.potential_scale * self.torque_of_weight,
            torque: edit.force_scale * self.torque,
            drag: edit.force_scale * self.drag,
            quadratic_drag: edit.force_scale * self.quadratic_drag,
            friction: edit.force_scale * self.friction,
            ..self.clone()
        })
    }

    fn describe(&self, _: usize) -> Value {
        let all = [
            ("k_gravity", self.gravity),
            ("k_second_harmonic", self.second_harmonic),
            ("k_spring", self.stiffness),
            ("torque_of_weight", self.torque_of_weight),
            ("torque", self.torque),
            ("drag", self.drag),
            ("quadratic_drag", self.quadratic_drag),
            ("friction", self.friction),
        ];
        let constants: serde_json::Map<String, Value> =
            all.iter().filter(|(_, v)| *v != 0.0).map(|&(name, v)| (name.to_owned(), json!(v))).collect();
        json!({
            "law": self.law, "kind": self.kind, "coordinates": "joint", "constants": constants,
            "advance": self.advance.to_array(),
            "pivot": self.pivot.to_array(), "axis": self.axis.to_array(),
            "angle": self.angle, "rate": self.rate,
            "conservative": ["k_gravity", "k_second_harmonic", "k_spring", "torque_of_weight"],
            "nonconservative": ["torque", "drag", "quadratic_drag", "friction"],
        })
    }
}
