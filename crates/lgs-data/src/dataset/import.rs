//! Sets of any format as sets in the project's own layout: `transforms_<split>.json`, PNG images without the
//! distortion of lenses, masks, and points.
//!
//! Images keep their names below `images/`, masks have the same below `masks/`. The set is written into a
//! temporary folder that gets its name when all of it is there; nothing is written into the source.

mod noise;

pub use noise::CaptureNoise;

use super::error::{DatasetError, Problem};
use super::formats::DatasetFormat;
use super::frame_spec::FrameSpec;
use super::import_rules::{ImportRules, assigned};
use super::load::{AbsentImages, Progress, leave_out_absent, photograph};
use super::pixels::Masked;
use super::set::CameraOrigin;
use super::transforms::write_split;
use crate::edit::MotionEdit;
use crate::files::{self, FileError};
use crate::ply::write_points;
use crate::unfinished::writing;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{DynamicImage, ExtendedColorType, ImageEncoder};
use lgs_core::Camera;
use noise::Disturbances;
use rayon::prelude::*;
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;
use std::path::{Component, Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

/// The size of imported images.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ImportSize {
    /// That of the originals.
    #[default]
    Native,
    /// A width in pixels; the aspect stays.
    Width(u32),
    /// A part of the original width.
    Reduced(u32),
}

/// What to import, and how.
#[derive(Clone, Debug, Default)]
pub struct ImportOptions {
    /// Layout of the source. Default: detected.
    pub format: Option<DatasetFormat>,
    /// What becomes of images that are listed but absent.
    pub absent: AbsentImages,
    /// Size of the images.
    pub size: ImportSize,
    /// Which frames, and in which splits.
    pub rules: ImportRules,
    /// Noise that is put on the training cameras.
    pub noise: CaptureNoise,
}

/// What was imported.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Imported {
    /// Splits with their numbers of images.
    pub splits: Vec<(String, usize)>,
    /// Images that were listed and absent.
    pub absent: usize,
    /// What a user should know of the source.
    pub remarks: Vec<String>,
}

/// A split to be written: its name, the edit that it shows, its frames.
type Split = (String, Option<MotionEdit>, Vec<FrameSpec>);

/// Imports a set into a folder, which must be new or empty.
///
/// # Errors
/// If the source cannot be read, the rules name a camera that it does not have or leave a split empty, or the
/// folder cannot be written.
pub fn import(
    source: &Path,
    out: &Path,
    options: &ImportOptions,
    progress: Progress<'_>,
) -> Result<Imported, DatasetError> {
    let format = DatasetFormat::of(source, options.format)?;
    refuse_inside(source, out)?;
    let read = |name: String| {
        let specs = format.frames(source, &name)?;
        Ok((name, specs))
    };
    let splits =
        format.all_splits(source)?.into_iter().map(read).collect::<Result<Vec<_>, DatasetError>>()?;
    let mut splits = assigned(splits, &options.rules).map_err(|p| DatasetError::new(source, p))?;
    let absent = leave_out_absent(&mut splits, options.absent)?;
    let with_edit = |(name, specs): (String, Vec<FrameSpec>)| {
        let edit = if name.starts_with("edit-") { format.edit(source, &name)? } else { None };
        Ok((name, edit, specs))
    };
    let splits = splits.into_iter().map(with_edit).collect::<Result<Vec<Split>, DatasetError>>()?;
    let training = splits.iter().find(|(name, ..)| name == "train").map_or(&[][..], |(_, _, specs)| specs);
    let photographer = Photographer {
        size: options.size,
        noise: Disturbances::of(training, options.noise, |spec| seen_by(spec, options.size))?,
        origin: format.camera_origin(source)?,
    };
    files::write_folder(out, |folder| {
        write_splits(folder, &splits, &photographer, progress)?;
        if let Some(points) = format.points(source)? {
            write_points(&folder.join("points3d.ply"), &points)?;
        }
        if options.rules.times.is_none() { copy_truth(source, folder) } else { Ok(()) }
    })?;
    let splits = splits.into_iter().map(|(name, _, specs)| (name, specs.len())).collect();
    Ok(Imported { splits, absent: absent.len(), remarks: format.remarks(source)? })
}

/// Refuses to write below the source.
fn refuse_inside(source: &Path, out: &Path) -> Result<(), DatasetError> {
    let unreadable = |path| move |reason| FileError::new("find folder", path, reason);
    let source = source.canonicalize().map_err(unreadable(source))?;
    let absolute = std::path::absolute(out).map_err(unreadable(out))?;
    let existing = absolute.ancestors().find_map(|folder| folder.canonicalize().ok());
    if existing.is_some_and(|folder| folder.starts_with(&source)) {
        let reason = std::io::Error::other("it lies inside of the set that is imported");
        return Err(FileError::new("create folder", out, reason).into());
    }
    Ok(())
}

/// Files of a truth, which hold for the same times.
fn copy_truth(source: &Path, folder: &Path) -> Result<(), DatasetError> {
    for entry in std::fs::read_dir(source).into_iter().flatten().flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        if name == "scene.json" || (name.starts_with("ground_truth") && name.ends_with(".safetensors")) {
            let _writing = writing();
            let copied = std::fs::copy(entry.path(), folder.join(&name));
            copied.map_err(|reason| FileError::new("copy file", &entry.path(), reason))?;
        }
    }
    Ok(())
}

/// How the images of a set are taken over.
struct Photographer {
    size: ImportSize,
    noise: Disturbances,
    origin: CameraOrigin,
}

impl Photographer {
    fn photograph(&self, split: &str, spec: &FrameSpec) -> Result<(Camera, Masked), DatasetError> {
        let taken = photograph(spec, width_of(spec, self.size)?)?;
        Ok(if split == "train" { self.noise.applied(spec, taken) } else { taken })
    }
}

fn write_splits(
    folder: &Path,
    splits: &[Split],
    photographer: &Photographer,
    progress: Progress<'_>,
) -> Result<(), DatasetError> {
    let total = splits.iter().map(|(_, _, specs)| specs.len()).sum();
    let done = AtomicUsize::new(0);
    let mut names = Names::default();
    for (split, edit, specs) in splits {
        let jobs: Vec<(&FrameSpec, String, bool)> = specs.iter().map(|spec| names.of(spec)).collect();
        let frame = |(spec, name, is_new): &(&FrameSpec, String, bool)| {
            let (camera, masked) = photographer.photograph(split, spec)?;
            if *is_new {
                write_images(folder, name, &masked)?;
            }
            progress(done.fetch_add(1, Ordering::Relaxed) + 1, total);
            Ok(entry(spec, name, &camera, masked.has_left_out()))
        };
        let frames = jobs.par_iter().map(frame).collect::<Result<Vec<Value>, DatasetError>>()?;
        let facts = [("cameras", json!(photographer.origin)), ("frames", json!(frames))];
        let facts = facts.map(|(key, value)| (key.to_owned(), value));
        write_split(folder, (split, *edit), Map::from_iter(facts))?;
    }
    Ok(())
}

/// The camera of a frame at the size asked for, without its image.
fn seen_by(spec: &FrameSpec, size: ImportSize) -> Result<Camera, DatasetError> {
    let unreadable = |e| DatasetError::new(&spec.image_path, Problem::Image(e));
    let (width, height) = image::image_dimensions(&spec.image_path).map_err(unreadable)?;
    let camera = spec.camera(width, height)?;
    Ok(match width_of(spec, size)? {
        Some(width) => camera.resized(width, (height * width / camera.width).max(1)),
        None => camera,
    })
}

/// The width to resize to; nothing for that of the original.
fn width_of(spec: &FrameSpec, size: ImportSize) -> Result<Option<u32>, DatasetError> {
    let factor = match size {
        ImportSize::Native => return Ok(None),
        ImportSize::Width(width) => return Ok(Some(width)),
        ImportSize::Reduced(factor) => factor,
    };
    let (width, _) = image::image_dimensions(&spec.image_path)
        .map_err(|e| DatasetError::new(&spec.image_path, Problem::Image(e)))?;
    Ok(Some((f64::from(width) / f64::from(factor)).round().max(1.0) as u32))
}

/// Names of images in the new set, each for one original.
#[derive(Default)]
struct Names(BTreeMap<String, PathBuf>);

impl Names {
    /// A frame with its image's name, and whether the image has not been written yet.
    fn of<'a>(&mut self, spec: &'a FrameSpec) -> (&'a FrameSpec, String, bool) {
        let parts = Path::new(&spec.name).components();
        let normal = parts.filter_map(|part| match part {
            Component::Normal(part) => part.to_str(),
            _ => None,
        });
        let path = normal.collect::<Vec<_>>().join("/");
        let path = path.strip_prefix("images/").unwrap_or(&path);
        let images = [".png", ".jpg", ".jpeg", ".PNG", ".JPG", ".JPEG"];
        let bare = images.iter().find_map(|ending| path.strip_suffix(ending)).unwrap_or(path);
        let mut name = bare.to_owned();
        let mut number = 1;
        while self.0.get(&name).is_some_and(|original| *original != spec.image_path) {
            number += 1;
            name = format!("{bare}_{number}");
        }
        let is_new = self.0.insert(name.clone(), spec.image_path.clone()).is_none();
        (spec, name, is_new)
    }
}

fn write_images(folder: &Path, name: &str, masked: &Masked) -> Result<(), DatasetError> {
    let has_alpha = masked.image.pixels().any(|p| p.0[3] < 255);
    let image = DynamicImage::ImageRgba8(masked.image.clone());
    let image = if has_alpha { image } else { image.into_rgb8().into() };
    write_png(&folder.join(format!("images/{name}.png")), &image)?;
    match &masked.mask {
        Some(mask) if masked.has_left_out() => {
            write_png(&folder.join(format!("masks/{name}.png")), &mask.clone().into())
        }
        _ => Ok(()),
    }
}

fn write_png(path: &Path, image: &DynamicImage) -> Result<(), DatasetError> {
    let mut bytes = Vec::new();
    let kind: ExtendedColorType = image.color().into();
    PngEncoder::new_with_quality(&mut bytes, CompressionType::Fast, FilterType::Adaptive)
        .write_image(image.as_bytes(), image.width(), image.height(), kind)
        .map_err(|e| FileError::new("encode image", path, std::io::Error::other(e)))?;
    Ok(files::write_into_new(path, &bytes)?)
}

fn entry(spec: &FrameSpec, name: &str, camera: &Camera, has_mask: bool) -> Value {
    let flip = glam::DMat4::from_diagonal(glam::DVec4::new(1.0, -1.0, -1.0, 1.0));
    let pose = (camera.camera_from_world.as_dmat4().inverse() * flip).transpose().to_cols_array_2d();
    let mut entry = json!({
        "file_path": format!("./images/{name}.png"), "time": spec.time, "transform_matrix": pose,
        "fl_x": camera.fx, "fl_y": camera.fy, "cx": camera.cx, "cy": camera.cy,
        "w": camera.width, "h": camera.height,
    });
    if let Some(keys) = entry.as_object_mut() {
        let mask = has_mask.then(|| ("mask_path", json!(format!("./masks/{name}.png"))));
        let view = spec.view.as_ref().map(|view| ("camera", json!(view)));
        keys.extend(mask.into_iter().chain(view).map(|(key, value)| (key.to_owned(), value)));
    }
    entry
}

#[cfg(test)]
pub(in crate::dataset) mod tests;
