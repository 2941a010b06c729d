//! A scene as a dataset folder.
//!
//! Everything goes into a temporary folder beside the destination, which is renamed when it is complete; a
//! destination that holds anything is refused. Times are multiples of 1/60. With V training views (3 held-out
//! ones are added):
//!
//! | split | times | views |
//! |---|---|---|
//! | train | 0 … 45/60, thinned by `train_fps` | training |
//! | val | 0 … 45/60, every third | held-out |
//! | test | 46/60 … 59/60 | held-out, and up to 5 training views spread evenly |
//! | long | 16 times, 1 … 2.25 | two held-out, two training |
//! | past | 16 times, −0.75 … −0.75/16 | the same |

use super::scenes::Scene;
use super::trace::{self, Backdrop};
use super::truth;
use super::view::{HELD_OUT, View};
use super::{SynthError, SynthOptions, law};
use crate::dataset::Progress;
use crate::files::{self, FileError};
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};
use rayon::prelude::*;
use serde_json::{Value, json};
use std::fs;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Frames per unit of time.
const RATE: u32 = 60;
/// The last observed frame.
const LAST_OBSERVED: u32 = 45;
/// Every which observed frame the held-out views show.
const VAL_STRIDE: usize = 3;
/// Training views in the test split, at most.
const TEST_TRAINING_VIEWS: usize = 5;
/// Times of the long and past splits.
const FAR_TIMES: u32 = 16;
/// Spacing of the ground truth's times, as a divisor: 1/100.
const TRUTH_RATE: f64 = 100.0;
/// Ground-truth points of every object.
const TRUTH_POINTS: usize = 500;

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
    refuse_occupied(out)?;
    let parent = files::folder_of(out);
    fs::create_dir_all(parent).map_err(|e| FileError::new("create folder", parent, e))?;
    let folder = files::temporary_builder(0o777)
        .tempdir_in(parent)
        .map_err(|e| FileError::new("create folder in", parent, e))?;
    fill(folder.path(), scene, options, progress)?;
    if out.exists() {
        fs::remove_dir(out).map_err(|e| FileError::new("replace folder", out, e))?;
    }
    fs::rename(folder.path(), out).map_err(|e| FileError::new("create folder", out, e))?;
    let _ = folder.keep(); // renamed: nothing is left to delete
    Ok(())
}

fn refuse_occupied(out: &Path) -> Result<(), SynthError> {
    let empty = match fs::read_dir(out) {
        Ok(mut entries) => entries.next().is_none(),
        Err(_) => !out.exists(), // what else is wrong with the path shows when the folder is created
    };
    if empty { Ok(()) } else { Err(SynthError::Occupied(out.to_path_buf())) }
}

fn fill(
    folder: &Path,
    scene: &Scene,
    options: &SynthOptions,
    progress: Progress<'_>,
) -> Result<(), SynthError> {
    let views = scene.rig.views(options.views, options.size as usize, options.seed);
    let shots = shots(options);
    for split in ["train", "val", "test", "long", "past"] {
        let path = folder.join(split);
        fs::create_dir(&path).map_err(|reason| FileError::new("create folder", &path, reason))?;
    }
    let done = AtomicUsize::new(0);
    for (number, view) in views.iter().enumerate() {
        let backdrop = Backdrop::new(&scene.stage, view);
        let own: Vec<&Shot> = shots.iter().filter(|shot| shot.view == number).collect();
        own.par_iter().try_for_each(|shot| {
            let pixels = trace::image(&scene.stage, view, &backdrop, shot.time);
            write_png(&folder.join(format!("{}.png", shot.name)), &pixels, options.size)?;
            progress(done.fetch_add(1, Ordering::Relaxed) + 1, shots.len());
            Ok::<(), SynthError>(())
        })?;
    }
    for split in ["train", "val", "test", "long", "past"] {
        write_transforms(folder, split, &shots, &views)?;
    }
    let times: Vec<f64> = (-75..=225).map(|i| f64::from(i) / TRUTH_RATE).collect();
    truth::follow(&scene.stage, &times, TRUTH_POINTS, options.seed, law(scene, options)).save(folder)
}

/// All images in file order: by split, time, view.
fn shots(options: &SynthOptions) -> Vec<Shot> {
    let training: Vec<usize> = (0..options.views).collect();
    let held_out: Vec<usize> = (options.views..options.views + HELD_OUT).collect();
    let spread = |count: usize| -> Vec<usize> { (0..count).map(|i| i * options.views / count).collect() };
    let some_of_all = [spread(TEST_TRAINING_VIEWS.min(options.views)), held_out.clone()].concat();
    let few = [spread(2.min(options.views)), held_out[..2].to_vec()].concat();
    let observed = |stride: usize| -> Vec<f64> {
        (0..=LAST_OBSERVED).step_by(stride).map(|i| f64::from(i) / f64::from(RATE)).collect()
    };
    let future: Vec<f64> = (LAST_OBSERVED + 1..RATE).map(|i| f64::from(i) / f64::from(RATE)).collect();
    let long: Vec<f64> =
        (0..FAR_TIMES).map(|i| 1.0 + 1.25 * f64::from(i) / f64::from(FAR_TIMES - 1)).collect();
    let past: Vec<f64> = (0..FAR_TIMES).map(|i| -0.75 + 0.75 * f64::from(i) / f64::from(FAR_TIMES)).collect();
    let plan = [
        ("train", observed((RATE / options.train_fps) as usize), &training),
        ("val", observed(VAL_STRIDE), &held_out),
        ("test", future, &some_of_all),
        ("long", long, &few),
        ("past", past, &few),
    ];
    let mut shots = Vec::new();
    for (split, times, views) in plan {
        let each = times.iter().flat_map(|&time| views.iter().map(move |&view| (time, view)));
        shots.extend(each.enumerate().map(|(i, (time, view))| Shot {
            split,
            name: format!("{split}/r_{i:04}"),
            view,
            time,
        }));
    }
    shots
}

fn write_png(path: &Path, rgba: &[u8], size: u32) -> Result<(), SynthError> {
    let mut bytes = Vec::new();
    PngEncoder::new_with_quality(&mut bytes, CompressionType::Fast, FilterType::Adaptive)
        .write_image(rgba, size, size, ExtendedColorType::Rgba8)
        .map_err(|e| FileError::new("encode image", path, std::io::Error::other(e)))?;
    // No flush to the disk per image: the folder only gets its name when all of it is there.
    fs::write(path, bytes).map_err(|reason| FileError::new("write image", path, reason).into())
}

fn write_transforms(folder: &Path, split: &str, shots: &[Shot], views: &[View]) -> Result<(), SynthError> {
    let own: Vec<&Shot> = shots.iter().filter(|shot| shot.split == split).collect();
    let frames: Vec<Value> = own.iter().map(|shot| frame_entry(shot, &views[shot.view])).collect();
    let file = json!({ "camera_angle_x": views[0].fov, "frames": frames });
    files::write_atomically(&folder.join(format!("transforms_{split}.json")), |w| {
        serde_json::to_writer(w, &file).map_err(Into::into)
    })?;
    Ok(())
}

fn frame_entry(shot: &Shot, view: &View) -> Value {
    let (focal, half) = (view.focal, 0.5 * view.size as f64);
    json!({
        "file_path": format!("./{}", shot.name), "time": shot.time, "transform_matrix": view.opengl_pose(),
        "fl_x": focal, "fl_y": focal, "cx": half, "cy": half, "w": view.size, "h": view.size,
    })
}
