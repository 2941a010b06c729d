//! Damping of modes: `Q = −D w` with a rate for each coordinate, as of normal modes, or with a positive
//! semidefinite matrix `D`, as of modes that damping couples.

use super::kind::{At, Block, Derivatives, Label, Role, TermKind};
use super::quadratic::Form;
use crate::parameter::{Parameter, Scales, Space};

/// The kind `damping-diagonal`.
pub(super) const DIAGONAL: Damping = Damping { name: "damping-diagonal", form: Form::Diagonal };
/// The kind `damping-positive`.
pub(super) const POSITIVE: Damping = Damping { name: "damping-positive", form: Form::Positive };

/// Damping with a matrix.
#[derive(Debug)]
pub(super) struct Damping {
    name: &'static str,
    form: Form,
}

impl TermKind for Damping {
    fn label(&self) -> Label {
        Label { name: self.name, role: Role::Dissipates }
    }

    fn suits(&self, space: Space) -> bool {
        self.form.suits(space.dimension)
    }

    fn parameters(&self, space: Space) -> Vec<Parameter> {
        self.form.parameters("rate", space, -1)
    }

    fn force(&self, p: &[f64], at: At<'_>, force: &mut [f64]) {
        force.fill(0.0);
        self.form.subtract(p, at.w, force);
    }

    fn derivatives(&self, p: &[f64], at: At<'_>, out: &mut Derivatives) {
        self.form.derivatives(p, at.w, &mut out.w, &mut out.p);
    }

    fn starts(&self, space: Space, _scales: &Scales) -> Vec<Vec<f64>> {
        vec![self.form.nearest(&vec![0.0; self.columns(space)], space.dimension)]
    }

    fn columns(&self, space: Space) -> usize {
        self.form.regressed().parameters("", space, -1).len()
    }

    fn design(&self, _p: &[f64], at: At<'_>, _linear: &[usize], out: &mut Block) {
        let mut unused = Block::zeros(at.w.len(), at.w.len());
        let zero = vec![0.0; out.columns()];
        self.form.regressed().derivatives(&zero, at.w, &mut unused, out);
    }

    fn regressed(&self, _p: &[f64], coefficients: &[f64], space: Space) -> Vec<f64> {
        self.form.nearest(coefficients, space.dimension)
    }
}
