//! Source models: what learns a scene's motion from images, and what a Lagrangian scene is then distilled
//! from.
//!
//! A [`SourceModel`] answers where every Gaussian is at a time of the captured window; nothing else of it is
//! used downstream, so a learned deformation ([`DefGs`]), another method or trajectories from a file are
//! interchangeable. A new kind needs a [`SourceKind`], an implementation of the trait, and a line in
//! [`load_source`]. The deformation network ([`network`]) runs as one fused operation on slices; [`tensor`]
//! makes it differentiable inside Burn, and [`mod@reference`] is its twin in plain tensor operations.

mod blocks;
mod config;
mod defgs;
mod file;
pub mod freegave;
mod imported;
pub mod network;
mod official;
pub mod pose;
pub mod reference;
pub mod tensor;
#[cfg(test)]
mod testing;
mod time_part;

pub use config::{DeformationConfig, HeadInit, MotionHead, NetworkLayout, ScaleMode};
pub use defgs::{DEFORMED_SCALE_FLOOR, DefGs, compose};
pub use file::{SourceError, SourceKind, import_source, imported_kind, load_source};
pub use freegave::{FreeGave, FreeGaveConfig, RotationForm, VelocityConfig};
pub use imported::ImportedFrames;
pub use network::{Deformation, InputFrame};
pub use official::{is_official_defgs, read_official_defgs};
pub use pose::DELTAS;

use std::path::Path;

use lgs_core::GaussianCloud;

use crate::tensor_file::TensorFile;

/// A model of moving Gaussians that can be asked for any time of the captured window (times are in units of
/// the sequence, see `docs`).
pub trait SourceModel: Send + Sync {
    /// Kind of the model.
    fn kind(&self) -> SourceKind;

    /// Number of Gaussians; the same, and in the same order, at every time.
    fn len(&self) -> usize;

    /// Whether there are none.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// All Gaussians as they are drawn at a time: unit quaternions, logarithms of positive scales.
    fn cloud_at(&self, time: f32) -> GaussianCloud;

    /// The Gaussians' centres at a time, `[n]`, world units.
    fn positions_at(&self, time: f32) -> Vec<[f32; 3]>;

    /// First and last time that the model knows anything of, where it ends; outside of them its Gaussians
    /// rest.
    fn time_range(&self) -> Option<[f32; 2]> {
        None
    }

    /// Whether a time is within [`Self::time_range`], rounding aside.
    fn covers(&self, time: f32) -> bool {
        const ROUNDING: f32 = 1e-4;
        self.time_range().is_none_or(|[first, last]| time > first - ROUNDING && time < last + ROUNDING)
    }

    /// The whole model in the format of its kind, to be read by [`load_source`].
    fn to_tensors(&self) -> TensorFile;

    /// Writes the model, atomically.
    ///
    /// # Errors
    /// If the file cannot be written.
    fn save(&self, path: &Path) -> Result<(), SourceError> {
        Ok(self.to_tensors().save(path)?)
    }
}
