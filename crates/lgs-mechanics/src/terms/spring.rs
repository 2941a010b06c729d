//! Spring about a fitted centre: `U = ½ (y − c)ᵀ K (y − c)`, isotropic, of each coordinate by itself,
//! towards an axis, full, or positive semidefinite.
//!
//! On an angle the isotropic spring is a torsion spring, on the amplitudes of modes the full one is the modal
//! stiffness with its equilibrium.

use super::kind::{At, Block, Derivatives, Label, Role, TermKind};
use super::quadratic::{Form, full_matrix, offset};
use crate::parameter::{Parameter, Scales, Space};
use nalgebra::DVector;

/// The kind `spring`: the same stiffness in all directions.
pub(super) const ISOTROPIC: Spring = Spring { name: "spring", form: Form::Isotropic };
/// The kind `spring-diagonal`: a stiffness for each coordinate, as in normal modes.
pub(super) const DIAGONAL: Spring = Spring { name: "spring-diagonal", form: Form::Diagonal };
/// The kind `spring-axial`: towards an axis through the centre.
pub(super) const AXIAL: Spring = Spring { name: "spring-axial", form: Form::Axial };
/// The kind `spring-full`: any symmetric stiffness.
pub(super) const FULL: Spring = Spring { name: "spring-full", form: Form::Full };
/// The kind `spring-positive`: any stiffness that drives nothing apart.
pub(super) const POSITIVE: Spring = Spring { name: "spring-positive", form: Form::Positive };

/// A spring.
#[derive(Debug)]
pub(super) struct Spring {
    name: &'static str,
    form: Form,
}

impl Spring {
    /// Parameters of the stiffness, and those of the centre.
    fn split<'a>(&self, p: &'a [f64], d: usize) -> (&'a [f64], &'a [f64]) {
        p.split_at(p.len() - d)
    }
}

impl TermKind for Spring {
    fn label(&self) -> Label {
        Label { name: self.name, role: Role::Conserves }
    }

    fn suits(&self, space: Space) -> bool {
        space.has_position() && self.form.suits(space.dimension)
    }

    fn parameters(&self, space: Space) -> Vec<Parameter> {
        let mut parameters = self.form.parameters("stiffness", space, -2);
        parameters.extend((0..space.dimension).map(|axis| Parameter::place("center", axis, space)));
        parameters
    }

    fn energy(&self, p: &[f64], y: &[f64]) -> f64 {
        let (stiffness, center) = self.split(p, y.len());
        self.form.half_square(stiffness, &offset(center, y))
    }

    fn force(&self, p: &[f64], at: At<'_>, force: &mut [f64]) {
        let (stiffness, center) = self.split(p, at.y.len());
        force.fill(0.0);
        self.form.subtract(stiffness, &offset(center, at.y), force);
    }

    fn derivatives(&self, p: &[f64], at: At<'_>, out: &mut Derivatives) {
        let d = at.y.len();
        let (stiffness, center) = self.split(p, d);
        self.form.derivatives(stiffness, &offset(center, at.y), &mut out.y, &mut out.p);
        for i in 0..d {
            for j in 0..d {
                out.p[(i, stiffness.len() + j)] = -out.y[(i, j)];
            }
        }
    }

    fn starts(&self, space: Space, scales: &Scales) -> Vec<Vec<f64>> {
        let d = space.dimension;
        let linear = self.form.regressed().parameters("", space, -2).len();
        let coefficients = vec![0.0; linear];
        let mut start = self.form.nearest(&coefficients, d);
        start.extend(scales.origin_of(space));
        vec![start]
    }

    /// Columns `−(y − origin)` of the stiffness, and the identity for `K c`.
    fn columns(&self, space: Space) -> usize {
        self.form.regressed().parameters("", space, -2).len() + space.dimension
    }

    fn design(&self, _p: &[f64], at: At<'_>, _linear: &[usize], out: &mut Block) {
        let d = at.y.len();
        let mut unused = Block::zeros(d, d);
        let form = self.form.regressed();
        let zero = vec![0.0; out.columns()];
        form.derivatives(&zero, at.y, &mut unused, out);
        let first = out.columns() - d;
        (0..d).for_each(|axis| out[(axis, first + axis)] = 1.0);
    }

    fn regressed(&self, p: &[f64], coefficients: &[f64], space: Space) -> Vec<f64> {
        let d = space.dimension;
        let (stiffness, shift) = coefficients.split_at(coefficients.len() - d);
        let matrix = match self.form.regressed() {
            form @ (Form::Isotropic | Form::Diagonal) => form.matrix(stiffness, d),
            _ => full_matrix(stiffness, d),
        };
        let center = matrix.lu().solve(&DVector::from_column_slice(shift));
        let (_, fallback) = self.split(p, d);
        let mut values = self.form.nearest(stiffness, d);
        match center {
            Some(center) if center.iter().all(|c| c.is_finite()) => values.extend(center.iter()),
            _ => values.extend(fallback),
        }
        values
    }
}
