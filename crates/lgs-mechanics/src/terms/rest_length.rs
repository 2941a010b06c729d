//! Spring with a rest length, to a point or between two: `U = ½ k (r − L)²`, `r = |y − c|`.

use super::kind::{At, Block, Derivatives, Label, Role, TermKind};
use super::quadratic::dot;
use crate::parameter::{Parameter, Quantity, Scales, Space};
use crate::thresholds::STARTING_LENGTHS;

/// The kind `spring-length`.
pub(super) const REST_LENGTH: RestLength = RestLength;

/// A spring with a rest length.
#[derive(Debug)]
pub(super) struct RestLength;

/// The offset from the fixed point and its length.
fn offset(p: &[f64], y: &[f64]) -> ([f64; 3], f64) {
    let offset: [f64; 3] = std::array::from_fn(|axis| y[axis] - p.get(2 + axis).unwrap_or(&0.0));
    let r = dot(&offset, &offset).sqrt().max(f64::MIN_POSITIVE.sqrt());
    (offset, r)
}

impl TermKind for RestLength {
    fn label(&self) -> Label {
        Label { name: "spring-length", role: Role::Conserves }
    }

    fn suits(&self, space: Space) -> bool {
        space.dimension == 3 && matches!(space.quantity, Quantity::Place | Quantity::Separation)
    }

    fn parameters(&self, space: Space) -> Vec<Parameter> {
        let mut parameters = vec![
            Parameter::linear("stiffness", 0, -2).within(0.0, f64::INFINITY),
            Parameter::nonlinear("length", 1, 0).within(0.0, 8.0),
        ];
        if space.quantity == Quantity::Place {
            parameters.extend((0..space.dimension).map(|axis| Parameter::place("center", axis, space)));
        }
        parameters
    }

    fn energy(&self, p: &[f64], y: &[f64]) -> f64 {
        0.5 * p[0] * (offset(p, y).1 - p[1]).powi(2)
    }

    fn force(&self, p: &[f64], at: At<'_>, force: &mut [f64]) {
        let (offset, r) = offset(p, at.y);
        force.iter_mut().zip(&offset).for_each(|(f, o)| *f = -p[0] * (1.0 - p[1] / r) * o);
    }

    fn derivatives(&self, p: &[f64], at: At<'_>, out: &mut Derivatives) {
        let (offset, r) = offset(p, at.y);
        for i in 0..offset.len() {
            for j in 0..offset.len() {
                let same = if i == j { 1.0 - p[1] / r } else { 0.0 };
                out.y[(i, j)] = -p[0] * (same + p[1] * offset[i] * offset[j] / r.powi(3));
                if p.len() > 2 {
                    out.p[(i, 2 + j)] = -out.y[(i, j)];
                }
            }
            out.p[(i, 0)] = -(1.0 - p[1] / r) * offset[i];
            out.p[(i, 1)] = p[0] * offset[i] / r;
        }
    }

    fn starts(&self, space: Space, scales: &Scales) -> Vec<Vec<f64>> {
        let places = if space.quantity == Quantity::Place { scales.origin_of(space) } else { Vec::new() };
        let start = |length: &f64| [&[0.0, length * scales.length], places.as_slice()].concat();
        STARTING_LENGTHS.iter().map(start).collect()
    }

    /// With a known centre the force is linear in `k` and `k L`.
    fn columns(&self, _space: Space) -> usize {
        2
    }

    fn design(&self, p: &[f64], at: At<'_>, _linear: &[usize], out: &mut Block) {
        let (offset, r) = offset(p, at.y);
        for (row, o) in offset.iter().enumerate() {
            out[(row, 0)] = -o;
            out[(row, 1)] = o / r;
        }
    }

    fn regressed(&self, p: &[f64], coefficients: &[f64], _space: Space) -> Vec<f64> {
        let stiffness = coefficients[0].max(0.0);
        let length = if stiffness > 0.0 { (coefficients[1] / stiffness).max(0.0) } else { p[1] };
        [&[stiffness, length], &p[2..]].concat()
    }
}
