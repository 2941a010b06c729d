//! Synthetic scenes with known laws: ray-traced datasets, and the ground truth to judge a model by.
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
mod draws;
mod guided;
mod laws;
mod motion;
mod scenes;
mod shape;
mod simulation;
mod texture;
mod trace;
mod tracks;
mod truth;
mod view;
mod write;

pub use scenes::{SceneInfo, scenes};
pub use truth::GroundTruth;

use crate::dataset::Progress;
use crate::files::FileError;
use crate::frames::FrameSequence;
use scenes::Scene;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Sides of an image that can be asked for, pixels.
const SIZES: std::ops::RangeInclusive<u32> = 8..=2048;
/// Training views that can be asked for.
const VIEWS: std::ops::RangeInclusive<usize> = 1..=200;

/// A synthetic scene that can't be made or read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SynthError {
    /// There is no scene of that name.
    #[error("there is no scene `{0}`; expected one of {names}", names = scene_names())]
    UnknownScene(String),
    /// An option is out of range.
    #[error("`{option}` should be {expected}, found {found}")]
    Option {
        /// The option.
        option: &'static str,
        /// The expectation.
        expected: &'static str,
        /// The value given.
        found: u64,
    },
    /// The destination is not empty.
    #[error("the output folder should be new or empty: {}", .0.display())]
    Occupied(PathBuf),
    /// A file can't be written or read.
    #[error(transparent)]
    File(#[from] FileError),
    /// A ground-truth file is wrong.
    #[error("bad ground truth: {reason}: {}", path.display())]
    Truth {
        /// The file.
        path: PathBuf,
        /// The defect.
        reason: String,
    },
}

impl SynthError {
    /// The file or folder that the error is about, unless it is about the call.
    #[must_use]
    pub fn path(&self) -> Option<&Path> {
        match self {
            Self::UnknownScene(_) | Self::Option { .. } => None,
            Self::Occupied(path) | Self::Truth { path, .. } => Some(path),
            Self::File(error) => Some(error.path()),
        }
    }
}

/// Options of a synthetic dataset.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SynthOptions {
    /// Width and height of the images, pixels, 8 to 2048. Default 160.
    pub size: u32,
    /// Training views, 1 to 200; three held-out ones are added. Default 12.
    pub views: usize,
    /// Draws the scene's constants, turns the cameras, shifts the textures and picks the ground-truth points.
    /// The seven first scenes keep their usual constants for seed 0. Default 0.
    pub seed: u64,
    /// Training images per unit of time and view, a divisor of 60. Default 60.
    pub train_fps: u32,
}

impl Default for SynthOptions {
    fn default() -> Self {
        Self { size: 160, views: 12, seed: 0, train_fps: 60 }
    }
}

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
    check(options)?;
    write::generate(&find(scene, options.seed)?, options, out, progress)
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

/// Options of true tracks.
#[derive(Clone, Debug, PartialEq)]
pub struct TrackOptions {
    /// Standard deviation of the noise of every coordinate, world units, finite and not negative. It is
    /// independent between points and correlated from frame to frame (0.75). Default 0.
    pub noise: f64,
    /// Draws the scene's constants, the points and the noise. Default 0.
    pub seed: u64,
}

impl Default for TrackOptions {
    fn default() -> Self {
        Self { noise: 0.0, seed: 0 }
    }
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

fn check(options: &SynthOptions) -> Result<(), SynthError> {
    let wrong = |option, expected, found| Err(SynthError::Option { option, expected, found });
    if !SIZES.contains(&options.size) {
        return wrong("size", "8 to 2048 pixels", u64::from(options.size));
    }
    if !VIEWS.contains(&options.views) {
        return wrong("views", "1 to 200", options.views as u64);
    }
    if options.train_fps == 0 || 60 % options.train_fps != 0 {
        return wrong("train_fps", "a divisor of 60", u64::from(options.train_fps));
    }
    Ok(())
}

/// The contents of `scene.json`.
fn law(scene: &Scene, options: &SynthOptions) -> Value {
    let object = |(number, body): (usize, &body::Body)| {
        let mut entry = json!({ "object": number, "name": body.name, "center": body.center.to_array() });
        if let (Some(entry), Value::Object(law)) = (entry.as_object_mut(), body.motion.describe()) {
            entry.extend(law);
        }
        entry
    };
    let objects: Vec<Value> = scene.stage.bodies.iter().enumerate().map(object).collect();
    json!({
        "schema": 1, "scene": scene.info.name, "description": scene.info.description,
        "seed": options.seed, "tau_max": 0.75,
        "expected": if scene.info.explained { "explained" } else { "outside" }, "drawn": scene.info.drawn,
        "objects": objects,
    })
}

fn scene_names() -> String {
    scenes().iter().map(|info| info.name).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod file_tests;
#[cfg(test)]
mod law_tests;
#[cfg(test)]
mod tests;
