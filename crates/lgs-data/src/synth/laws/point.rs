//! A body that keeps its orientation and moves as a point in fields.

use super::super::pose::Pose;
use super::law::{Law, joined, vector};
use crate::edit::MotionEdit;
use crate::thresholds::CREEPING_SPEED;
use glam::{DMat3, DVec3};
use serde_json::{Value, json};

/// A force per unit mass.
#[derive(Clone, Copy, Debug)]
pub(in super::super) enum Field {
    /// Uniform gravity along −z: conservative.
    Gravity(f64),
    /// Towards a centre, `k rⁿ`: conservative.
    Power { center: DVec3, k: f64, n: f64 },
    /// Energy `c (x² − w²)² / 4` along a unit vector and `k r² / 2` across it, about a centre: conservative.
    DoubleWell { center: DVec3, along: DVec3, c: f64, w: f64, k: f64 },
    /// Along each axis of a frame a stiffness of its own, towards a centre: conservative.
    Spring { center: DVec3, frame: DMat3, k: DVec3 },
    /// A spring with a rest length, fixed at one end: conservative.
    RestLength { end: DVec3, k: f64, length: f64 },
    /// `−k |v| v`: not conservative.
    QuadraticDrag(f64),
    /// `−k v`: not conservative.
    LinearDrag(f64),
    /// Quadratic drag in air that moves: `−k |v − w| (v − w)`, not conservative.
    Wind { k: f64, wind: DVec3 },
    /// Linear drag in a liquid that turns about the origin: `−k (v − ω × q)`, not conservative.
    Whirl { k: f64, rate: DVec3 },
    /// `k (1 − |q|² / a²) v`: a push within the amplitude and a drag beyond it, not conservative.
    SelfSustained { k: f64, amplitude: f64 },
    /// Gravity and what keeps a body on the sphere about the origin on which it starts: conservative.
    Bowl { gravity: f64 },
    /// Of a constant size against the velocity: not conservative.
    DryFriction(f64),
    /// `ω × v`, as a charge in a uniform magnetic field has it. It does no work, and depends on the velocity:
    /// it belongs to the force and not to the potential.
    Magnetic(DVec3),
}

impl Field {
    fn acceleration(&self, q: DVec3, v: DVec3) -> DVec3 {
        match *self {
            Self::Gravity(g) => -g * DVec3::Z,
            Self::Power { center, k, n } => {
                let arm = q - center;
                -k * arm.length().powf(n - 1.0) * arm
            }
            Self::DoubleWell { center, along, c, w, k } => {
                let arm = q - center;
                let x = arm.dot(along);
                -c * x * (x * x - w * w) * along - k * (arm - x * along)
            }
            Self::Spring { center, frame, k } => -(frame * (k * (frame.transpose() * (q - center)))),
            Self::RestLength { end, k, length } => {
                let arm = q - end;
                -k * (arm.length() - length) * arm.normalize()
            }
            Self::QuadraticDrag(k) => -k * v.length() * v,
            Self::LinearDrag(k) => -k * v,
            Self::Wind { k, wind } => -k * v.distance(wind) * (v - wind),
            Self::Whirl { k, rate } => -k * (v - rate.cross(q)),
            Self::SelfSustained { k, amplitude } => k * (1.0 - (q / amplitude).length_squared()) * v,
            Self::Bowl { gravity } => {
                let (down, out) = (-gravity * DVec3::Z, q.normalize());
                down - (down.dot(out) + v.length_squared() / q.length()) * out
            }
            Self::DryFriction(k) => -k * v / v.length().hypot(CREEPING_SPEED),
            Self::Magnetic(omega) => omega.cross(v),
        }
    }

    #[cfg(test)]
    fn energy(&self, q: DVec3) -> f64 {
        match *self {
            Self::Gravity(g) | Self::Bowl { gravity: g } => g * q.z,
            Self::Power { center, k, n } => k * (q - center).length().powf(n + 1.0) / (n + 1.0),
            Self::DoubleWell { center, along, c, w, k } => {
                let arm = q - center;
                let x = arm.dot(along);
                0.25 * c * (x * x - w * w).powi(2) + 0.5 * k * (arm - x * along).length_squared()
            }
            Self::Spring { center, frame, k } => {
                let arm = frame.transpose() * (q - center);
                0.5 * arm.dot(k * arm)
            }
            Self::RestLength { end, k, length } => 0.5 * k * (q.distance(end) - length).powi(2),
            Self::QuadraticDrag(_)
            | Self::LinearDrag(_)
            | Self::DryFriction(_)
            | Self::Magnetic(_)
            | Self::Wind { .. }
            | Self::Whirl { .. }
            | Self::SelfSustained { .. } => 0.0,
        }
    }

    fn edited(self, edit: MotionEdit) -> Self {
        let (beta, gamma) = (edit.potential_scale, edit.force_scale);
        match self {
            Self::Gravity(g) => Self::Gravity(beta * g),
            Self::Power { center, k, n } => Self::Power { center, k: beta * k, n },
            Self::DoubleWell { center, along, c, w, k } => {
                Self::DoubleWell { center, along, c: beta * c, w, k: beta * k }
            }
            Self::Spring { center, frame, k } => Self::Spring { center, frame, k: beta * k },
            Self::RestLength { end, k, length } => Self::RestLength { end, k: beta * k, length },
            Self::QuadraticDrag(k) => Self::QuadraticDrag(gamma * k),
            Self::LinearDrag(k) => Self::LinearDrag(gamma * k),
            Self::Wind { k, wind } => Self::Wind { k: gamma * k, wind },
            Self::Whirl { k, rate } => Self::Whirl { k: gamma * k, rate },
            Self::SelfSustained { k, amplitude } => Self::SelfSustained { k: gamma * k, amplitude },
            Self::Bowl { gravity } => Self::Bowl { gravity: beta * gravity },
            Self::DryFriction(k) => Self::DryFriction(gamma * k),
            Self::Magnetic(omega) => Self::Magnetic(gamma * omega),
        }
    }

    /// Constants with their names; vectors as three numbers.
    fn constants(&self) -> Value {
        match *self {
            Self::Gravity(g) => json!({"g": g}),
            Self::Power { center, k, n } => json!({"k": k, "n": n, "center": center.to_array()}),
            Self::DoubleWell { center, along, c, w, k } => json!({
                "quartic": c, "half_distance": w, "k_across": k, "center": center.to_array(),
                "along": along.to_array()
            }),
            Self::Spring { center, frame, k } => json!({
                "stiffness": k.to_array(), "center": center.to_array(), "frame": frame.to_cols_array()
            }),
            Self::RestLength { end, k, length } => {
                json!({"k": k, "length": length, "end": end.to_array()})
            }
            Self::QuadraticDrag(k) => json!({"quadratic_drag": k}),
            Self::LinearDrag(k) => json!({"drag": k}),
            Self::Wind { k, wind } => json!({"quadratic_drag": k, "wind": wind.to_array()}),
            Self::Whirl { k, rate } => json!({"drag": k, "rate": rate.to_array()}),
            Self::SelfSustained { k, amplitude } => json!({"push": k, "amplitude": amplitude}),
            Self::Bowl { gravity } => json!({"g": gravity}),
            Self::DryFriction(k) => json!({"friction": k}),
            Self::Magnetic(omega) => {
                json!({"gyration": omega.length(), "axis": omega.normalize().to_array()})
            }
        }
    }

    pub(in super::super) fn is_conservative(&self) -> bool {
        matches!(
            self,
            Self::Gravity(_)
                | Self::Power { .. }
                | Self::DoubleWell { .. }
                | Self::Spring { .. }
                | Self::RestLength { .. }
                | Self::Bowl { .. }
        )
    }
}

/// A body without rotation in fields.
#[derive(Clone, Debug)]
pub(in super::super) struct Point {
    pub(in super::super) law: &'static str,
    pub(in super::super) kind: &'static str,
    pub(in super::super) start: DVec3,
    pub(in super::super) velocity: DVec3,
    pub(in super::super) fields: Vec<Field>,
}

impl Law for Point {
    fn start(&self) -> Vec<f64> {
        joined(&[self.start, self.velocity])
    }

    fn rate(&self, state: &[f64]) -> Vec<f64> {
        let (q, v) = (vector(state, 0), vector(state, 3));
        joined(&[v, self.fields.iter().map(|field| field.acceleration(q, v)).sum()])
    }

    fn poses(&self, state: &[f64]) -> Vec<Pose> {
        vec![Pose::rigid(DMat3::IDENTITY, vector(state, 0))]
    }

    #[cfg(test)]
    fn energy(&self, state: &[f64]) -> f64 {
        let (q, v) = (vector(state, 0), vector(state, 3));
        0.5 * v.length_squared() + self.fields.iter().map(|field| field.energy(q)).sum::<f64>()
    }

    fn edited(&self, edit: MotionEdit) -> Box<dyn Law> {
        Box::new(Self {
            velocity: edit.velocity_scale * self.velocity,
            fields: self.fields.iter().map(|field| field.edited(edit)).collect(),
            ..self.clone()
        })
    }

    fn describe(&self, _: usize) -> Value {
        let mut constants = serde_json::Map::new();
        let (mut conservative, mut others) = (Vec::new(), Vec::new());
        for field in &self.fields {
            let Value::Object(own) = field.constants() else { continue };
            let names = if field.is_conservative() { &mut conservative } else { &mut others };
            names.extend(own.keys().cloned());
            constants.extend(own);
        }
        json!({
            "law": self.law, "kind": self.kind, "coordinates": "rigid", "constants": constants,
            "start": self.start.to_array(), "velocity": self.velocity.to_array(),
            "conservative": conservative, "nonconservative": others,
        })
    }
}
