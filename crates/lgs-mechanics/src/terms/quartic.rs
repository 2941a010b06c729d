//! Even quartic potentials about a fitted centre: `U = ½ a r² + ¼ b r⁴`, and along one axis only,
//! `U = ½ k |o|² + ½ a (ê · o)² + ¼ (u · o)⁴` with `o = y − c` and `ê = u/|u|`, the double well of `a < −k`.

use super::kind::{At, Block, Derivatives, Label, Role, TermKind, default_start};
use super::quadratic::{dot, offset};
use crate::parameter::{Parameter, Quantity, Scales, Space, axis_name};

/// The kind `quartic-radial`.
pub(super) const RADIAL: Radial = Radial;
/// The kind `quartic-axis`.
pub(super) const AXIS: Axis = Axis;

/// A radial quartic potential.
#[derive(Debug)]
pub(super) struct Radial;

/// A quartic potential along an axis.
#[derive(Debug)]
pub(super) struct Axis;

fn place_parameters(space: Space) -> impl Iterator<Item = Parameter> {
    (0..space.dimension).map(move |axis| Parameter::place("center", axis, space))
}

impl TermKind for Radial {
    fn label(&self) -> Label {
        Label { name: "quartic-radial", role: Role::Conserves }
    }

    fn suits(&self, space: Space) -> bool {
        space.has_position()
    }

    fn parameters(&self, space: Space) -> Vec<Parameter> {
        let mut parameters =
            vec![Parameter::linear("quadratic", 0, -2), Parameter::linear("quartic", -2, -2)];
        parameters.extend(place_parameters(space));
        parameters
    }

    fn energy(&self, p: &[f64], y: &[f64]) -> f64 {
        let o = offset(&p[2..], y);
        let square = dot(&o, &o);
        0.5 * p[0] * square + 0.25 * p[1] * square * square
    }

    fn force(&self, p: &[f64], at: At<'_>, force: &mut [f64]) {
        let o = offset(&p[2..], at.y);
        let part = p[0] + p[1] * dot(&o, &o);
        force.iter_mut().zip(&o).for_each(|(f, o)| *f = -part * o);
    }

    fn derivatives(&self, p: &[f64], at: At<'_>, out: &mut Derivatives) {
        let o = offset(&p[2..], at.y);
        let square = dot(&o, &o);
        for i in 0..o.len() {
            for j in 0..o.len() {
                let same = if i == j { p[0] + p[1] * square } else { 0.0 };
                out.y[(i, j)] = -same - 2.0 * p[1] * o[i] * o[j];
                out.p[(i, 2 + j)] = -out.y[(i, j)];
            }
            out.p[(i, 0)] = -o[i];
            out.p[(i, 1)] = -square * o[i];
        }
    }
}

/// The unit vector along `u`, and `|u|⁴`.
fn axis_of(u: &[f64]) -> (Vec<f64>, f64) {
    let square = dot(u, u).max(f64::MIN_POSITIVE);
    (u.iter().map(|u| u / square.sqrt()).collect(), square * square)
}

impl Axis {
    /// `k`, `a`, `u`, centre.
    fn split(p: &[f64], d: usize) -> (f64, f64, &[f64], &[f64]) {
        (p[0], p[1], &p[2..2 + d], &p[2 + d..])
    }
}

impl TermKind for Axis {
    fn label(&self) -> Label {
        Label { name: "quartic-axis", role: Role::Conserves }
    }

    fn suits(&self, space: Space) -> bool {
        space.dimension == 3 && space.quantity != Quantity::Rate
    }

    fn parameters(&self, space: Space) -> Vec<Parameter> {
        let d = space.dimension;
        let mut parameters = vec![Parameter::linear("across", 0, -2), Parameter::linear("along", 0, -2)];
        let root = |axis| Parameter::linear(format!("quartic-root-{}", axis_name(d, axis)), -2, -2).root(4.0);
        parameters.extend((0..d).map(root));
        parameters.extend(place_parameters(space));
        parameters
    }

    fn energy(&self, p: &[f64], y: &[f64]) -> f64 {
        let (k, a, u, center) = Self::split(p, y.len());
        let (axis, quartic) = axis_of(u);
        let o = offset(center, y);
        let along = dot(&axis, &o);
        0.5 * k * dot(&o, &o) + 0.5 * a * along * along + 0.25 * quartic * along.powi(4)
    }

    fn force(&self, p: &[f64], at: At<'_>, force: &mut [f64]) {
        let (k, a, u, center) = Self::split(p, at.y.len());
        let (axis, quartic) = axis_of(u);
        let o = offset(center, at.y);
        let along = dot(&axis, &o);
        let pull = a * along + quartic * along.powi(3);
        (0..o.len()).for_each(|i| force[i] = -k * o[i] - pull * axis[i]);
    }

    fn derivatives(&self, p: &[f64], at: At<'_>, out: &mut Derivatives) {
        let d = at.y.len();
        let (k, a, u, center) = Self::split(p, d);
        let (axis, quartic) = axis_of(u);
        let length = quartic.powf(0.25);
        let o = offset(center, at.y);
        let along = dot(&axis, &o);
        let (pull, slope) = (a * along + quartic * along.powi(3), a + 3.0 * quartic * along * along);
        for i in 0..d {
            for j in 0..d {
                let same = f64::from(u8::from(i == j));
                out.y[(i, j)] = -k * same - slope * axis[i] * axis[j];
                out.p[(i, 2 + d + j)] = -out.y[(i, j)];
                // Turning the axis, then lengthening it.
                let turned = (same - axis[i] * axis[j]) / length;
                let swept = (o[j] - along * axis[j]) / length;
                let longer = 4.0 * length.powi(3) * axis[j] * along.powi(3);
                out.p[(i, 2 + j)] = -pull * turned - axis[i] * (slope * swept + longer);
            }
            out.p[(i, 0)] = -o[i];
            out.p[(i, 1)] = -along * axis[i];
        }
    }

    fn starts(&self, space: Space, scales: &Scales) -> Vec<Vec<f64>> {
        let start = default_start(&self.parameters(space), space, scales);
        let along = |direction: Vec<f64>| {
            let mut start = start.clone();
            // |u|⁴ = 1/(length² time²).
            let root = (scales.length_of(space) * scales.time).sqrt().recip();
            start[2..2 + space.dimension].iter_mut().zip(direction).for_each(|(u, d)| *u = root * d);
            start
        };
        scales.directions_of(space).into_iter().map(along).collect()
    }

    /// With a known axis the force is `−k o − A s ê − q s³ ê + β s² ê + d` about any point, linear in all
    /// seven: `β = 3 q δ` and what `d` has across tell how far the centre is from that point.
    fn columns(&self, space: Space) -> usize {
        4 + space.dimension
    }

    fn design(&self, p: &[f64], at: At<'_>, _linear: &[usize], out: &mut Block) {
        let (_, _, u, center) = Self::split(p, at.y.len());
        let (axis, _) = axis_of(u);
        let o = offset(center, at.y);
        let along = dot(&axis, &o);
        for i in 0..o.len() {
            let row = [-o[i], -along * axis[i], -along.powi(3) * axis[i], along * along * axis[i]];
            out.row_mut(i)[..4].copy_from_slice(&row);
            out[(i, 4 + i)] = 1.0;
        }
    }

    fn regressed(&self, p: &[f64], coefficients: &[f64], space: Space) -> Vec<f64> {
        let d = space.dimension;
        let (_, _, u, center) = Self::split(p, d);
        let (axis, known) = axis_of(u);
        let [k, linear, quartic, square] = std::array::from_fn(|i| coefficients[i]);
        let push = &coefficients[4..];
        let is_well = quartic > 0.0;
        let root = if is_well { quartic } else { known }.powf(0.25);
        let shift = if is_well { square / (3.0 * quartic) } else { 0.0 };
        let pushed = dot(&axis, push);
        let across = |i: usize| if k > 0.0 { (push[i] - pushed * axis[i]) / k } else { 0.0 };
        let mut values = vec![k, linear - 3.0 * quartic.max(0.0) * shift * shift];
        values.extend(axis.iter().map(|axis| root * axis));
        values.extend((0..d).map(|i| center[i] + shift * axis[i] + across(i)));
        values
    }
}
