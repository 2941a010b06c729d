//! Constant forces, `Q = g`.
//!
//! In a straight space the force has the potential `U = −g · y`: a uniform field. On an angle or a body's
//! angular velocity it is a torque, which in body axes turns with the body; it adds energy for ever, so a law
//! with it is *driven*.

use super::kind::{At, Derivatives, Label, Role, TermKind};
use super::quadratic::dot;
use crate::parameter::{Parameter, Quantity, Space, axis_name};

/// The kind `uniform-field`.
pub(super) const FIELD: Constant =
    Constant { label: Label { name: "uniform-field", role: Role::Conserves }, parameter: "field" };
/// The kind `constant-drive`.
pub(super) const DRIVE: Constant =
    Constant { label: Label { name: "constant-drive", role: Role::Drives }, parameter: "drive" };

/// A constant force.
#[derive(Debug)]
pub(super) struct Constant {
    label: Label,
    parameter: &'static str,
}

impl TermKind for Constant {
    fn label(&self) -> Label {
        self.label
    }

    fn suits(&self, space: Space) -> bool {
        match self.label.role {
            Role::Conserves => space.is_straight(),
            _ => matches!(space.quantity, Quantity::Angle | Quantity::Rate),
        }
    }

    fn parameters(&self, space: Space) -> Vec<Parameter> {
        let d = space.dimension;
        let name = |axis| format!("{}-{}", self.parameter, axis_name(d, axis));
        (0..d).map(|axis| Parameter::linear(name(axis), 1, -2)).collect()
    }

    fn energy(&self, p: &[f64], y: &[f64]) -> f64 {
        if self.label.role == Role::Conserves { -dot(p, y) } else { 0.0 }
    }

    fn force(&self, p: &[f64], _at: At<'_>, force: &mut [f64]) {
        force.copy_from_slice(p);
    }

    fn derivatives(&self, p: &[f64], _at: At<'_>, out: &mut Derivatives) {
        (0..p.len()).for_each(|axis| out.p[(axis, axis)] = 1.0);
    }
}
