//! Refinement of the training cameras while the source model is trained (method §3.8): their poses, and what
//! each makes of the scene's colours.
//!
//! Cameras are told apart by their poses: all images of a physical camera that stands share one correction,
//! images of one that moves have one each. `refinement.rs` learns the corrections, and takes out of them what
//! no image shows ([`lgs_core::Gauge`]); `refined.rs` is what is left when the source is trained: later
//! stages, evaluation and pictures take the cameras from there.

mod config;
mod refined;
mod refinement;

pub use config::{CamerasConfig, Refine};
pub use refined::{CorrectionSizes, RefinedCamera, RefinedCameras};
pub(crate) use refinement::CameraRefinement;

#[cfg(test)]
mod tests;
