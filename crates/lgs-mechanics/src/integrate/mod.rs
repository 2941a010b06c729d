//! Reversible integrators.
//!
//! Every scheme is a symmetric step `Φ_h` of second order whose exact inverse is `Φ₋ₕ`: half a kick, a drift,
//! half a kick for vector coordinates (which is semi-implicit Euler, Eq. 5, with velocities read half a kick
//! later), a splitting of rotations for bodies, and the implicit midpoint rule where the kinetic energy
//! depends on the position. Five of them make a step of fourth order, which stays symmetric, so it has an
//! exact inverse as well. Tangents are carried through each step, so they are exact derivatives of the
//! discrete motion.

mod applied;
mod body_field;
mod composition;
mod design;
mod field;
mod kick_drift;
mod kick_field;
mod midpoint;
mod ports;
mod scheme;
mod solve;
mod stepper;

pub(crate) use composition::{advance, advance_with_tangent};
pub use design::Design;
pub(crate) use design::inertial_force;
pub(crate) use scheme::{acceleration, stepper};
pub(crate) use stepper::{NoSolution, Solved, Stepper, Tangent};
