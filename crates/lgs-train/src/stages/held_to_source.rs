//! Laws held to their source (method §6): inside the captured window, images of a scene are never much worse
//! than those of the source model that it came from.
//!
//! The law of an object that draws the training images worse than the source does is not to be trusted, if
//! the source's motion of its Gaussians draws them better. The object plays that motion in the window then:
//! with those at rest as the source has them, since they have been fitted beside the wrong motion. Its law
//! goes on under edits, and beyond the window if it forecasts the end of these tracks
//! ([`super::continuation`]). Where the source's motion draws them no better, the images show something that
//! no motion of these Gaussians has, such as the shadow of another object: a law only describes them then.

use std::path::Path;

use lgs_core::{GaussianCloud, Image};
use lgs_data::dataset::Frame;
use lgs_distill::DistillConfig;
use lgs_dynamics::{Edit, Reversal};
use lgs_mechanics::bands::{PositionBand, Verdict};
use lgs_model::source::SourceModel;
use lgs_model::{
    Dynamics, GeneralisedDynamics, LagrangianScene, Motion, ObjectModel, Recording, TensorFile,
    TensorFileError,
};
use lgs_render::{Splats, rasterize};
use rayon::prelude::*;

use super::continuation::{Known, carried_on};
use super::initialise_scene::sampled_times;
use super::recorder::SourceTracks;
use super::spread::spread_over_time;
use crate::thresholds::{HELD_FRAMES, MOST_BELOW_SOURCE};

/// Format of the file of a scene's Gaussians in its source.
const FORMAT: &str = "lagrangegs-source-rows/1";

/// The source of a scene, and which of its Gaussians each Gaussian of the scene is.
pub struct SourceOfScene<'a> {
    /// The source model.
    pub source: &'a dyn SourceModel,
    /// Rows of the source's Gaussians, the static ones first, then the dynamic ones.
    pub rows: Vec<usize>,
    /// Settings of stage 1.
    pub config: &'a DistillConfig,
}

/// A scene that claims no law which is much worse than the source in the window.
pub struct HeldToSource {
    /// The scene.
    pub scene: LagrangianScene,
    /// Objects that draw the window too badly.
    pub worse: Vec<WorseThanSource>,
}

/// An object that draws the window worse than the source does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WorseThanSource {
    /// Index of the object.
    pub object: usize,
    /// Decibels by which it is worse.
    pub decibels: f64,
    /// What became of its motion.
    pub outcome: Outcome,
}

/// What becomes of a motion that draws the window worse than the source does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// The source's tracks take its place in the window, as they draw it better; it is not to be trusted.
    GivesWay,
    /// It stays, and is not to be trusted: there are no tracks to compare it with.
    IsDistrusted,
    /// It stays, as the source's tracks draw the window no better.
    Stays,
}

/// Writes which of the source's Gaussians each Gaussian of a scene is.
pub(crate) fn save_rows(rows: &[usize], path: &Path) -> Result<(), TensorFileError> {
    let mut file = TensorFile::new(FORMAT);
    let rows: Vec<u32> = rows.iter().map(|&row| row as u32).collect();
    file.insert_indices("rows", &[rows.len()], &rows);
    file.save(path)
}

/// Reads what [`save_rows`] wrote for a scene of a source.
pub(crate) fn load_rows(
    path: &Path,
    source: &dyn SourceModel,
    scene: &LagrangianScene,
) -> Result<Vec<usize>, TensorFileError> {
    let file = TensorFile::load(path, FORMAT)?;
    let rows: Vec<usize> = file.indices("rows")?.1.iter().map(|&row| row as usize).collect();
    let expected = scene.len();
    if rows.len() == expected && rows.iter().all(|&row| row < source.len()) {
        return Ok(rows);
    }
    let expected = format!("{expected} rows below {}", source.len());
    Err(file.field("rows", &expected, format!("{} rows", rows.len())))
}

/// Gives up laws, and poses of bodies without a law, that draw what training images show of their objects
/// worse than the source does, by more than half a decibel, and plays the source's tracks instead where
/// these draw it better; where they do not, no law explains what the images show.
#[must_use]
pub fn held_to_source(mut scene: LagrangianScene, of: &SourceOfScene<'_>, frames: &[Frame]) -> HeldToSource {
    let frames = spread_over_time(frames, HELD_FRAMES, [1, 2]);
    let below = decibels_below(&scene, of, &frames);
    tracing::debug!(?below, "decibels below the source, by object");
    let is_worse = |(object, &below): (usize, &f64)| {
        let plays_parts = scene.objects[object].recording.as_ref().is_some_and(Recording::has_parts);
        (!plays_parts && below > MOST_BELOW_SOURCE).then_some(object)
    };
    let worse: Vec<usize> = below.iter().enumerate().filter_map(is_worse).collect();
    if worse.is_empty() {
        return HeldToSource { scene, worse: Vec::new() };
    }
    let playing = with_tracks(&scene, &worse, of);
    let after = decibels_below(&playing, of, &frames);
    tracing::debug!(?after, "the same with the source's tracks");
    let outcome = |object: usize| match playing.objects[object].recording {
        None => Outcome::IsDistrusted,
        Some(_) if after[object] < below[object] => Outcome::GivesWay,
        Some(_) => Outcome::Stays,
    };
    let told =
        |&object: &usize| WorseThanSource { object, decibels: below[object], outcome: outcome(object) };
    let worse: Vec<WorseThanSource> = worse.iter().map(told).collect();
    worse.iter().for_each(|worse| lower(&mut scene.objects[worse.object], worse.outcome));
    let gives_way = |worse: &WorseThanSource| (worse.outcome == Outcome::GivesWay).then_some(worse.object);
    let playing: Vec<usize> = worse.iter().filter_map(gives_way).collect();
    let scene = if playing.is_empty() { scene } else { with_tracks(&scene, &playing, of) };
    HeldToSource { scene, worse }
}

/// The scene with the source's tracks of some objects, and the source's Gaussians at rest.
fn with_tracks(scene: &LagrangianScene, objects: &[usize], of: &SourceOfScene<'_>) -> LagrangianScene {
    let mut playing = scene.clone();
    let times = sampled_times(of.source, scene.motion.time_window, scene.motion.dt);
    let tracks = SourceTracks { source: of.source, times: &times };
    let start = of.source.unshaded_at(times[0]);
    let (at_rest, moving) = of.rows.split_at(scene.static_gaussians.len());
    playing.static_gaussians = start.select(at_rest);
    for &object in objects {
        let members = scene.objects[object].members.clone();
        let rows = &moving[members.clone()];
        let Some(recording) = tracks.of(rows) else { continue };
        put(&mut playing.dynamic_gaussians, members.start, &start.select(rows));
        let known = Known {
            velocities: &playing.velocities[members],
            motion: playing.motion,
            forecast_error: None,
            config: of.config,
        };
        let recorded = ObjectModel { recording: Some(recording), ..playing.objects[object].clone() };
        playing.objects[object] = carried_on(recorded, known);
    }
    playing
}

/// Says of an object's law that it explains less than it claims, or is not to be trusted at all.
fn lower(object: &mut ObjectModel, outcome: Outcome) {
    let Dynamics::Generalised(GeneralisedDynamics { known, .. }) = &mut object.dynamics else { return };
    if outcome != Outcome::Stays {
        known.verdict = Verdict::Outside;
        known.trusted = [0.0; 2];
        known.band = PositionBand::default();
    } else if known.verdict == Verdict::Explained {
        known.verdict = Verdict::Described;
    }
}

/// Decibels by which each object is drawn worse than by the source; 0 where no frame shows it.
fn decibels_below(scene: &LagrangianScene, of: &SourceOfScene<'_>, frames: &[&Frame]) -> Vec<f64> {
    let mut motion = Motion::new(scene, Edit::default(), Reversal::default());
    let clouds: Vec<GaussianCloud> = frames
        .iter()
        .map(|frame| scene.cloud_at(&motion.state_at(frame.time.max(0.0)), frame.time.max(0.0)))
        .collect();
    let errors: Vec<Vec<[f64; 2]>> =
        frames.par_iter().zip(&clouds).map(|(frame, cloud)| errors(scene, of, frame, cloud)).collect();
    let below = |object: usize| {
        let sum = |which: usize| errors.iter().map(|of_frame| of_frame[object][which]).sum::<f64>();
        let [own, source] = [sum(0), sum(1)];
        if own > 0.0 && source > 0.0 { 10.0 * (own / source).log10() } else { 0.0 }
    };
    (0..scene.objects.len()).map(below).collect()
}

/// Squared errors of a frame by object, each pixel by the part of it that the object covers: of the scene and
/// of the source.
fn errors(
    scene: &LagrangianScene,
    of: &SourceOfScene<'_>,
    frame: &Frame,
    cloud: &GaussianCloud,
) -> Vec<[f64; 2]> {
    let source = of.source.cloud_at(frame.time);
    let truth = shown(frame, frame.composited(scene.background), scene.background);
    let drawn = [cloud, &source].map(|cloud| {
        let drawn = rasterize(&Splats::from(cloud), &frame.camera, scene.background);
        let mut image = drawn.to_image();
        frame.exposure.expose(&mut image.pixels, &drawn.transmittance, scene.background);
        shown(frame, image, scene.background)
    });
    let first = scene.static_gaussians.len();
    let of_object = |object: &ObjectModel| {
        let rows = first + object.members.start..first + object.members.end;
        let own: Vec<usize> = rows.clone().collect();
        let alone = [cloud.select(&own), source.select(&of.rows[rows])];
        let [own, theirs] = alone.map(|alone| transmittance(&alone, frame));
        let covered = |i: usize| f64::from(1.0 - own[i].min(theirs[i]));
        drawn.each_ref().map(|drawn| {
            let pixels = drawn.pixels.iter().zip(&truth.pixels).enumerate();
            pixels.map(|(i, (a, b))| covered(i) * square(a, b)).sum()
        })
    };
    scene.objects.iter().map(of_object).collect()
}

/// An image without what the frame's mask leaves out.
fn shown(frame: &Frame, mut image: Image, background: [f32; 3]) -> Image {
    frame.leave_out(&mut image.pixels, background);
    image
}

/// What Gaussians by themselves let through of the background, pixel by pixel.
fn transmittance(cloud: &GaussianCloud, frame: &Frame) -> Vec<f32> {
    rasterize(&Splats::from(cloud), &frame.camera, [0.0; 3]).transmittance
}

fn square(a: &[f32; 3], b: &[f32; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| f64::from(a - b).powi(2)).sum()
}

/// Writes Gaussians over those of a cloud, from a row on.
fn put(cloud: &mut GaussianCloud, first: usize, new: &GaussianCloud) {
    let rows = first..first + new.len();
    cloud.means[rows.clone()].copy_from_slice(&new.means);
    cloud.rotations[rows.clone()].copy_from_slice(&new.rotations);
    cloud.log_scales[rows.clone()].copy_from_slice(&new.log_scales);
    cloud.raw_opacities[rows.clone()].copy_from_slice(&new.raw_opacities);
    let values = new.sh.len() / new.len().max(1);
    cloud.sh[rows.start * values..rows.end * values].copy_from_slice(&new.sh);
}

#[cfg(test)]
mod tests;
