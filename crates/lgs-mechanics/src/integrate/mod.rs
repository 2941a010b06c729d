//! Reversible integrators.
//!
//! Every scheme is a symmetric step `Φ_h` of second order whose exact inverse is `Φ₋ₕ`: half a kick, a drift,
//! half a kick for vector coordinates (which is semi-implicit Euler, Eq. 5, with velocities read half a kick
//! later), a splitting of rotations for bodies, and the implicit midpoint rule where the kinetic energy
//! depends on the position. Five of them make a step of fourth order, which stays symmetric, so it has an
//! exact inverse as well. Tangents are carried through each step, so they are exact derivatives of the
//! discrete motion.

mod body_field;
mod composition;
mod design;
mod field;
mod kick_drift;
mod midpoint;
mod ports;
mod solve;

pub(crate) use composition::{advance, advance_with_tangent};
pub(crate) use design::{design, inertial_force};

use crate::coordinates::{Coordinates, State};
use crate::law::Law;
use crate::system::Edit;
use kick_drift::KickField;

/// Derivatives of a state by some unknowns: matrices `[freedoms, columns]`, row by row.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Tangent {
    pub(crate) columns: usize,
    pub(crate) x: Vec<f64>,
    pub(crate) v: Vec<f64>,
}

/// A step's equations could not be solved, or gave something that is not finite.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct NoSolution;

/// A symmetric step of second order: the step by `-h` undoes the one by `h`.
pub(crate) trait Stepper {
    /// Advances a state by a time that may be negative.
    fn step(&mut self, state: &mut State, h: f64) -> Result<(), NoSolution>;

    /// Advances a state and its tangent; the last columns of the tangent belong to the law's parameters.
    fn step_with_tangent(
        &mut self,
        state: &mut State,
        tangent: &mut Tangent,
        h: f64,
    ) -> Result<(), NoSolution>;
}

/// The acceleration by the terms of a law under an edit, that of the coordinates' own inertia included only
/// where it depends on the configuration, `[freedoms]`.
pub(crate) fn acceleration(law: &Law, edit: &Edit, state: &State) -> Vec<f64> {
    let mut a = vec![0.0; law.coordinates.freedoms()];
    if law.coordinates.has_rotation() {
        body_field::BodyField::new(law, edit).acceleration(&state.x, &state.v, &mut a);
    } else {
        field::VectorField::new(law, edit).acceleration(&state.x, &state.v, &mut a);
    }
    a
}

/// The scheme that suits a law.
pub(crate) fn stepper<'a>(law: &'a Law, edit: &Edit) -> Box<dyn Stepper + 'a> {
    if law.coordinates.has_rotation() {
        return Box::new(kick_drift::KickDrift::new(body_field::BodyField::new(law, edit)));
    }
    let field = field::VectorField::new(law, edit);
    match law.coordinates {
        Coordinates::Tree(_) => Box::new(midpoint::Midpoint::new(field)),
        _ => Box::new(kick_drift::KickDrift::new(field)),
    }
}
