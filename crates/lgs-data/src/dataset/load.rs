//! Loading of image sets: what is the same for all formats.

use super::background;
use super::error::{DatasetError, Problem};
use super::fingerprint;
use super::formats::DatasetFormat;
use super::frame_spec::FrameSpec;
use super::lens::Lens;
use super::pixels::{self, Masked};
use super::points::NearPlanes;
use super::set::{Dataset, Frame};
use super::store::Store;
use super::undistort::undistorted;
use crate::thresholds::NAMED_ABSENT;
use lgs_core::{Camera, DEFAULT_NEAR, Exposure, PixelFilter};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Called with the number of images done and of all images; from several threads at once.
pub type Progress<'a> = &'a (dyn Fn(usize, usize) + Sync);

/// Options of loading a set.
#[derive(Clone, Debug, PartialEq)]
pub struct LoadOptions {
    /// Layout of the folder. Default: the first of [`DatasetFormat::ALL`] that its contents fit.
    pub format: Option<DatasetFormat>,
    /// White instead of black behind transparent pixels, and behind images without any whose borders agree on
    /// no colour. Default: white.
    pub white_background: bool,
    /// Width to resize every image to, keeping the aspect. Default: native.
    pub resolution: Option<u32>,
    /// Splits to load. Default: all of them.
    pub splits: Option<Vec<String>>,
    /// Only frames of `train` with a time below this are loaded; other splits stay whole. Default: all.
    pub train_before: Option<f32>,
    /// Near plane of all cameras, world units; 0: what the training cameras ask for
    /// ([`super::NearPlanes`]). Default: [`DEFAULT_NEAR`].
    pub near: f32,
    /// How all cameras draw detail finer than a pixel. Default: by dilation.
    pub filter: PixelFilter,
    /// What becomes of images that are listed but absent. Default: an error.
    pub absent: AbsentImages,
    /// Most bytes of decoded images in memory; what is beyond lies decoded in a temporary file. Default: 2
    /// GiB.
    pub cache_bytes: usize,
}

/// What becomes of images that are listed but absent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum AbsentImages {
    /// An error that counts and names them.
    #[default]
    Refuse,
    /// They are left out, and counted in [`Dataset::absent`].
    Skip,
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
            absent: AbsentImages::Refuse,
            cache_bytes: 2 << 30,
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
        let mut splits = names.into_iter().map(read).collect::<Result<Vec<_>, DatasetError>>()?;
        let absent = leave_out_absent(&mut splits, options.absent)?;
        let mut remarks = format.remarks(root)?;
        remarks.extend(times_outside(&splits));
        let mut splits = load_splits(splits, options, progress)?;
        if options.near == 0.0 {
            set_near_planes(&mut splits);
        }
        Ok(Self {
            root: root.to_path_buf(),
            splits,
            absent,
            remarks,
            edits,
            camera_origin: format.camera_origin(root)?,
            background: behind_images(root, format, options.white_background)?,
            init_points: format.points(root)?,
            fingerprint: fingerprint::of(root, format)?,
        })
    }
}

/// The colour behind everything: that of the borders of the training images where these have no transparency,
/// else white or black. It is looked for in these whatever is loaded, so that all who read a set agree on it.
fn behind_images(root: &Path, format: DatasetFormat, is_white: bool) -> Result<[f32; 3], DatasetError> {
    let has_training = format.splits(root, None)?.iter().any(|name| name == "train");
    let specs = if has_training { format.frames(root, "train")? } else { Vec::new() };
    Ok(background::of_opaque_images(&specs).unwrap_or(if is_white { [1.0; 3] } else { [0.0; 3] }))
}

/// The remark that training images have times outside of the sequence, if some have. It spans [0, 1), but
/// D-NeRF's own sets put the last image at 1.
fn times_outside(splits: &[(String, Vec<FrameSpec>)]) -> Option<String> {
    let (_, specs) = splits.iter().find(|(name, _)| name == "train")?;
    let outside = || specs.iter().filter(|spec| !(0.0..=1.0).contains(&spec.time));
    let (first, count, all) = (outside().next()?, outside().count(), specs.len());
    let FrameSpec { index, time, described_in, .. } = first;
    let path = described_in.display();
    Some(format!(
        "`time` should be in [0, 1] and is not for {count} of {all} training images, such as frame {index} \
         with {time}: {path}"
    ))
}

/// Gives all cameras the near planes that the training cameras ask for.
fn set_near_planes(splits: &mut BTreeMap<String, Vec<Frame>>) {
    let frames = splits.get("train").or_else(|| splits.values().next());
    let mut cameras: BTreeMap<usize, Camera> = BTreeMap::new();
    cameras.extend(frames.into_iter().flatten().map(|frame| (frame.camera_id, frame.camera)));
    let planes = NearPlanes::of(&cameras.into_values().collect::<Vec<_>>());
    splits.values_mut().flatten().for_each(|frame| frame.camera.near = planes.at(&frame.camera));
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
    let store = Store::new(options.cache_bytes);
    let load = |spec: &FrameSpec| {
        let frame = load_frame(spec, options, &store)?;
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

/// Takes the frames without an image out, and names those images.
pub(super) fn leave_out_absent(
    splits: &mut [(String, Vec<FrameSpec>)],
    rule: AbsentImages,
) -> Result<Vec<PathBuf>, DatasetError> {
    let listed = splits.iter().map(|(_, specs)| specs.len()).sum();
    let mut absent = Vec::new();
    for (_, specs) in splits.iter_mut() {
        let there: Vec<bool> = specs.par_iter().map(|spec| spec.image_path.exists()).collect();
        let mut there = there.iter();
        specs.retain(|spec| {
            let is_there = there.next() == Some(&true);
            absent.extend((!is_there).then(|| spec.image_path.clone()));
            is_there
        });
    }
    let empty = splits.iter().any(|(_, specs)| specs.is_empty());
    match absent.first() {
        Some(first) if rule == AbsentImages::Refuse || empty => {
            let names: Vec<String> = absent.iter().take(NAMED_ABSENT).map(|p| file_name(p)).collect();
            let problem = Problem::Absent { absent: absent.len(), listed, such_as: names.join(", ") };
            Err(DatasetError::new(first, problem))
        }
        _ => Ok(absent),
    }
}

fn file_name(path: &Path) -> String {
    let parts: Vec<_> = path.iter().rev().take(2).map(|part| part.to_string_lossy()).collect();
    parts.into_iter().rev().collect::<Vec<_>>().join("/")
}

/// The camera and the image of a frame, without the distortion of its lens, at a width or as it is.
pub(super) fn photograph(spec: &FrameSpec, width: Option<u32>) -> Result<(Camera, Masked), DatasetError> {
    let image = pixels::decode(&spec.image_path)?;
    let camera = spec.camera(image.width(), image.height())?;
    let mask = spec.mask_path.as_ref().map(|path| pixels::decode_mask(path, image.dimensions()));
    let mut masked = Masked { mask: mask.transpose()?, image };
    if spec.lens != Lens::Pinhole {
        masked = undistorted(&masked, &camera, &spec.lens);
    }
    match width {
        Some(width) if width != camera.width => {
            let height = (f64::from(camera.height) * f64::from(width) / f64::from(camera.width))
                .round()
                .max(1.0) as u32;
            Ok((camera.resized(width, height), masked.resized(width, height)))
        }
        _ => Ok((camera, masked)),
    }
}

fn load_frame(spec: &FrameSpec, options: &LoadOptions, store: &Arc<Store>) -> Result<Frame, DatasetError> {
    let (camera, masked) = photograph(spec, options.resolution)?;
    let camera = Camera { near: options.near, filter: options.filter, ..camera };
    let pixels = store.keep(masked.into_picture())?;
    let (name, exposure) = (spec.name.clone(), Exposure::IDENTITY);
    Ok(Frame { name, camera_id: 0, camera, time: spec.time, exposure, pixels })
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
