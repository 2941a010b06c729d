//! Torques and forces on a rigid body, and its motion without any.
//!
//! Torques are in body axes. A drift splits the kinetic energy `½ π · W π` of the angular momentum
//! `π = W⁻¹ ω` into `½ |π|²/I₂`, whose motion `R exp(h π/I₂)` is exact, and parts `½ c (n · π)²`, which turn
//! the body by `h c n · π` about a fixed axis `n` of it, one after the other and then in the reverse order.
//! `n` is a principal axis, or lies between two of the axes where these are coupled. The angular momentum in
//! world axes is kept to rounding, a body with two or three equal moments along its axes moves exactly, and
//! the drift by `−h` is the inverse.

use super::applied::{Applied, applied_terms};
use super::kick_field::{KickField, Linearised};
use super::ports::{BodyPort, Moved};
use super::stepper::Tangent;
use crate::coordinates::{BESIDE, Coordinates, Inertia, InertiaForm, Port, State};
use crate::edit::Edit;
use crate::law::Law;
use crate::terms::{At, Block, Derivatives};
use glam::{DMat3, DQuat, DVec3};
use lgs_core::geometry::{components, exp, quaternion, right_jacobian, rotate_by};
use std::f64::consts::FRAC_1_SQRT_2;

/// Terms that act on a rigid body.
#[derive(Debug)]
pub(crate) struct BodyField<'a> {
    parameters: &'a [f64],
    terms: Vec<(Applied, BodyPort)>,
    freedoms: usize,
    /// The inertia, body axes.
    tensor: DMat3,
    /// Its inverse, and the derivatives of that by the first parameters.
    inverse: DMat3,
    slopes: Vec<DMat3>,
    /// `1/I₂`.
    base: f64,
    turns: Vec<Turn>,
    /// Derivatives of the arm by the first parameters.
    arm_slopes: Vec<DVec3>,
    derivatives: Derivatives,
}

/// A part `½ c (n · π)²` of the kinetic energy.
#[derive(Clone, Copy, Debug)]
struct Turn {
    /// The axis `n`, of unit length.
    axis: DVec3,
    /// The entry of the inverse inertia that it belongs to.
    entry: (usize, usize),
    /// 1 or −1: how `c` changes with the entry.
    sign: f64,
    /// The coefficient `c`.
    rate: f64,
}

/// The parts of an inverse inertia beside `base` times one: those of couplings and of the middle axis only if
/// `is_coupled`.
fn turns(inverse: &DMat3, base: f64, is_coupled: bool) -> Vec<Turn> {
    let beside = BESIDE.into_iter().filter(|_| is_coupled).flat_map(|(i, j)| {
        [1.0, -1.0].map(|sign| Turn {
            axis: (DVec3::AXES[i] + sign * DVec3::AXES[j]) * FRAC_1_SQRT_2,
            entry: (i, j),
            sign,
            rate: sign * inverse.col(j)[i],
        })
    });
    let along = [0, 1, 2].into_iter().filter(|i| is_coupled || *i != 1).map(|i| Turn {
        axis: DVec3::AXES[i],
        entry: (i, i),
        sign: 1.0,
        rate: inverse.col(i)[i] - base,
    });
    beside.chain(along).collect()
}

impl<'a> BodyField<'a> {
    pub(crate) fn new(law: &'a Law, edit: &Edit) -> Self {
        let (arm, arm_slopes) = match &law.coordinates {
            Coordinates::Ball(ball) => (ball.arm(&law.parameters), ball.arm_slopes()),
            _ => (DVec3::ZERO, Vec::new()),
        };
        let inertia = law.coordinates.inertia().copied().unwrap_or(Inertia::ball(1.0));
        let inverse = inertia.inverse_tensor(&law.parameters);
        let scale = inertia.moments[1];
        let is_coupled = matches!(inertia.form, InertiaForm::Whole | InertiaForm::Round);
        let tensor = inverse.inverse();
        let ports = law.terms.iter().map(|term| BodyPort { port: term.port, arm, scale, tensor });
        Self {
            parameters: &law.parameters,
            terms: applied_terms(law, edit).into_iter().zip(ports).collect(),
            freedoms: law.coordinates.freedoms(),
            tensor,
            turns: turns(&inverse, scale.recip(), is_coupled),
            base: scale.recip(),
            slopes: inertia.inverse_slopes(&law.parameters),
            inverse,
            arm_slopes,
            derivatives: Derivatives::default(),
        }
    }

    /// The turns of a drift by `h`, each with its part of `h`: half, whole for the last, half.
    fn splitting(&self, h: f64) -> impl Iterator<Item = (&Turn, f64)> {
        let (last, before) = self.turns.split_last().map_or((None, &[][..]), |(l, b)| (Some(l), b));
        let half = move |turn| (turn, 0.5 * h);
        before.iter().map(half).chain(last.map(|turn| (turn, h))).chain(before.iter().rev().map(half))
    }

    /// The part of the angular acceleration that does not depend on the inertia, whose torques grow with it.
    fn inertial(&self, moved: &Moved) -> DVec3 {
        let of_term = |(term, port): &(Applied, BodyPort)| {
            let (y, w) = port.read(moved);
            let mut force = [0.0; 3];
            let at = At { y: &y.to_array(), w: &w.to_array() };
            term.kind.force(&self.parameters[term.parameters.clone()], at, &mut force);
            DVec3::from_array(force) * term.factor
        };
        self.terms.iter().filter(|(_, port)| port.port == Port::InertialSpin).map(of_term).sum()
    }

    /// Turns the rows of torques into those of angular accelerations.
    fn spin(&self, block: &mut Block) {
        for column in 0..block.columns() {
            let torque = DVec3::from_array(std::array::from_fn(|row| block[(row, column)]));
            let spun = self.inverse * torque;
            (0..3).for_each(|row| block[(row, column)] = spun[row]);
        }
    }

    /// The step of the motion by `½ |π|²/I₂`.
    fn free_step(&self, h: f64) -> f64 {
        h * self.base
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
            let spun = self.inverse * torque;
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
            let mut force = [0.0; 3];
            term.kind.force(&self.parameters[term.parameters.clone()], at, &mut force);
            term.differentiate(self.parameters, at, &mut self.derivatives);
            port.scatter(&moved, DVec3::from_array(force), (&self.derivatives, term), out);
            if port.port == Port::Arm {
                let by_arm = port.by_arm(&moved, DVec3::from_array(force), &self.derivatives);
                for (column, slope) in self.arm_slopes.iter().enumerate() {
                    let torque = by_arm * *slope * term.factor;
                    (0..3).for_each(|row| out.p[(row, column)] += torque[row]);
                }
            }
        }
        [&mut out.x, &mut out.v, &mut out.p].into_iter().for_each(|block| self.spin(block));
        let torque = self.tensor * (DVec3::from_slice(&out.a) - self.inertial(&moved));
        for (column, slope) in self.slopes.iter().enumerate() {
            let spun = *slope * torque;
            (0..3).for_each(|row| out.p[(row, column)] += spun[row]);
        }
    }

    fn linearise_by_velocity(&mut self, x: &[f64], v: &[f64], out: &mut Linearised) {
        let n = self.freedoms;
        out.v.reset(n, n);
        let moved = Moved::new(x, v);
        for (term, port) in self.terms.iter().filter(|(term, _)| term.kind.depends_on_velocity()) {
            let (y, w) = port.read(&moved);
            let at = At { y: &y.to_array(), w: &w.to_array() };
            term.differentiate(self.parameters, at, &mut self.derivatives);
            port.scatter_by_velocity(&moved, (&self.derivatives, term), &mut out.v);
        }
        self.spin(&mut out.v);
    }

    fn drift(&self, state: &mut State, h: f64) {
        let mut momentum = self.tensor * DVec3::from_slice(&state.v);
        let mut rotation = rotate_by(quaternion(&state.x), momentum * self.free_step(h));
        for (part, h) in self.splitting(h) {
            let turn = exp(part.axis * (h * part.axis.dot(momentum) * part.rate));
            rotation *= turn;
            momentum = turn.inverse() * momentum;
        }
        put_rotation(&mut state.x, rotation);
        state.v[..3].copy_from_slice(&(self.inverse * momentum).to_array());
        for i in 3..self.freedoms {
            state.x[i + 1] += h * state.v[i];
        }
    }

    fn drift_tangent(&self, state: &State, tangent: &mut Tangent, h: f64) {
        let columns = tangent.columns;
        let first_parameter = columns - self.parameters.len();
        let start = self.tensor * DVec3::from_slice(&state.v);
        for column in 0..columns {
            let own = column.checked_sub(first_parameter).and_then(|index| self.slopes.get(index));
            let slope = own.copied().unwrap_or(DMat3::ZERO);
            let momentum = self.tensor * (take(&tangent.v, column, columns) - slope * start);
            let change = Change { angle: take(&tangent.x, column, columns), momentum, slope };
            let (change, end) = self.carry(start, change, h);
            let spin = self.inverse * change.momentum + slope * end;
            put(&mut tangent.x, column, columns, change.angle);
            put(&mut tangent.v, column, columns, spin);
        }
        for i in 3 * columns..self.freedoms * columns {
            tangent.x[i] += h * tangent.v[i];
        }
    }
}

/// A change of rotation and angular momentum, both in body axes, and of the inverse inertia.
struct Change {
    angle: DVec3,
    momentum: DVec3,
    slope: DMat3,
}

impl BodyField<'_> {
    /// Carries a change through a drift; also the angular momentum after it.
    fn carry(&self, start: DVec3, mut change: Change, h: f64) -> (Change, DVec3) {
        let mut momentum = start;
        let step = self.free_step(h);
        let free = start * step;
        change.angle = exp(free).inverse() * change.angle + right_jacobian(free) * change.momentum * step;
        for (part, h) in self.splitting(h) {
            let along = part.axis.dot(momentum);
            let turn: DQuat = exp(part.axis * (h * along * part.rate)).inverse();
            let (row, column) = part.entry;
            let faster = part.sign * change.slope.col(column)[row];
            let angle = h * (part.axis.dot(change.momentum) * part.rate + along * faster);
            momentum = turn * momentum;
            change.angle = turn * change.angle + part.axis * angle;
            change.momentum = turn * change.momentum - part.axis.cross(momentum) * angle;
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
