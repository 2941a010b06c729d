//! Inertia of a body, up to its scale.

use crate::parameter::Parameter;
use crate::thresholds::{INERTIA_SPREAD, MOST_COUPLING, MOST_LOG_FACTOR};
use glam::{DMat3, DVec3};
use lgs_core::geometry::{outer, scalar};
use serde::{Deserialize, Serialize};

/// Which moments of inertia are fitted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum InertiaForm {
    /// All moments equal, as for a ball: a free spin is uniform.
    Isotropic,
    /// Those of the prior.
    Prior,
    /// Two are equal, and the third over them and the direction of its axis are fitted, which is near the
    /// third axis of the prior: a round body. The centre of mass lies on that axis.
    Round,
    /// Their ratios are fitted, with the prior as the centre.
    Free,
    /// Ratios and axes are fitted: the inverse tensor `W` in the axes of the prior has a diagonal as of the
    /// moments, and beside it `W_ij = s_ij √(W_ii W_jj)`. The direction to the centre of mass from a pivot is
    /// fitted as well.
    Whole,
}

/// Rows and columns beside the diagonal, in the order of their parameters.
pub(crate) const BESIDE: [(usize, usize); 3] = [(0, 1), (0, 2), (1, 2)];

/// Principal axes and moments of a body; the middle moment keeps its value, since a torque's scale and that
/// of the moments cannot be told apart.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Inertia {
    /// Which moments are fitted.
    pub form: InertiaForm,
    /// Quaternion (w, x, y, z) that takes principal axes to the axes of the shape.
    pub frame: [f64; 4],
    /// Moments about the principal axes per mass, length², sorted either way: the second is the middle one.
    pub moments: [f64; 3],
}

impl Inertia {
    /// Equal moments in the axes of the shape.
    #[must_use]
    pub fn ball(moment: f64) -> Self {
        Self { form: InertiaForm::Isotropic, frame: [1.0, 0.0, 0.0, 0.0], moments: [moment; 3] }
    }

    /// Parameters: logarithms of the outer moments over those of the prior, then what couples the axes.
    #[must_use]
    pub fn parameters(&self) -> Vec<Parameter> {
        let bounded = |most: f64| {
            move |name: &&str| Parameter::nonlinear(*name, 0, 0).within(-most, most).spread(INERTIA_SPREAD)
        };
        let tilts = ["tilt-1", "tilt-2"];
        let ratios = ["log-moment-1", "log-moment-3"];
        let couplings = ["coupling-12", "coupling-13", "coupling-23"];
        let (ratios, couplings): (&[&str], &[&str]) = match self.form {
            InertiaForm::Isotropic | InertiaForm::Prior => (&[], &[]),
            InertiaForm::Round => (&ratios[1..], &tilts),
            InertiaForm::Free => (&ratios, &[]),
            InertiaForm::Whole => (&ratios, &couplings),
        };
        let ratios = ratios.iter().map(bounded(MOST_LOG_FACTOR));
        ratios.chain(couplings.iter().map(bounded(MOST_COUPLING))).collect()
    }

    /// The inverse of the tensor in the axes of the prior, with parameters `p` (the law's first ones).
    #[must_use]
    pub fn inverse_tensor(&self, p: &[f64]) -> DMat3 {
        if self.form == InertiaForm::Round {
            return self.round(p);
        }
        let [first, middle, last] = self.moments;
        let diagonal = match self.form {
            InertiaForm::Isotropic | InertiaForm::Round => [middle; 3],
            InertiaForm::Prior => self.moments,
            InertiaForm::Free | InertiaForm::Whole => [first * p[0].exp(), middle, last * p[1].exp()],
        };
        let diagonal = DVec3::from_array(diagonal).recip();
        let mut inverse = DMat3::from_diagonal(diagonal);
        if self.form == InertiaForm::Whole {
            for ((row, column), coupling) in BESIDE.into_iter().zip(&p[2..]) {
                set_both(&mut inverse, (row, column), coupling * (diagonal[row] * diagonal[column]).sqrt());
            }
        }
        inverse
    }

    /// The tensor in the axes of the prior.
    #[must_use]
    pub fn tensor(&self, p: &[f64]) -> DMat3 {
        self.inverse_tensor(p).inverse()
    }

    /// Derivatives of the inverse tensor by each of [`Self::parameters`].
    pub(crate) fn inverse_slopes(&self, p: &[f64]) -> Vec<DMat3> {
        if self.form == InertiaForm::Round {
            return self.round_slopes(p);
        }
        let inverse = self.inverse_tensor(p);
        let by_moment = |axis: usize| {
            let mut slope = DMat3::ZERO;
            for other in 0..3 {
                let part = if other == axis { 1.0 } else { 0.5 };
                set_both(&mut slope, (axis, other), -part * inverse.col(axis)[other]);
            }
            slope
        };
        let by_coupling = |(row, column): (usize, usize)| {
            let mut slope = DMat3::ZERO;
            set_both(&mut slope, (row, column), (inverse.col(row)[row] * inverse.col(column)[column]).sqrt());
            slope
        };
        let all = [0, 2].map(by_moment).into_iter().chain(BESIDE.map(by_coupling));
        all.take(self.parameters().len()).collect()
    }
}

impl Inertia {
    /// The inverse tensor of a round body: `1/I₂ + (1/I₃ − 1/I₂) n nᵀ`.
    fn round(&self, p: &[f64]) -> DMat3 {
        let across = self.moments[1].recip();
        let axis = DVec3::new(p[1], p[2], 1.0).normalize();
        scalar(across) + outer(axis, axis) * ((-p[0]).exp() / self.moments[2] - across)
    }

    fn round_slopes(&self, p: &[f64]) -> Vec<DMat3> {
        let along = (-p[0]).exp() / self.moments[2];
        let far = DVec3::new(p[1], p[2], 1.0);
        let axis = far.normalize();
        let by_tilt = |unit: DVec3| {
            let turned = (unit - axis * axis.dot(unit)) / far.length();
            (outer(turned, axis) + outer(axis, turned)) * (along - self.moments[1].recip())
        };
        vec![outer(axis, axis) * -along, by_tilt(DVec3::X), by_tilt(DVec3::Y)]
    }
}

/// Sets an entry of a symmetric matrix.
fn set_both(matrix: &mut DMat3, (row, column): (usize, usize), value: f64) {
    matrix.col_mut(column)[row] = value;
    matrix.col_mut(row)[column] = value;
}
