//! Autonomous laws of motion whose paths are computed in small steps.
//!
//! Every law is a first-order system over a state of positions and velocities, in doubles and without time as
//! an argument, so that it can be followed in both directions. Each says which of its constants are
//! conservative (scaled by β under an edit) and which are not (scaled by γ); α scales velocities at t = 0.
//! Constraints (a hinge, rolling without slipping, a fixed point) do no work and are never scaled.

mod double_pendulum;
mod hinge;
mod law;
mod modal;
mod pair;
mod point;
mod rigid;
mod rolling;

pub(super) use double_pendulum::DoublePendulum;
pub(super) use hinge::Hinge;
pub(super) use law::Law;
pub(super) use modal::Modal;
pub(super) use pair::{Pair, Pull};
pub(super) use point::{Field, Point};
pub(super) use rigid::RigidBody;
pub(super) use rolling::Rolling;
