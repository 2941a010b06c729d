//! The interface of a law.

use super::super::pose::Pose;
use crate::edit::MotionEdit;
use glam::DVec3;
use serde_json::Value;
use std::fmt::Debug;

/// A law of motion and a start.
pub(in super::super) trait Law: Debug + Send + Sync {
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
pub(super) fn vector(state: &[f64], at: usize) -> DVec3 {
    DVec3::new(state[at], state[at + 1], state[at + 2])
}

/// States from vectors, one after the other.
pub(super) fn joined(vectors: &[DVec3]) -> Vec<f64> {
    vectors.iter().flat_map(|v| v.to_array()).collect()
}
