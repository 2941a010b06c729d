//! Image sets: cameras, times and images of a scene, in one of the formats of [`DatasetFormat`].
//!
//! Poses are camera-to-world with OpenGL axes where a format follows D-NeRF. Intrinsics of a frame (`fl_x`,
//! `fl_y`, `cx`, `cy`, `w`, `h`) win over those of its file, which win over `camera_angle_x`; published sets
//! do carry a wrong file-level angle. Images are decoded in parallel and kept as 8-bit RGBA; colours are
//! composited over the background on demand in floats, `c = rgb·α + background·(1 − α)`. The published
//! programs truncate that to 8 bits, which only adds noise.
//!
//! `formats/` holds one reader per format, `transforms.rs` the JSON that several of them share,
//! `frame_spec.rs` what a reader says of a frame, `pixels.rs` decodes images, `points.rs` makes the positions
//! of the first Gaussians, `fingerprint.rs` tells one set from another.

mod error;
mod fingerprint;
mod formats;
mod frame_spec;
mod pixels;
mod points;
mod transforms;

pub use crate::ply::Points;
pub use error::{DatasetError, Problem};
pub use formats::{DatasetFormat, format_or_auto};
pub use points::SceneBox;

use crate::edit::MotionEdit;
use frame_spec::FrameSpec;
use lgs_core::{Camera, DEFAULT_NEAR, Image};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

/// Called with the number of images done and of all images; from several threads at once.
pub type Progress<'a> = &'a (dyn Fn(usize, usize) + Sync);

/// Cameras, times and images of a scene.
#[derive(Clone, Debug)]
pub struct Dataset {
    /// The folder.
    pub root: PathBuf,
    /// Frames by split, in file order; `train` is always among them unless [`LoadOptions::splits`] says
    /// otherwise.
    pub splits: BTreeMap<String, Vec<Frame>>,
    /// The edits that some splits show: the same start under other physics. Such splits are not of the motion
    /// that the others show.
    pub edits: BTreeMap<String, MotionEdit>,
    /// Colour behind transparent pixels.
    pub background: [f32; 3],
    /// The points that the set ships, such as `points3d.ply`.
    pub init_points: Option<Points>,
    /// A hash of the whole set, independent of the options it is loaded with: 16 hexadecimal digits.
    pub fingerprint: String,
}

/// An image with its camera and time.
#[derive(Clone, Debug)]
pub struct Frame {
    /// The image's path in the set, without `./`.
    pub name: String,
    /// Frames of the same pose and intrinsics share this number; training cameras come first.
    pub camera_id: usize,
    /// Pose and intrinsics, at the loaded resolution.
    pub camera: Camera,
    /// Time, as in the file; the captured sequence spans [0, 1).
    pub time: f32,
    /// Pixels `[h, w, 4]`, straight alpha.
    pub rgba: Vec<u8>,
}

/// Options of loading a set.
#[derive(Clone, Debug, PartialEq)]
pub struct LoadOptions {
    /// Layout of the folder. Default: the first of [`DatasetFormat::ALL`] that its contents fit.
    pub format: Option<DatasetFormat>,
    /// White instead of black behind transparent pixels. Default: white.
    pub white_background: bool,
    /// Width to resize every image to, keeping the aspect. Default: native.
    pub resolution: Option<u32>,
    /// Splits to load. Default: all of them.
    pub splits: Option<Vec<String>>,
    /// Only frames of `train` with a time below this are loaded; other splits stay whole. Default: all.
    pub train_before: Option<f32>,
    /// Near plane of all cameras, world units. Default: [`DEFAULT_NEAR`].
    pub near: f32,
}

impl Default for LoadOptions {
    fn default() -> Self {
        Self {
            format: None,
            white_background: true,
            resolution: None,
            splits: None,
            train_before: None,
            near: DEFAULT_NEAR,
        }
    }
}

impl Dataset {
    /// Loads a set.
    ///
    /// # Errors
    /// If the folder holds no set in a known format, a file is missing or malformed, a frame lacks its time
    /// or camera, an image does not decode or has another size than its intrinsics, a pose is not finite and
    /// rigid, or a split is empty. The error names file, frame and field.
    pub fn load(root: &Path, options: &LoadOptions, progress: Progress<'_>) -> Result<Self, DatasetError> {
        if options.resolution == Some(0) {
            return Err(DatasetError::new(root, Problem::Resolution));
        }
        let format = DatasetFormat::of(root, options.format)?;
        let read = |name: String| {
            let limit = options.train_before.filter(|_| name == "train").unwrap_or(f32::INFINITY);
            let specs = before(format.frames(root, &name)?, limit, &format.split_file(root, &name))?;
            Ok((name, specs))
        };
        let names = format.splits(root, options.splits.as_deref())?;
        let edit = |name: &String| Ok(format.edit(root, name)?.map(|edit| (name.clone(), edit)));
        let edits = names.iter().filter_map(|name| edit(name).transpose());
        let edits = edits.collect::<Result<BTreeMap<_, _>, DatasetError>>()?;
        let splits = names.into_iter().map(read).collect::<Result<Vec<_>, DatasetError>>()?;
        Ok(Self {
            root: root.to_path_buf(),
            splits: load_splits(splits, options, progress)?,
            edits,
            background: if options.white_background { [1.0; 3] } else { [0.0; 3] },
            init_points: format.points(root)?,
            fingerprint: fingerprint::of(root, format)?,
        })
    }

    /// A dataset without images, for work that needs none: it holds only the colour behind the Gaussians.
    #[must_use]
    pub fn none(background: [f32; 3]) -> Self {
        Self {
            root: PathBuf::new(),
            splits: BTreeMap::new(),
            edits: BTreeMap::new(),
            background,
            init_points: None,
            fingerprint: "none".to_owned(),
        }
    }

    /// The frames of a split; empty if the set has no such split.
    #[must_use]
    pub fn split(&self, name: &str) -> &[Frame] {
        self.splits.get(name).map_or(&[], Vec::as_slice)
    }

    /// One frame of every camera of a split, in order of first appearance.
    #[must_use]
    pub fn cameras(&self, split: &str) -> Vec<&Frame> {
        let mut found: Vec<&Frame> = Vec::new();
        for frame in self.split(split) {
            if !found.iter().any(|other| other.camera_id == frame.camera_id) {
                found.push(frame);
            }
        }
        found
    }

    /// The width, world units, that a pixel of the median training camera covers at the centre of
    /// [`Self::scene_box`].
    #[must_use]
    pub fn pixel_size(&self) -> f32 {
        points::pixel_size_at(&self.cameras("train"), self.scene_box().center)
    }

    /// Radius of the training cameras around their mean, times 1.1; thresholds of
    /// densification are in this unit.
    #[must_use]
    pub fn extent(&self) -> f32 {
        let split = if self.splits.contains_key("train") {
            Some("train")
        } else {
            self.splits.keys().next().map(String::as_str)
        };
        points::camera_extent(self.split(split.unwrap_or("train")))
    }
}

impl Frame {
    /// The image over a background, floats in [0, 1].
    #[must_use]
    pub fn composited(&self, background: [f32; 3]) -> Image {
        let over = |p: &[u8; 4]| {
            let alpha = f32::from(p[3]) / 255.0;
            std::array::from_fn(|c| f32::from(p[c]) / 255.0 * alpha + background[c] * (1.0 - alpha))
        };
        let pixels = self.rgba.as_chunks().0.iter().map(over).collect();
        Image { width: self.camera.width, height: self.camera.height, pixels }
    }

    /// Opacity of every pixel, in [0, 1].
    #[must_use]
    pub fn alpha(&self) -> Vec<f32> {
        self.rgba.as_chunks::<4>().0.iter().map(|p| f32::from(p[3]) / 255.0).collect()
    }

    /// Whether any pixel is not fully opaque.
    #[must_use]
    pub fn has_alpha(&self) -> bool {
        self.rgba.as_chunks::<4>().0.iter().any(|p| p[3] < 255)
    }
}

/// The frames with a time below a limit; there must be one.
fn before(mut specs: Vec<FrameSpec>, limit: f32, path: &Path) -> Result<Vec<FrameSpec>, DatasetError> {
    let first = specs.iter().map(|spec| spec.time).fold(f32::INFINITY, f32::min);
    specs.retain(|spec| spec.time < limit);
    if specs.is_empty() {
        Err(DatasetError::new(path, Problem::NothingBefore { limit, first }))
    } else {
        Ok(specs)
    }
}

/// Decodes the images of all splits and numbers their cameras.
fn load_splits(
    splits: Vec<(String, Vec<FrameSpec>)>,
    options: &LoadOptions,
    progress: Progress<'_>,
) -> Result<BTreeMap<String, Vec<Frame>>, DatasetError> {
    let total = splits.iter().map(|(_, specs)| specs.len()).sum();
    let done = AtomicUsize::new(0);
    let load = |spec: &FrameSpec| {
        let frame = load_frame(spec, options)?;
        progress(done.fetch_add(1, Ordering::Relaxed) + 1, total);
        Ok(frame)
    };
    let mut cameras = CameraNumbers::default();
    let mut loaded = BTreeMap::new();
    for (name, specs) in splits {
        let mut frames = specs.par_iter().map(load).collect::<Result<Vec<Frame>, DatasetError>>()?;
        frames.iter_mut().for_each(|frame| frame.camera_id = cameras.number(&frame.camera));
        loaded.insert(name, frames);
    }
    Ok(loaded)
}

fn load_frame(spec: &FrameSpec, options: &LoadOptions) -> Result<Frame, DatasetError> {
    if spec.mask_path.is_some() {
        return Err(DatasetError::new(&spec.described_in, Problem::Mask { frame: spec.index }));
    }
    let image = pixels::decode(&spec.image_path)?;
    let camera = Camera { near: options.near, ..spec.camera(image.width(), image.height())? };
    let (camera, image) = match options.resolution {
        Some(width) if width != camera.width => {
            let height = (f64::from(camera.height) * f64::from(width) / f64::from(camera.width))
                .round()
                .max(1.0) as u32;
            (camera.resized(width, height), pixels::resized(&image, width, height))
        }
        _ => (camera, image),
    };
    Ok(Frame { name: spec.name.clone(), camera_id: 0, camera, time: spec.time, rgba: image.into_raw() })
}

/// Numbers cameras in order of first appearance.
#[derive(Default)]
struct CameraNumbers(BTreeMap<[u32; 22], usize>);

impl CameraNumbers {
    fn number(&mut self, camera: &Camera) -> usize {
        let mut key = [0; 22];
        key[..2].copy_from_slice(&[camera.width, camera.height]);
        let intrinsics = [camera.fx, camera.fy, camera.cx, camera.cy];
        let values = intrinsics.into_iter().chain(camera.camera_from_world.to_cols_array());
        for (slot, value) in key[2..].iter_mut().zip(values) {
            *slot = value.to_bits();
        }
        let next = self.0.len();
        *self.0.entry(key).or_insert(next)
    }
}

#[cfg(test)]
mod tests;
