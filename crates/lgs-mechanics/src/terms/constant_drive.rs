//! Constant drive: a force or torque that is the same at all times, `Q = τ`.
//!
//! On an angle or a body's angular velocity it is a torque, in body axes it turns with the body. It adds
//! energy for ever, so a law with it is *driven*.

use super::kind::{At, Derivatives, Role, TermKind};
use crate::parameter::{Parameter, Quantity, Space, axis_name};

/// The kind `constant-drive`.
pub(super) const CONSTANT_DRIVE: ConstantDrive = ConstantDrive;

/// A constant drive.
#[derive(Debug)]
pub(super) struct ConstantDrive;

impl TermKind for ConstantDrive {
    fn name(&self) -> &'static str {
        "constant-drive"
    }

    fn role(&self) -> Role {
        Role::Drives
    }

    /// In straight spaces a constant force has a potential: it is a uniform field there.
    fn suits(&self, space: Space) -> bool {
        matches!(space.quantity, Quantity::Angle | Quantity::Rate)
    }

    fn parameters(&self, space: Space) -> Vec<Parameter> {
        let d = space.dimension;
        (0..d).map(|axis| Parameter::linear(format!("drive-{}", axis_name(d, axis)), 1, -2)).collect()
    }

    fn force(&self, p: &[f64], _at: At<'_>, force: &mut [f64]) {
        force.copy_from_slice(p);
    }

    fn derivatives(&self, p: &[f64], _at: At<'_>, out: &mut Derivatives) {
        (0..p.len()).for_each(|axis| out.p[(axis, axis)] = 1.0);
    }
}
