//! Ports: the vectors of a system of coordinates that terms act on.

use serde::{Deserialize, Serialize};

/// A vector `y` with velocity `w` that coordinates offer to terms.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Port {
    /// All of vector coordinates: the centre of a point, the angle of a hinge, the offset on a rail, the
    /// amplitudes of modes.
    Whole,
    /// The first of two points, or the first angle of a double pendulum.
    First,
    /// The second of two points, or the second angle.
    Second,
    /// Each of two points by itself, with the same parameters.
    Both,
    /// The separation `x₁ − x₂ − o` of two points, with an equal and opposite force on the second, where the
    /// offset `o` says where the force acts on them; or the difference of two angles.
    Between,
    /// Centre of a rigid body, or of one that deforms in flight.
    Center,
    /// Amplitudes of the deformation of a body in flight.
    Shape,
    /// Velocity of a rigid body's centre in body axes: a force that turns with the body.
    BodyAxes,
    /// Angular velocity in body axes, with a torque in body axes.
    Spin,
    /// Angular velocity in body axes, with a torque in body axes that grows with the moment of inertia about
    /// its axis: a drag takes away the same part of every turn.
    InertialSpin,
    /// Angular velocity in world axes, with a torque in world axes.
    Turn,
    /// Vector from the pivot of a ball joint to the centre, world axes.
    Arm,
}

impl Port {
    /// Name in files and messages.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Whole => "whole",
            Self::First => "first",
            Self::Second => "second",
            Self::Both => "both",
            Self::Between => "between",
            Self::Center => "center",
            Self::Shape => "shape",
            Self::BodyAxes => "body-axes",
            Self::Spin => "spin",
            Self::InertialSpin => "inertial-spin",
            Self::Turn => "turn",
            Self::Arm => "arm",
        }
    }
}

/// Application of a term in vector coordinates: on the components from `plus`, or on their difference to
/// those from `minus`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Site {
    pub(crate) plus: usize,
    pub(crate) minus: Option<usize>,
    /// Parameter by which the opposite reaction is divided (a mass ratio).
    pub(crate) mass: Option<usize>,
    /// First of three parameters that are taken off a difference of positions.
    pub(crate) offset: Option<usize>,
}

impl Site {
    /// What is taken off component `axis` of a difference of positions.
    pub(crate) fn offset_in(&self, parameters: &[f64], axis: usize) -> f64 {
        self.offset.map_or(0.0, |first| parameters[first + axis])
    }

    /// On the components from `plus`.
    pub(crate) fn at(plus: usize) -> Self {
        Self { plus, minus: None, mass: None, offset: None }
    }
}
