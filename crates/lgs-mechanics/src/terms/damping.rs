//! Damping with a matrix: `Q = −D w` with `D` positive semidefinite, as for coupled modes.

use super::kind::{At, Block, Derivatives, Label, Role, TermKind};
use super::quadratic::Form;
use crate::parameter::{Parameter, Scales, Space};

/// The kind `damping-positive`.
pub(super) const DAMPING: Damping = Damping;

/// Damping with a matrix.
#[derive(Debug)]
pub(super) struct Damping;

impl TermKind for Damping {
    fn label(&self) -> Label {
        Label { name: "damping-positive", role: Role::Dissipates }
    }

    fn suits(&self, space: Space) -> bool {
        Form::Positive.suits(space.dimension)
    }

    fn parameters(&self, space: Space) -> Vec<Parameter> {
        Form::Positive.parameters("rate", space, -1)
    }

    fn force(&self, p: &[f64], at: At<'_>, force: &mut [f64]) {
        force.fill(0.0);
        Form::Positive.subtract(p, at.w, force);
    }

    fn derivatives(&self, p: &[f64], at: At<'_>, out: &mut Derivatives) {
        Form::Positive.derivatives(p, at.w, &mut out.w, &mut out.p);
    }

    fn starts(&self, space: Space, _scales: &Scales) -> Vec<Vec<f64>> {
        let linear = Form::Full.parameters("", space, -1).len();
        vec![Form::Positive.nearest(&vec![0.0; linear], space.dimension)]
    }

    fn columns(&self, space: Space) -> usize {
        Form::Full.parameters("", space, -1).len()
    }

    fn design(&self, _p: &[f64], at: At<'_>, space: Space, out: &mut Block) {
        let mut unused = Block::zeros(space.dimension, space.dimension);
        Form::Full.derivatives(&vec![0.0; self.columns(space)], at.w, &mut unused, out);
    }

    fn regressed(&self, _p: &[f64], coefficients: &[f64], space: Space) -> Vec<f64> {
        Form::Positive.nearest(coefficients, space.dimension)
    }
}
