//! Central forces about a fitted centre, or between two points: `Q = −k rⁿ r̂`, `r = |y − c|`, with
//! `U = k rⁿ⁺¹/(n + 1)`, or `k ln r` for `n = −1`.

use super::kind::{At, Derivatives, Label, Role, TermKind, default_start};
use super::quadratic::dot;
use crate::parameter::{Parameter, Quantity, Scales, Space};
use crate::thresholds::{LARGEST_EXPONENT, STARTING_DISTANCE, STARTING_EXPONENTS};

/// The kind `central-power`: the exponent is fitted.
pub(super) const POWER: Central = Central { name: "central-power", exponent: None };
/// The kind `central-inverse-square`, as gravity and charges.
pub(super) const INVERSE_SQUARE: Central = Central { name: "central-inverse-square", exponent: Some(-2.0) };
/// The kind `central-logarithm`: a force by the inverse of the distance.
pub(super) const LOGARITHM: Central = Central { name: "central-logarithm", exponent: Some(-1.0) };

/// A central force.
#[derive(Debug)]
pub(super) struct Central {
    name: &'static str,
    exponent: Option<f64>,
}

/// The offset from the centre, its length, the exponent, and `rⁿ⁻¹`.
struct Pull {
    offset: [f64; 3],
    r: f64,
    n: f64,
    part: f64,
}

impl Central {
    /// Place of the first coordinate of the centre among the parameters.
    fn first_place(&self) -> usize {
        if self.exponent.is_some() { 1 } else { 2 }
    }

    fn pull(&self, p: &[f64], y: &[f64]) -> Pull {
        let center = &p[self.first_place()..];
        // Between two points there is no centre to fit.
        let offset: [f64; 3] = std::array::from_fn(|axis| y[axis] - center.get(axis).unwrap_or(&0.0));
        let r = dot(&offset, &offset).sqrt().max(f64::MIN_POSITIVE.sqrt());
        let (n, part) = match self.exponent {
            Some(n) => (n, r.powi(n as i32 - 1)),
            None => (p[1], r.powf(p[1] - 1.0)),
        };
        Pull { offset, r, n, part }
    }
}

impl TermKind for Central {
    fn label(&self) -> Label {
        Label { name: self.name, role: Role::Conserves }
    }

    fn suits(&self, space: Space) -> bool {
        space.dimension == 3 && matches!(space.quantity, Quantity::Place | Quantity::Separation)
    }

    fn parameters(&self, space: Space) -> Vec<Parameter> {
        let n = self.exponent.unwrap_or(-2.0);
        let mut parameters = vec![Parameter::linear("strength", 1 - n as i32, -2)];
        if self.exponent.is_none() {
            parameters
                .push(Parameter::nonlinear("exponent", 0, 0).within(-LARGEST_EXPONENT, LARGEST_EXPONENT));
        }
        if space.quantity == Quantity::Place {
            parameters.extend((0..space.dimension).map(|axis| Parameter::place("center", axis, space)));
        }
        parameters
    }

    fn energy(&self, p: &[f64], y: &[f64]) -> f64 {
        let Pull { r, n, .. } = self.pull(p, y);
        let power = n + 1.0;
        // (rⁿ⁺¹ − 1)/(n + 1), continuous in n; the constant does not matter.
        p[0] * if power.abs() < 1e-12 { r.ln() } else { (power * r.ln()).exp_m1() / power }
    }

    fn force(&self, p: &[f64], at: At<'_>, force: &mut [f64]) {
        let Pull { offset, part, .. } = self.pull(p, at.y);
        force.iter_mut().zip(&offset).for_each(|(f, o)| *f = -p[0] * part * o);
    }

    fn derivatives(&self, p: &[f64], at: At<'_>, out: &mut Derivatives) {
        let Pull { offset, r, n, part } = self.pull(p, at.y);
        let along = (n - 1.0) / (r * r);
        for i in 0..offset.len() {
            for j in 0..offset.len() {
                let same = f64::from(u8::from(i == j));
                out.y[(i, j)] = -p[0] * part * (same + along * offset[i] * offset[j]);
                if p.len() > self.first_place() {
                    out.p[(i, self.first_place() + j)] = -out.y[(i, j)];
                }
            }
            out.p[(i, 0)] = -part * offset[i];
            if self.exponent.is_none() {
                out.p[(i, 1)] = -p[0] * part * r.ln() * offset[i];
            }
        }
    }

    fn starts(&self, space: Space, scales: &Scales) -> Vec<Vec<f64>> {
        let parameters = self.parameters(space);
        let start = default_start(&parameters, space, scales);
        let exponents = if self.exponent.is_some() { &STARTING_EXPONENTS[..1] } else { &STARTING_EXPONENTS };
        let mut starts = Vec::new();
        for &exponent in exponents {
            let mut start = start.clone();
            if self.exponent.is_none() {
                start[1] = exponent;
            }
            if space.quantity == Quantity::Place {
                let shift = STARTING_DISTANCE * scales.length;
                for (direction, sign) in
                    scales.directions_of(space).iter().flat_map(|d| [(d, 1.0), (d, -1.0)])
                {
                    let mut start = start.clone();
                    let center = &mut start[self.first_place()..];
                    center.iter_mut().zip(direction).for_each(|(c, d)| *c += sign * shift * d);
                    starts.push(start);
                }
            }
            starts.push(start);
        }
        starts
    }
}
