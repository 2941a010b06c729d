//! Synthetic scenes with known laws: ray-traced datasets, and the ground truth that a model is compared with.
//!
//! Bodies (`body.rs`, `shape.rs`, `texture.rs`) follow laws in closed form or simulated in doubles by small
//! Runge–Kutta steps (`motion.rs`, `laws`, `simulation.rs`; no code is shared with the product's own
//! integrators), are watched by rings of cameras (`view.rs`) and photographed by an analytic ray tracer in
//! doubles (`trace.rs`); `scenes` is the catalogue, whose constants are drawn from the seed (`draws.rs`),
//! `write.rs` makes the dataset folder and `truth.rs` follows surface points.
//! There are no shadows, and shading turns with the body (see `texture.rs`), so an object's appearance is
//! constant and all change is motion.

mod body;
mod bounce;
mod collisions;
mod draws;
mod error;
mod guided;
mod law_file;
mod laws;
mod motion;
mod options;
mod pose;
mod scenes;
mod shape;
mod simulation;
mod sun;
mod texture;
mod trace;
mod tracks;
mod truth;
mod view;
mod write;

pub use error::SynthError;
pub use options::{Lamp, SynthOptions, TrackOptions};
pub use scenes::{SceneInfo, scenes};
pub use truth::GroundTruth;

use crate::dataset::Progress;
use crate::edit::{MotionEdit, SYNTHETIC_EDITS};
use crate::frames::FrameSequence;
use law_file::law;
use scenes::Scene;
use std::path::Path;

/// Makes the dataset folder of a scene, whole or not at all. The same options give the same bytes.
///
/// # Errors
/// If the scene or an option is unknown, `out` is not empty, or a file can't be written.
pub fn generate(
    scene: &str,
    options: &SynthOptions,
    out: &Path,
    progress: Progress<'_>,
) -> Result<(), SynthError> {
    check(scene, options)?;
    write::generate(&find(scene, options.seed)?, options, out, progress)
}

/// Checks the name of a scene and options, without making anything.
///
/// # Errors
/// If there is no such scene, or an option is out of range.
pub fn check(scene: &str, options: &SynthOptions) -> Result<(), SynthError> {
    options::check(options)?;
    let is_known = scenes().iter().any(|info| info.name == scene);
    if is_known { Ok(()) } else { Err(SynthError::UnknownScene(scene.to_owned())) }
}

/// The trajectories of surface points at the given times, without any image: `points_per_object` of every
/// moving body, and as many that stand still where the scene has fixed parts.
///
/// # Errors
/// If there is no such scene.
pub fn ground_truth(
    scene: &str,
    times: &[f64],
    points_per_object: usize,
    seed: u64,
) -> Result<GroundTruth, SynthError> {
    let scene = find(scene, seed)?;
    let law = law(&scene, &SynthOptions { seed, ..SynthOptions::default() });
    Ok(truth::follow(&scene.stage, times, points_per_object, seed, law))
}

/// The same trajectories under every edit that datasets have, each with its edit; none for a scene without a
/// law.
///
/// # Errors
/// If there is no such scene.
pub fn edited_ground_truths(
    scene: &str,
    times: &[f64],
    points_per_object: usize,
    seed: u64,
) -> Result<Vec<(MotionEdit, GroundTruth)>, SynthError> {
    let scene = find(scene, seed)?;
    let edited = |edit: MotionEdit| {
        let stage = scene.stage.edited(edit)?;
        Some((edit, truth::follow(&stage, times, points_per_object, seed, serde_json::Value::Null)))
    };
    Ok(SYNTHETIC_EDITS.iter().filter_map(|&(_, edit)| edited(edit)).collect())
}

/// The true tracks of 160 surface points of every object over the captured window, at 61 times, as frames of
/// Gaussians that a source can be read from.
///
/// # Errors
/// If there is no such scene.
pub fn tracks(scene: &str, options: &TrackOptions) -> Result<FrameSequence, SynthError> {
    Ok(tracks::tracks(&find(scene, options.seed)?, options))
}

fn find(name: &str, seed: u64) -> Result<Scene, SynthError> {
    scenes::scene(name, seed).ok_or_else(|| SynthError::UnknownScene(name.to_owned()))
}

#[cfg(test)]
mod file_tests;
#[cfg(test)]
mod law_tests;
#[cfg(test)]
mod tests;
