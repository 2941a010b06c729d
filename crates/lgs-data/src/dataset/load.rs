//! Loading of image sets: what is the same for all formats.

use super::error::{DatasetError, Problem};
use super::formats::DatasetFormat;
use super::frame_spec::FrameSpec;
use super::set::{Dataset, Frame};
use super::{fingerprint, pixels};
use lgs_core::{Camera, DEFAULT_NEAR, PixelFilter};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Called with the number of images done and of all images; from several threads at once.
pub type Progress<'a> = &'a (dyn Fn(usize, usize) + Sync);

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
    /// How all cameras draw detail finer than a pixel. Default: by dilation.
    pub filter: PixelFilter,
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
            filter: PixelFilter::default(),
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
    let (near, filter) = (options.near, options.filter);
    let camera = Camera { near, filter, ..spec.camera(image.width(), image.height())? };
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
