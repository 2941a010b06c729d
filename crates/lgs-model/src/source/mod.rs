//! Source models: what learns a scene's motion from images, and what a Lagrangian scene is then distilled from.
//!
//! A [`SourceModel`] answers where every Gaussian is at a time of the captured window; nothing else of it is used downstream, so a
//! learned deformation ([`DefGs`]), another method or trajectories from a file are interchangeable.
//! The deformation network ([`network`]) runs as one fused operation on slices; [`tensor`] makes it differentiable inside Burn, and
//! [`mod@reference`] is its twin in plain tensor operations.

mod blocks;
mod config;
mod defgs;
pub mod encoding;
mod matrix;
pub mod network;
pub mod pose;
pub mod reference;
pub mod tensor;
mod time_part;

pub use config::{DeformationConfig, HeadInit, LinearRange, MotionHead, NetworkLayout, ParamRange, ScaleMode};
pub use defgs::{DEFORMED_SCALE_FLOOR, DefGs, DefGsError, compose};
pub use network::{Deformation, InputFrame};
pub use pose::DELTAS;

use lgs_core::GaussianCloud;

/// A model of moving Gaussians that can be asked for any time of the captured window (times are in units of the sequence, see `docs`).
pub trait SourceModel: Send + Sync {
    /// Number of Gaussians; the same, and in the same order, at every time.
    fn len(&self) -> usize;

    /// Whether there are none.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// All Gaussians as they are drawn at a time: unit quaternions, logarithms of positive scales.
    fn cloud_at(&self, time: f32) -> GaussianCloud;

    /// Their centres alone, `[n]`, world units.
    fn positions_at(&self, time: f32) -> Vec<[f32; 3]>;

    /// Their centres at several times, `[times][n]`, world units.
    fn trajectories(&self, times: &[f32]) -> Vec<Vec<[f32; 3]>> {
        times.iter().map(|&t| self.positions_at(t)).collect()
    }
}
