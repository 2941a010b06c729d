//! Uniform field: `U = −g · y`, the same acceleration `g` everywhere.

use super::kind::{At, Derivatives, Role, TermKind};
use super::quadratic::dot;
use crate::parameter::{Parameter, Space, axis_name};

/// The kind `uniform-field`.
pub(super) const UNIFORM_FIELD: UniformField = UniformField;

/// A uniform field.
#[derive(Debug)]
pub(super) struct UniformField;

impl TermKind for UniformField {
    fn name(&self) -> &'static str {
        "uniform-field"
    }

    fn role(&self) -> Role {
        Role::Conserves
    }

    fn suits(&self, space: Space) -> bool {
        space.is_straight()
    }

    fn parameters(&self, space: Space) -> Vec<Parameter> {
        let d = space.dimension;
        (0..d).map(|axis| Parameter::linear(format!("field-{}", axis_name(d, axis)), 1, -2)).collect()
    }

    fn energy(&self, p: &[f64], y: &[f64]) -> f64 {
        -dot(p, y)
    }

    fn force(&self, p: &[f64], _at: At<'_>, force: &mut [f64]) {
        force.copy_from_slice(p);
    }

    fn derivatives(&self, p: &[f64], _at: At<'_>, out: &mut Derivatives) {
        (0..p.len()).for_each(|axis| out.p[(axis, axis)] = 1.0);
    }
}
