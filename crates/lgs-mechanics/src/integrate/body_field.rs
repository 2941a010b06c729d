//! Torques and forces on a rigid body, and its motion without any.
//!
//! Torques are in body axes. A drift splits the kinetic energy `½ π · I⁻¹ π` of the angular momentum
//! `π = I ω` into `½ |π|²/I₂`, whose motion `R exp(h π/I₂)` is exact, and two rotations about principal
//! axes, by `h π₁ (1/I₁ − 1/I₂)` and `h π₃ (1/I₃ − 1/I₂)`, in the order half, whole, half. The angular
//! momentum in world axes is kept to rounding, a body with two or three equal moments moves exactly, and the
//! drift by `−h` is the inverse.

use super::applied::{Applied, applied_terms};
use super::kick_field::{KickField, Linearised};
use super::ports::{BodyPort, Moved};
use super::stepper::Tangent;
use crate::coordinates::{Coordinates, State};
use crate::edit::Edit;
use crate::law::Law;
use crate::terms::{At, Derivatives};
use glam::{DQuat, DVec3};
use lgs_core::geometry::{components, exp, quaternion, right_jacobian, rotate_by};

/// Terms that act on a rigid body.
#[derive(Debug)]
pub(crate) struct BodyField<'a> {
    parameters: &'a [f64],
    terms: Vec<(Applied, BodyPort)>,
    freedoms: usize,
    moments: DVec3,
    /// `∂Iᵢ/∂p` for the first parameters: the index of the moment, and the derivative.
    moment_slopes: Vec<(usize, f64)>,
    derivatives: Derivatives,
}

impl<'a> BodyField<'a> {
    pub(crate) fn new(law: &'a Law, edit: &Edit) -> Self {
        let arm = match &law.coordinates {
            Coordinates::Ball(ball) => DVec3::from_array(ball.arm),
            _ => DVec3::ZERO,
        };
        let moments = law.coordinates.inertia().map_or([1.0; 3], |inertia| inertia.moments(&law.parameters));
        let own = law.coordinates.parameters().len();
        let ports = law.terms.iter().map(|term| BodyPort { port: term.port, arm, scale: moments[1] });
        Self {
            parameters: &law.parameters,
            terms: applied_terms(law, edit).into_iter().zip(ports).collect(),
            freedoms: law.coordinates.freedoms(),
            moments: DVec3::from_array(moments),
            moment_slopes: [(0, moments[0]), (2, moments[2])].into_iter().take(own).collect(),
            derivatives: Derivatives::default(),
        }
    }

    /// Rotations about principal axes of a drift by `h`: axis, part of `h`, `1/Iᵢ − 1/I₂`.
    fn splitting(&self, h: f64) -> [(usize, f64, f64); 3] {
        let rest = |axis: usize| 1.0 / self.moments[axis] - 1.0 / self.moments[1];
        [(0, 0.5 * h, rest(0)), (2, h, rest(2)), (0, 0.5 * h, rest(0))]
    }
}

impl KickField for BodyField<'_> {
    fn freedoms(&self) -> usize {
        self.freedoms
    }

    fn depends_on_velocity(&self) -> bool {
        self.terms.iter().any(|(term, _)| term.kind.depends_on_velocity())
    }

    fn acceleration(&mut self, x: &[f64], v: &[f64], a: &mut [f64]) {
        a.fill(0.0);
        let moved = Moved::new(x, v);
        for (term, port) in &self.terms {
            let (y, w) = port.read(&moved);
            let mut force = [0.0; 3];
            let at = At { y: &y.to_array(), w: &w.to_array() };
            term.kind.force(&self.parameters[term.parameters.clone()], at, &mut force);
            let (torque, pull) = port.act(&moved, DVec3::from_array(force) * term.factor);
            let spun = torque / self.moments;
            (0..3).for_each(|i| a[i] += spun[i]);
            (3..self.freedoms).for_each(|i| a[i] += pull[i - 3]);
        }
    }

    fn linearise(&mut self, x: &[f64], v: &[f64], out: &mut Linearised) {
        let n = self.freedoms;
        out.reset(n, self.parameters.len());
        self.acceleration(x, v, &mut out.a);
        let moved = Moved::new(x, v);
        for (term, port) in &self.terms {
            let (y, w) = port.read(&moved);
            let at = At { y: &y.to_array(), w: &w.to_array() };
            let p = &self.parameters[term.parameters.clone()];
            let mut force = [0.0; 3];
            term.kind.force(p, at, &mut force);
            self.derivatives.reset(3, p.len());
            term.kind.derivatives(p, at, &mut self.derivatives);
            port.scatter(&moved, DVec3::from_array(force), (&self.derivatives, term), out);
        }
        for row in 0..3 {
            let inverse = 1.0 / self.moments[row];
            for block in [&mut out.x, &mut out.v, &mut out.p] {
                block.row_mut(row).iter_mut().for_each(|value| *value *= inverse);
            }
        }
        for (column, &(axis, slope)) in self.moment_slopes.iter().enumerate() {
            out.p[(axis, column)] -= out.a[axis] * slope / self.moments[axis];
        }
    }

    fn drift(&self, state: &mut State, h: f64) {
        let mut momentum = self.moments * DVec3::from_slice(&state.v);
        let mut rotation = rotate_by(quaternion(&state.x), momentum * (h / self.moments[1]));
        for (axis, part, rest) in self.splitting(h) {
            let turn = exp(DVec3::AXES[axis] * (part * momentum[axis] * rest));
            rotation *= turn;
            momentum = turn.inverse() * momentum;
        }
        put_rotation(&mut state.x, rotation);
        state.v[..3].copy_from_slice(&(momentum / self.moments).to_array());
        for i in 3..self.freedoms {
            state.x[i + 1] += h * state.v[i];
        }
    }

    fn drift_tangent(&self, state: &State, tangent: &mut Tangent, h: f64) {
        let columns = tangent.columns;
        let first_parameter = columns - self.parameters.len();
        let start = self.moments * DVec3::from_slice(&state.v);
        for column in 0..columns {
            let mut by_moments = DVec3::ZERO;
            if let Some(&(axis, slope)) =
                column.checked_sub(first_parameter).and_then(|index| self.moment_slopes.get(index))
            {
                by_moments[axis] = slope;
            }
            let spin = take(&tangent.v, column, columns);
            let momentum = self.moments * spin + by_moments * DVec3::from_slice(&state.v);
            let change = Change { angle: take(&tangent.x, column, columns), momentum, by_moments };
            let (change, end) = self.carry(start, change, h);
            let spin = (change.momentum - by_moments * (end / self.moments)) / self.moments;
            put(&mut tangent.x, column, columns, change.angle);
            put(&mut tangent.v, column, columns, spin);
        }
        for i in 3 * columns..self.freedoms * columns {
            tangent.x[i] += h * tangent.v[i];
        }
    }
}

/// A change of rotation and angular momentum, both in body axes, and of the moments.
struct Change {
    angle: DVec3,
    momentum: DVec3,
    by_moments: DVec3,
}

impl BodyField<'_> {
    /// Carries a change through a drift; also the angular momentum after it.
    fn carry(&self, start: DVec3, mut change: Change, h: f64) -> (Change, DVec3) {
        let mut momentum = start;
        let free = start * (h / self.moments[1]);
        change.angle = exp(free).inverse() * change.angle
            + right_jacobian(free) * change.momentum * (h / self.moments[1]);
        for (axis, part, rest) in self.splitting(h) {
            let unit = DVec3::AXES[axis];
            let turn: DQuat = exp(unit * (part * momentum[axis] * rest)).inverse();
            let rest_change = -change.by_moments[axis] / self.moments[axis].powi(2);
            let angle = part * (change.momentum[axis] * rest + momentum[axis] * rest_change);
            momentum = turn * momentum;
            change.angle = turn * change.angle + unit * angle;
            change.momentum = turn * change.momentum - unit.cross(momentum) * angle;
        }
        (change, momentum)
    }
}

/// Rows 0 to 2 of a column.
fn take(rows: &[f64], column: usize, columns: usize) -> DVec3 {
    DVec3::new(rows[column], rows[columns + column], rows[2 * columns + column])
}

fn put(rows: &mut [f64], column: usize, columns: usize, value: DVec3) {
    (0..3).for_each(|i| rows[i * columns + column] = value[i]);
}

fn put_rotation(x: &mut [f64], rotation: DQuat) {
    x[..4].copy_from_slice(&components(rotation.normalize()));
}
