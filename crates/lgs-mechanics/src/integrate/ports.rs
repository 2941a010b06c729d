//! Ports of a rigid body: the vectors that terms read, and the torques and forces that come of them.
//!
//! A change of rotation is a rotation vector `δ` in body axes, so that `d(Rᵀu) = [Rᵀu]× δ` for a fixed `u`
//! and `d(R b) = −R [b]× δ` for a fixed `b`.

use super::applied::Applied;
use super::kick_field::Linearised;
use crate::coordinates::Port;
use crate::terms::{Block, Derivatives};
use glam::{DMat3, DVec3};
use lgs_core::geometry::{cross_matrix, quaternion};

/// State of a body as vectors.
#[derive(Clone, Copy, Debug)]
pub(super) struct Moved {
    rotation: DMat3,
    center: DVec3,
    spin: DVec3,
    velocity: DVec3,
}

impl Moved {
    /// Of the coordinates `rigid` or `ball`; the latter have no centre.
    pub(super) fn new(x: &[f64], v: &[f64]) -> Self {
        let vector = |values: &[f64]| if values.len() == 3 { DVec3::from_slice(values) } else { DVec3::ZERO };
        Self {
            rotation: DMat3::from_quat(quaternion(x)),
            center: vector(&x[4..]),
            spin: DVec3::from_slice(v),
            velocity: vector(&v[3..]),
        }
    }
}

/// A port of a body.
#[derive(Clone, Copy, Debug)]
pub(super) struct BodyPort {
    pub(super) port: Port,
    /// From the pivot to the centre, body axes.
    pub(super) arm: DVec3,
    /// Inertia by which torques are measured: the middle moment.
    pub(super) scale: f64,
    /// The inertia, body axes.
    pub(super) tensor: DMat3,
}

/// Derivatives of the vectors of a port by rotation, centre and velocities.
struct Reading {
    y_by_turn: DMat3,
    y_by_center: DMat3,
    w_by_turn: DMat3,
    w_by_spin: DMat3,
    w_by_velocity: DMat3,
}

impl Reading {
    /// Adds the derivatives by the body's velocities, given that by the velocity which the port reads.
    fn add_by_velocity(&self, (by_w, factor): (DMat3, f64), first: usize, out: &mut Block) {
        add(out, (first, 0), by_w * self.w_by_spin * factor);
        if out.columns() > 3 {
            add(out, (first, 3), by_w * self.w_by_velocity * factor);
        }
    }
}

impl BodyPort {
    /// Position and velocity that a term reads.
    pub(super) fn read(&self, moved: &Moved) -> (DVec3, DVec3) {
        let Moved { rotation, center, spin, velocity } = *moved;
        match self.port {
            Port::Arm => (rotation * self.arm, rotation * spin.cross(self.arm)),
            Port::Spin | Port::InertialSpin => (DVec3::ZERO, spin),
            Port::Turn => (DVec3::ZERO, rotation * spin),
            Port::BodyAxes => (DVec3::ZERO, rotation.transpose() * velocity),
            _ => (center, velocity),
        }
    }

    /// Torque in body axes and force in world axes of a term's force.
    pub(super) fn act(&self, moved: &Moved, force: DVec3) -> (DVec3, DVec3) {
        match self.port {
            Port::Arm => (self.arm.cross(moved.rotation.transpose() * force), DVec3::ZERO),
            Port::Spin => (self.scale * force, DVec3::ZERO),
            Port::InertialSpin => (self.tensor * force, DVec3::ZERO),
            Port::Turn => (self.scale * (moved.rotation.transpose() * force), DVec3::ZERO),
            Port::BodyAxes => (DVec3::ZERO, moved.rotation * force),
            _ => (DVec3::ZERO, force),
        }
    }

    fn reading(&self, moved: &Moved) -> Reading {
        let zero = Reading {
            y_by_turn: DMat3::ZERO,
            y_by_center: DMat3::ZERO,
            w_by_turn: DMat3::ZERO,
            w_by_spin: DMat3::ZERO,
            w_by_velocity: DMat3::ZERO,
        };
        let rotation = moved.rotation;
        match self.port {
            Port::Arm => Reading {
                y_by_turn: rotation * cross_matrix(self.arm) * -1.0,
                w_by_turn: rotation * cross_matrix(moved.spin.cross(self.arm)) * -1.0,
                w_by_spin: rotation * cross_matrix(self.arm) * -1.0,
                ..zero
            },
            Port::Spin | Port::InertialSpin => Reading { w_by_spin: DMat3::IDENTITY, ..zero },
            Port::Turn => {
                Reading { w_by_turn: rotation * cross_matrix(moved.spin) * -1.0, w_by_spin: rotation, ..zero }
            }
            Port::BodyAxes => Reading {
                w_by_turn: cross_matrix(rotation.transpose() * moved.velocity),
                w_by_velocity: rotation.transpose(),
                ..zero
            },
            _ => Reading { y_by_center: DMat3::IDENTITY, w_by_velocity: DMat3::IDENTITY, ..zero },
        }
    }

    /// Matrix from a term's force to the torque (first three rows) or the force (last three), the first of
    /// these rows, and the derivative by rotation at a fixed force.
    fn action(&self, moved: &Moved, force: DVec3) -> (DMat3, usize, DMat3) {
        let back = moved.rotation.transpose();
        match self.port {
            Port::Arm => {
                let arm = cross_matrix(self.arm);
                (arm * back, 0, arm * cross_matrix(back * force))
            }
            Port::Spin => (DMat3::IDENTITY * self.scale, 0, DMat3::ZERO),
            Port::InertialSpin => (self.tensor, 0, DMat3::ZERO),
            Port::Turn => (back * self.scale, 0, cross_matrix(back * force) * self.scale),
            Port::BodyAxes => (moved.rotation, 3, moved.rotation * cross_matrix(force) * -1.0),
            _ => (DMat3::IDENTITY, 3, DMat3::ZERO),
        }
    }

    /// Derivative of the torque of a force at the end of the arm by the arm, body axes.
    pub(super) fn by_arm(&self, moved: &Moved, force: DVec3, from: &Derivatives) -> DMat3 {
        let back = moved.rotation.transpose();
        let reading =
            matrix(&from.y) * moved.rotation + matrix(&from.w) * moved.rotation * cross_matrix(moved.spin);
        cross_matrix(back * force) * -1.0 + cross_matrix(self.arm) * back * reading
    }

    /// Adds the derivatives of torque and force; rows of the torque are not yet divided by the moments.
    pub(super) fn scatter(
        &self,
        moved: &Moved,
        force: DVec3,
        (from, term): (&Derivatives, &Applied),
        out: &mut Linearised,
    ) {
        let (action, first, by_turn) = self.action(moved, force);
        let reading = self.reading(moved);
        let (by_y, by_w) = (action * matrix(&from.y), action * matrix(&from.w));
        let turn = by_y * reading.y_by_turn + by_w * reading.w_by_turn + by_turn;
        add(&mut out.x, (first, 0), turn * term.factor);
        if out.x.columns() > 3 {
            add(&mut out.x, (first, 3), by_y * reading.y_by_center * term.factor);
        }
        reading.add_by_velocity((by_w, term.factor), first, &mut out.v);
        for (index, column) in term.parameters.clone().enumerate() {
            let by_p = DVec3::new(from.p[(0, index)], from.p[(1, index)], from.p[(2, index)]);
            let value = action * by_p * term.factor;
            (0..3).for_each(|row| out.p[(first + row, column)] += value[row]);
        }
    }

    /// Adds the derivatives of torque and force by the velocity; rows as of [`Self::scatter`].
    pub(super) fn scatter_by_velocity(
        &self,
        moved: &Moved,
        (from, term): (&Derivatives, &Applied),
        out: &mut Block,
    ) {
        let (action, first, _) = self.action(moved, DVec3::ZERO);
        self.reading(moved).add_by_velocity((action * matrix(&from.w), term.factor), first, out);
    }
}

/// Adds a matrix to a part of a block.
fn add(block: &mut Block, (row, column): (usize, usize), value: DMat3) {
    for j in 0..3 {
        (0..3).for_each(|i| block[(row + i, column + j)] += value.col(j)[i]);
    }
}

/// The matrix of three rows and columns of a block.
fn matrix(block: &Block) -> DMat3 {
    DMat3::from_cols_array_2d(&std::array::from_fn(|column| std::array::from_fn(|row| block[(row, column)])))
}
