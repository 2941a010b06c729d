//! A scene as a dataset folder.
//!
//! Everything goes into a temporary folder beside the destination, which is renamed when it is complete; a
//! destination that is not empty is refused. Times are multiples of 1/60, or finer in `train`. With V
//! training views (3 held-out ones are added):
//!
//! | split | times | views |
//! |---|---|---|
//! | train | 0 … 45/60, as often as `train_fps` says | training, or a few drawn ones each |
//! | val | 0 … 45/60, every third | held-out |
//! | test | 46/60 … 59/60 | held-out, and up to 5 training views spread evenly |
//! | long | 16 times, 1 … 2.25 | two held-out, two training |
//! | past | 16 times, −0.75 … −0.75/16 | the same |
//! | edit-… | 1/4, 1/2, 3/4, 1 | one held-out, one training |
//!
//! The splits `edit-…` ([`SYNTHETIC_EDITS`]) show the same start under other scales α, β, γ, which stand
//! under `edit` in their `transforms_edit-*.json`; their ground truth, from 0 to 2.25, is in
//! `ground_truth_edit-*.safetensors`.
//! Scenes that no law explains have none.

use super::body::Stage;
use super::error::SynthError;
use super::law_file::law;
use super::options::{Lamp, SynthOptions};
use super::scenes::Scene;
use super::trace::{self, Backdrop};
use super::truth;
use super::view::{HELD_OUT, View};
use crate::dataset::{Progress, write_split};
use crate::edit::{MotionEdit, SYNTHETIC_EDITS};
use crate::files::{self, FileError};
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};
use lgs_core::stream;
use rayon::prelude::*;
use serde_json::{Value, json};
use std::fs;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Frames per unit of time.
const RATE: u32 = 60;
/// The last observed frame.
const LAST_OBSERVED: u32 = 45;
/// Step between the observed frames that the held-out views show.
const VAL_STRIDE: usize = 3;
/// Largest number of training views in the test split.
const TEST_TRAINING_VIEWS: usize = 5;
/// Times of the long and past splits.
const FAR_TIMES: u32 = 16;
/// Spacing of the ground truth's times, as a divisor: 1/100.
const TRUTH_RATE: f64 = 100.0;
/// Ground-truth points of every object.
const TRUTH_POINTS: usize = 500;

/// Times of an edited split.
const EDIT_TIMES: [f64; 4] = [0.25, 0.5, 0.75, 1.0];

/// Images of one motion: the scene's own, or an edited one.
struct Take {
    stage: Stage,
    /// Splits with the edit under which they are made.
    splits: Vec<(&'static str, Option<MotionEdit>)>,
    shots: Vec<Shot>,
}

/// One image to be made.
struct Shot {
    split: &'static str,
    name: String,
    view: usize,
    time: f64,
}

pub(super) fn generate(
    scene: &Scene,
    options: &SynthOptions,
    out: &Path,
    progress: Progress<'_>,
) -> Result<(), SynthError> {
    if !files::is_free(out) {
        return Err(SynthError::Occupied(out.to_path_buf()));
    }
    files::write_folder(out, |folder| fill(folder, scene, options, progress))
}

fn fill(
    folder: &Path,
    scene: &Scene,
    options: &SynthOptions,
    progress: Progress<'_>,
) -> Result<(), SynthError> {
    let views = scene.rig.views(options.views, options.size as usize, options.seed);
    let takes = takes(scene, options);
    for (split, _) in takes.iter().flat_map(|take| &take.splits) {
        let path = folder.join(split);
        fs::create_dir(&path).map_err(|reason| FileError::new("create folder", &path, reason))?;
    }
    let total = takes.iter().map(|take| take.shots.len()).sum();
    let done = AtomicUsize::new(0);
    let count = || progress(done.fetch_add(1, Ordering::Relaxed) + 1, total);
    for take in &takes {
        photograph(folder, take, (&views, options.lamp), &count)?;
        for (split, edit) in &take.splits {
            write_transforms(folder, (split, *edit), &take.shots, &views)?;
        }
    }
    let law = law(scene, options);
    for take in &takes {
        let (split, edit) = take.splits[0];
        let first = if edit.is_some() { 0 } else { -75 };
        let times: Vec<f64> = (first..=225).map(|i| f64::from(i) / TRUTH_RATE).collect();
        let truth = truth::follow(&take.stage, &times, TRUTH_POINTS, options.seed, law.clone());
        truth.save_points(&folder.join(truth::file_name(edit.map(|_| split))))?;
    }
    truth::save_law(folder, &law)
}

/// The scene's own motion, and every edited one.
fn takes(scene: &Scene, options: &SynthOptions) -> Vec<Take> {
    let own = ["train", "val", "test", "long", "past"].map(|split| (split, None)).to_vec();
    let mut takes = vec![Take { stage: scene.stage.clone(), splits: own, shots: shots(options) }];
    let edited = |&(split, edit): &(&'static str, MotionEdit)| {
        let stage = scene.stage.edited(edit)?;
        Some(Take { stage, splits: vec![(split, Some(edit))], shots: edit_shots(split, options) })
    };
    takes.extend(SYNTHETIC_EDITS.iter().filter_map(edited));
    takes
}

fn photograph(
    folder: &Path,
    take: &Take,
    (views, lamp): (&[View], Lamp),
    count: &(impl Fn() + Sync),
) -> Result<(), SynthError> {
    for (number, view) in views.iter().enumerate() {
        let own: Vec<&Shot> = take.shots.iter().filter(|shot| shot.view == number).collect();
        if own.is_empty() {
            continue;
        }
        let backdrop = Backdrop::new(&take.stage, view);
        own.par_iter().try_for_each(|shot| {
            let pixels = match lamp {
                Lamp::Riding => trace::image(&take.stage, view, &backdrop, shot.time),
                Lamp::Sun => trace::sunlit_image(&take.stage, view, shot.time),
            };
            write_png(&folder.join(format!("{}.png", shot.name)), &pixels, view.size as u32)?;
            count();
            Ok::<(), SynthError>(())
        })?;
    }
    Ok(())
}

fn edit_shots(split: &'static str, options: &SynthOptions) -> Vec<Shot> {
    let views = [0, options.views];
    let each = EDIT_TIMES.iter().flat_map(|&time| views.map(|view| (time, view)));
    each.enumerate().map(|(i, (time, view))| shot(split, i, view, time)).collect()
}

fn shot(split: &'static str, number: usize, view: usize, time: f64) -> Shot {
    Shot { split, name: format!("{split}/r_{number:04}"), view, time }
}

/// All images in file order: by split, time, view.
fn shots(options: &SynthOptions) -> Vec<Shot> {
    let held_out: Vec<usize> = (options.views..options.views + HELD_OUT).collect();
    let spread = |count: usize| -> Vec<usize> { (0..count).map(|i| i * options.views / count).collect() };
    let some_of_all = [spread(TEST_TRAINING_VIEWS.min(options.views)), held_out.clone()].concat();
    let few = [spread(2.min(options.views)), held_out[..2].to_vec()].concat();
    let observed: Vec<f64> =
        (0..=LAST_OBSERVED).step_by(VAL_STRIDE).map(|i| f64::from(i) / f64::from(RATE)).collect();
    let future: Vec<f64> = (LAST_OBSERVED + 1..RATE).map(|i| f64::from(i) / f64::from(RATE)).collect();
    let long: Vec<f64> =
        (0..FAR_TIMES).map(|i| 1.0 + 1.25 * f64::from(i) / f64::from(FAR_TIMES - 1)).collect();
    let past: Vec<f64> = (0..FAR_TIMES).map(|i| -0.75 + 0.75 * f64::from(i) / f64::from(FAR_TIMES)).collect();
    let plan = [
        ("val", observed, &held_out),
        ("test", future, &some_of_all),
        ("long", long, &few),
        ("past", past, &few),
    ];
    let rate = options.train_fps;
    let trained: Vec<f64> =
        (0..=LAST_OBSERVED * rate / RATE).map(|i| f64::from(i) / f64::from(rate)).collect();
    let mut shots = training_shots(options, &trained);
    for (split, times, views) in plan {
        let each = times.iter().flat_map(|&time| views.iter().map(move |&view| (time, view)));
        shots.extend(each.enumerate().map(|(i, (time, view))| shot(split, i, view, time)));
    }
    shots
}

/// The training images: of all training views at every time, or of as many drawn ones as are asked for.
fn training_shots(options: &SynthOptions, times: &[f64]) -> Vec<Shot> {
    let count = options.images_per_time.unwrap_or(options.views).min(options.views);
    let mut rng = stream(options.seed, "views of a time", 0);
    let views = |_| {
        let mut views = rand::seq::index::sample(&mut rng, options.views, count).into_vec();
        views.sort_unstable();
        views
    };
    let of_times: Vec<Vec<usize>> = times.iter().map(views).collect();
    let each =
        times.iter().zip(&of_times).flat_map(|(&time, views)| views.iter().map(move |&view| (time, view)));
    each.enumerate().map(|(i, (time, view))| shot("train", i, view, time)).collect()
}

fn write_png(path: &Path, rgba: &[u8], size: u32) -> Result<(), SynthError> {
    let mut bytes = Vec::new();
    PngEncoder::new_with_quality(&mut bytes, CompressionType::Fast, FilterType::Adaptive)
        .write_image(rgba, size, size, ExtendedColorType::Rgba8)
        .map_err(|e| FileError::new("encode image", path, std::io::Error::other(e)))?;
    Ok(files::write_into_new(path, &bytes)?)
}

fn write_transforms(
    folder: &Path,
    (split, edit): (&str, Option<MotionEdit>),
    shots: &[Shot],
    views: &[View],
) -> Result<(), SynthError> {
    let own: Vec<&Shot> = shots.iter().filter(|shot| shot.split == split).collect();
    let frames: Vec<Value> = own.iter().map(|shot| frame_entry(shot, &views[shot.view])).collect();
    let entries = [("camera_angle_x", json!(views[0].fov)), ("frames", json!(frames))];
    let file = entries.into_iter().map(|(key, value)| (key.to_owned(), value)).collect();
    Ok(write_split(folder, (split, edit), file)?)
}

fn frame_entry(shot: &Shot, view: &View) -> Value {
    let (focal, half) = (view.focal, 0.5 * view.size as f64);
    json!({
        "file_path": format!("./{}", shot.name), "time": shot.time, "transform_matrix": view.opengl_pose(),
        "fl_x": focal, "fl_y": focal, "cx": half, "cy": half, "w": view.size, "h": view.size,
    })
}
