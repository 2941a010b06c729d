//! A rigid body that turns freely or about a fixed point: Euler's equations.

use super::super::pose::Pose;
use super::law::{Law, joined, vector};
use crate::edit::MotionEdit;
use crate::thresholds::CREEPING_SPEED;
use glam::{DMat3, DQuat, DVec3};
use lgs_core::geometry::{components, quaternion};
use serde_json::{Value, json};

/// Rotation with principal moments of inertia along the body's axes, about a fixed point or one that flies.
///
/// Conservative: `weight`, the torque of gravity on a centre of mass on the body's z axis (mass × g ×
/// distance from the fixed point, in the units of the inertia), and the `gravity` that moves the origin. Not
/// conservative: a linear drag and a dry friction, each of the velocity and of the spin, and a `thrust` along
/// the body's z axis. The state is the
/// rotation (w x y z), the angular velocity in body axes, and place and velocity of the body's origin.
#[derive(Clone, Debug)]
pub(in super::super) struct RigidBody {
    pub(in super::super) law: &'static str,
    pub(in super::super) coordinates: &'static str,
    pub(in super::super) origin: DVec3,
    pub(in super::super) drift: DVec3,
    pub(in super::super) rotation: DQuat,
    /// Angular velocity, body axes.
    pub(in super::super) spin: DVec3,
    /// Principal moments about the origin.
    pub(in super::super) inertia: DVec3,
    pub(in super::super) weight: f64,
    pub(in super::super) gravity: f64,
    /// Rates at which velocity and spin fall.
    pub(in super::super) drag: [f64; 2],
    /// Decelerations of velocity and spin of a constant size.
    pub(in super::super) friction: [f64; 2],
    /// Acceleration along the body's z axis.
    pub(in super::super) thrust: f64,
}

impl RigidBody {
    /// A body with moments of inertia that moves and turns freely.
    pub(in super::super) fn free(inertia: DVec3) -> Self {
        Self {
            law: "free rigid body",
            coordinates: "rigid",
            origin: DVec3::ZERO,
            drift: DVec3::ZERO,
            rotation: DQuat::IDENTITY,
            spin: DVec3::ZERO,
            inertia,
            weight: 0.0,
            gravity: 0.0,
            drag: [0.0; 2],
            friction: [0.0; 2],
            thrust: 0.0,
        }
    }

    /// What slows down the velocity (0) or the spin (1), per unit of inertia.
    fn slowing(&self, which: usize, rate: DVec3) -> DVec3 {
        -(self.drag[which] + self.friction[which] / rate.length().hypot(CREEPING_SPEED)) * rate
    }

    /// The rotation in a state, of unit length.
    fn rotation(state: &[f64]) -> DQuat {
        quaternion(state).normalize()
    }
}

impl Law for RigidBody {
    fn start(&self) -> Vec<f64> {
        [components(self.rotation).to_vec(), joined(&[self.spin, self.origin, self.drift])].concat()
    }

    fn rate(&self, state: &[f64]) -> Vec<f64> {
        let (turn, v) = (state[0], vector(state, 1));
        let spin = vector(state, 4);
        let down = Self::rotation(state).conjugate() * DVec3::NEG_Z;
        let torque = self.weight * DVec3::Z.cross(down);
        let turning = (torque - spin.cross(self.inertia * spin)) / self.inertia + self.slowing(1, spin);
        let turned = 0.5 * (turn * spin + v.cross(spin));
        let velocity = vector(state, 10);
        let thrust = self.thrust * (Self::rotation(state) * DVec3::Z);
        let moving = self.gravity * DVec3::NEG_Z + self.slowing(0, velocity) + thrust;
        [vec![-0.5 * v.dot(spin)], joined(&[turned, turning, velocity, moving])].concat()
    }

    fn poses(&self, state: &[f64]) -> Vec<Pose> {
        vec![Pose::rigid(DMat3::from_quat(Self::rotation(state)), vector(state, 7))]
    }

    #[cfg(test)]
    fn energy(&self, state: &[f64]) -> f64 {
        let (spin, velocity) = (vector(state, 4), vector(state, 10));
        let of_rotation =
            0.5 * spin.dot(self.inertia * spin) + self.weight * (Self::rotation(state) * DVec3::Z).z;
        of_rotation + 0.5 * velocity.length_squared() + self.gravity * vector(state, 7).z
    }

    fn edited(&self, edit: MotionEdit) -> Box<dyn Law> {
        Box::new(Self {
            drift: edit.velocity_scale * self.drift,
            spin: edit.velocity_scale * self.spin,
            weight: edit.potential_scale * self.weight,
            gravity: edit.potential_scale * self.gravity,
            drag: self.drag.map(|drag| edit.force_scale * drag),
            friction: self.friction.map(|friction| edit.force_scale * friction),
            thrust: edit.force_scale * self.thrust,
            ..self.clone()
        })
    }

    fn describe(&self, _: usize) -> Value {
        let i = self.inertia;
        let forces = [
            ("g", self.gravity),
            ("drag", self.drag[0]),
            ("spin_drag", self.drag[1]),
            ("friction", self.friction[0]),
            ("spin_friction", self.friction[1]),
            ("thrust", self.thrust),
        ];
        let own: Vec<(&str, f64)> = forces.into_iter().filter(|(_, value)| *value != 0.0).collect();
        let slows = own.iter().any(|(name, _)| name.ends_with("drag") || name.ends_with("friction"));
        let kind = if self.thrust != 0.0 {
            "forced"
        } else if slows {
            "dissipative"
        } else {
            "conservative"
        };
        let mut description = json!({
            "law": self.law, "kind": kind,
            "coordinates": self.coordinates,
            "constants": {
                "inertia_ratio_xz": i.x / i.z, "inertia_ratio_yz": i.y / i.z,
                "weight_over_inertia": self.weight / i.x,
            },
            "origin": self.origin.to_array(), "drift": self.drift.to_array(),
            "spin_body": self.spin.to_array(),
            "rotation": components(self.rotation),
            "conservative": ["weight_over_inertia"], "nonconservative": [],
        });
        for (name, value) in own {
            description["constants"][name] = json!(value);
            let list = if name == "g" { "conservative" } else { "nonconservative" };
            description[list].as_array_mut().into_iter().for_each(|list| list.push(json!(name)));
        }
        description
    }
}
