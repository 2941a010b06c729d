//! Linear drag: `Q = −d w` with one rate `d ≥ 0` for all directions.

use super::kind::{At, Derivatives, Role, TermKind};
use crate::parameter::{Parameter, Space};

/// The kind `linear-drag`.
pub(super) const LINEAR_DRAG: LinearDrag = LinearDrag;

/// Linear drag.
#[derive(Debug)]
pub(super) struct LinearDrag;

impl TermKind for LinearDrag {
    fn name(&self) -> &'static str {
        "linear-drag"
    }

    fn role(&self) -> Role {
        Role::Dissipates
    }

    fn suits(&self, _space: Space) -> bool {
        true
    }

    fn parameters(&self, _space: Space) -> Vec<Parameter> {
        vec![Parameter::linear("rate", 0, -1).within(0.0, f64::INFINITY)]
    }

    fn force(&self, p: &[f64], at: At<'_>, force: &mut [f64]) {
        force.iter_mut().zip(at.w).for_each(|(f, w)| *f = -p[0] * w);
    }

    fn derivatives(&self, p: &[f64], at: At<'_>, out: &mut Derivatives) {
        for (axis, w) in at.w.iter().enumerate() {
            out.w[(axis, axis)] = -p[0];
            out.p[(axis, 0)] = -w;
        }
    }
}
