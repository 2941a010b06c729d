//! Autonomous laws of motion whose paths are computed in small steps.
//!
//! Every law is a first-order system over a state of positions and velocities, in doubles and without time as
//! an argument, so that it can be followed in both directions. Each says which of its constants are
//! conservative (scaled by β under an edit) and which are not (scaled by γ); α scales velocities at t = 0.
//! Constraints (a hinge, rolling without slipping, a fixed point) do no work and are never scaled.

mod double_pendulum;
mod hinge;
mod modal;
mod point;
mod rigid;
mod rolling;
mod spring_pair;

pub(super) use double_pendulum::DoublePendulum;
pub(super) use hinge::Hinge;
pub(super) use modal::Modal;
pub(super) use point::{Field, Point};
pub(super) use rigid::RigidBody;
pub(super) use rolling::Rolling;
pub(super) use spring_pair::SpringPair;

use super::motion::Pose;
use crate::edit::MotionEdit;
use glam::DVec3;
use serde_json::Value;
use std::fmt::Debug;

/// A law of motion and a start.
pub(super) trait Law: Debug + Send + Sync {
    /// The state at t = 0.
    fn start(&self) -> Vec<f64>;

    /// The time derivative of a state.
    fn rate(&self, state: &[f64]) -> Vec<f64>;

    /// The pose of every body of the law in a state.
    fn poses(&self, state: &[f64]) -> Vec<Pose>;

    /// Kinetic and potential energy of a state, in units of the law's own.
    #[cfg(test)]
    fn energy(&self, state: &[f64]) -> f64;

    /// The law with the same start under an edit.
    fn edited(&self, edit: MotionEdit) -> Box<dyn Law>;

    /// Name, kind and constants of one of the bodies, for `scene.json`.
    fn describe(&self, body: usize) -> Value;
}

/// The vector that starts at an index of a state.
fn vector(state: &[f64], at: usize) -> DVec3 {
    DVec3::new(state[at], state[at + 1], state[at + 2])
}

/// States from vectors, one after the other.
fn joined(vectors: &[DVec3]) -> Vec<f64> {
    vectors.iter().flat_map(|v| v.to_array()).collect()
}
