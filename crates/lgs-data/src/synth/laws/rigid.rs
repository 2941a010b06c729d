//! A rigid body that turns freely or about a fixed point: Euler's equations.

use super::super::pose::Pose;
use super::law::{Law, joined, vector};
use crate::edit::MotionEdit;
use glam::{DMat3, DQuat, DVec3};
use lgs_core::geometry::{components, quaternion};
use serde_json::{Value, json};

/// Rotation with principal moments of inertia along the body's axes, about a point that moves evenly.
///
/// Conservative: `weight`, the torque of gravity on a centre of mass on the body's z axis (mass × g ×
/// distance from the fixed point, in the units of the inertia). There is no force that is not. The state is
/// the rotation (w x y z), the angular velocity in body axes and the place of the body's origin.
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
}

impl RigidBody {
    /// The rotation in a state, of unit length.
    fn rotation(state: &[f64]) -> DQuat {
        quaternion(state).normalize()
    }
}

impl Law for RigidBody {
    fn start(&self) -> Vec<f64> {
        [components(self.rotation).to_vec(), joined(&[self.spin, self.origin])].concat()
    }

    fn rate(&self, state: &[f64]) -> Vec<f64> {
        let (turn, v) = (state[0], vector(state, 1));
        let spin = vector(state, 4);
        let down = Self::rotation(state).conjugate() * DVec3::NEG_Z;
        let torque = self.weight * DVec3::Z.cross(down);
        let acceleration = (torque - spin.cross(self.inertia * spin)) / self.inertia;
        let turned = 0.5 * (turn * spin + v.cross(spin));
        [vec![-0.5 * v.dot(spin)], joined(&[turned, acceleration, self.drift])].concat()
    }

    fn poses(&self, state: &[f64]) -> Vec<Pose> {
        vec![Pose::rigid(DMat3::from_quat(Self::rotation(state)), vector(state, 7))]
    }

    #[cfg(test)]
    fn energy(&self, state: &[f64]) -> f64 {
        let spin = vector(state, 4);
        0.5 * spin.dot(self.inertia * spin) + self.weight * (Self::rotation(state) * DVec3::Z).z
    }

    fn edited(&self, edit: MotionEdit) -> Box<dyn Law> {
        Box::new(Self {
            drift: edit.velocity_scale * self.drift,
            spin: edit.velocity_scale * self.spin,
            weight: edit.potential_scale * self.weight,
            ..self.clone()
        })
    }

    fn describe(&self, _: usize) -> Value {
        let i = self.inertia;
        json!({
            "law": self.law, "kind": "conservative", "coordinates": self.coordinates,
            "constants": {
                "inertia_ratio_xz": i.x / i.z, "inertia_ratio_yz": i.y / i.z,
                "weight_over_inertia": self.weight / i.x,
            },
            "origin": self.origin.to_array(), "drift": self.drift.to_array(),
            "spin_body": self.spin.to_array(),
            "rotation": components(self.rotation),
            "conservative": ["weight_over_inertia"], "nonconservative": [],
        })
    }
}
