//! The layout of Nerfies, HyperNeRF and DyCheck: `dataset.json`, `metadata.json`, `scene.json`,
//! `camera/ID.json` and `rgb/Nx/ID.png`.
//!
//! The splits `train`, `val` and `test` are the lists `…_ids` of `dataset.json`, or `frame_names` of
//! `splits/….json` where there are such files (DyCheck). The time of an image is its `time_id`, else its
//! `warp_id`, in `metadata.json`: number n of a to b in all of the set has the time (n − a) / (b − a + 1).
//! `camera_id` names its camera.
//!
//! A camera has `orientation` (world to camera by rows, OpenCV axes), `position`, `focal_length`,
//! `pixel_aspect_ratio`, `principal_point`, `skew`, `radial_distortion` (k1 k2 k3), `tangential_distortion`
//! (p1 p2) and `image_size`; images are undistorted. Those of the largest size in `rgb/` are read, and
//! intrinsics scale with them. World units are those of `scene.json`: `(position − center) · scale`, for
//! cameras and for the points of `points.npy`.

use super::reader::{FormatReader, Label};
use crate::dataset::error::{DatasetError, Problem};
use crate::dataset::frame_spec::{FrameSpec, Intrinsics, SizeRule};
use crate::dataset::lens::Lens;
use crate::dataset::{npy, poses, times, transforms};
use crate::ply::Points;
use glam::{DMat3, DVec3};
use serde::Deserialize;
use serde_json::{Map, Value};
use std::path::{Path, PathBuf};

const SPLITS: [&str; 3] = ["train", "val", "test"];

pub(super) struct HyperNerf;

/// `scene.json`; a set without one is in its own units.
#[derive(Deserialize)]
struct Scene {
    #[serde(default = "one")]
    scale: f64,
    #[serde(default)]
    center: [f64; 3],
}

fn one() -> f64 {
    1.0
}

/// `camera/ID.json`; numbers that are none are `null`.
#[derive(Deserialize)]
struct CameraFile {
    orientation: Option<[[Option<f64>; 3]; 3]>,
    position: Option<[Option<f64>; 3]>,
    focal_length: Option<f64>,
    principal_point: Option<[f64; 2]>,
    #[serde(default)]
    skew: f64,
    #[serde(default = "one")]
    pixel_aspect_ratio: f64,
    #[serde(default)]
    radial_distortion: Vec<f64>,
    #[serde(default, alias = "tangential")]
    tangential_distortion: Vec<f64>,
    image_size: Option<[f64; 2]>,
}

impl FormatReader for HyperNerf {
    fn label(&self) -> Label {
        Label { name: "hypernerf", marker: "`dataset.json` beside `camera/`" }
    }

    fn is_at(&self, root: &Path) -> bool {
        root.join("dataset.json").is_file() && root.join("camera").is_dir()
    }

    fn splits(&self, root: &Path) -> Result<Vec<String>, DatasetError> {
        let mut found = Vec::new();
        for split in SPLITS {
            found.extend((!ids(root, split)?.is_empty()).then(|| split.to_owned()));
        }
        Ok(found)
    }

    fn split_file(&self, root: &Path, split: &str) -> PathBuf {
        let own = root.join(format!("splits/{split}.json"));
        if own.is_file() { own } else { root.join("dataset.json") }
    }

    fn sources(&self, root: &Path, split: &str) -> Vec<PathBuf> {
        let cameras = ids(root, split).unwrap_or_default().into_iter().map(|id| camera_file(root, &id));
        let names = ["metadata.json", "scene.json"].map(|name| root.join(name));
        let files = std::iter::once(self.split_file(root, split)).chain(names).chain(cameras);
        files.filter(|path| path.is_file()).collect()
    }

    fn frames(&self, root: &Path, split: &str) -> Result<Vec<FrameSpec>, DatasetError> {
        let path = self.split_file(root, split);
        let ids = ids(root, split)?;
        if ids.is_empty() {
            return Err(DatasetError::new(&path, Problem::Empty));
        }
        let (scene, metadata) = (scene(root)?, Metadata::of(root)?);
        let images = image_folder(root);
        let frame = |(index, id): (usize, &String)| {
            let file = camera_file(root, id);
            let camera: CameraFile = transforms::read(&file)?;
            let spec = camera.spec(index, &scene).map_err(|problem| DatasetError::new(&file, problem))?;
            let (time, view) = metadata.of_image(id, index)?;
            let image_path = transforms::image_path(&images, id);
            let name = image_path.strip_prefix(root).unwrap_or(&image_path).display().to_string();
            Ok(FrameSpec { described_in: file, index, name, image_path, view, time, ..spec })
        };
        ids.iter().enumerate().map(frame).collect()
    }

    fn points(&self, root: &Path) -> Result<Option<Points>, DatasetError> {
        let path = root.join("points.npy");
        if !path.exists() {
            return Ok(None);
        }
        let mut table = npy::read(&path)?;
        let scene = scene(root)?;
        if table.columns == 3 {
            let values = table.values.iter_mut().enumerate();
            values.for_each(|(i, v)| *v = (*v - scene.center[i % 3]) * scene.scale);
        }
        npy::points(&table).map(Some).map_err(|problem| DatasetError::new(&path, problem))
    }
}

fn camera_file(root: &Path, id: &str) -> PathBuf {
    root.join(format!("camera/{id}.json"))
}

/// Names of the images of a split; none if the set has no such split.
fn ids(root: &Path, split: &str) -> Result<Vec<String>, DatasetError> {
    let own = root.join(format!("splits/{split}.json"));
    let (path, key) = match (own.is_file(), root.join("splits").is_dir()) {
        (true, _) => (own, "frame_names".to_owned()),
        (false, true) if split != "train" => return Ok(Vec::new()),
        _ => (root.join("dataset.json"), format!("{split}_ids")),
    };
    let file: Map<String, Value> = transforms::read(&path)?;
    let wrong = || {
        let reason = format!("`{key}` should be a list of names");
        DatasetError::new(&path, Problem::Malformed(reason))
    };
    match file.get(&key) {
        None => Ok(Vec::new()),
        Some(Value::Array(names)) => {
            names.iter().map(|name| name.as_str().map(str::to_owned).ok_or_else(wrong)).collect()
        }
        Some(_) => Err(wrong()),
    }
}

fn scene(root: &Path) -> Result<Scene, DatasetError> {
    let path = root.join("scene.json");
    if !path.exists() {
        return Ok(Scene { scale: 1.0, center: [0.0; 3] });
    }
    let scene: Scene = transforms::read(&path)?;
    if scene.scale.is_finite() && scene.scale > 0.0 && scene.center.iter().all(|v| v.is_finite()) {
        return Ok(scene);
    }
    let reason = format!("`scale` should be finite and above 0, found {}", scene.scale);
    Err(DatasetError::new(&path, Problem::Malformed(reason)))
}

/// The folder of the largest images: `rgb/1x`, or the smallest reduction there is, or `rgb` itself.
fn image_folder(root: &Path) -> PathBuf {
    let rgb = root.join("rgb");
    let entries = std::fs::read_dir(&rgb).into_iter().flatten().flatten();
    let reduction = |name: &str| name.strip_suffix('x')?.parse::<u32>().ok();
    let reductions = entries.filter_map(|entry| reduction(entry.file_name().to_str()?));
    reductions.min().map_or_else(|| rgb.clone(), |factor| rgb.join(format!("{factor}x")))
}

/// `metadata.json`.
struct Metadata {
    path: PathBuf,
    images: Map<String, Value>,
    first: u64,
    last: u64,
}

impl Metadata {
    fn of(root: &Path) -> Result<Self, DatasetError> {
        let path = root.join("metadata.json");
        let images: Map<String, Value> = transforms::read(&path)?;
        let numbers = images.values().filter_map(number);
        let (first, last) = numbers.fold((u64::MAX, 0), |(a, b), n| (a.min(n), b.max(n)));
        Ok(Self { path, images, first, last })
    }

    /// Time and camera of an image.
    fn of_image(&self, id: &str, frame: usize) -> Result<(f32, Option<String>), DatasetError> {
        let absent = || {
            let reason = format!("image `{id}` (frame {frame}) has no `time_id` or `warp_id`");
            DatasetError::new(&self.path, Problem::Malformed(reason))
        };
        let found = self.images.get(id).ok_or_else(absent)?;
        let number = number(found).ok_or_else(absent)?;
        let times = times::of_numbers(&[Some(self.first), Some(number), Some(self.last)]);
        let view = found.get("camera_id").and_then(Value::as_u64).map(|id| id.to_string());
        Ok((times[1].unwrap_or(0.0) as f32, view))
    }
}

/// The number of an image's moment.
fn number(entry: &Value) -> Option<u64> {
    entry.get("time_id").or_else(|| entry.get("warp_id"))?.as_u64()
}

impl CameraFile {
    /// What a camera says of a frame.
    fn spec(&self, frame: usize, scene: &Scene) -> Result<FrameSpec, Problem> {
        let missing = |field| Problem::Missing { frame, field };
        let wrong = |field, (expected, found): poses::Wrong| Problem::Value { frame, field, expected, found };
        let number = |v: Option<f64>| v.unwrap_or(f64::NAN);
        let rows = self.orientation.ok_or_else(|| missing("orientation"))?;
        let rows = rows.map(|row| DVec3::from_array(row.map(number)));
        let rotation = DMat3::from_cols(rows[0], rows[1], rows[2]).transpose();
        let position = DVec3::from_array(self.position.ok_or_else(|| missing("position"))?.map(number));
        let center = (position - DVec3::from_array(scene.center)) * scene.scale;
        if !center.is_finite() {
            return Err(wrong("position", ("finite", "a value that is not".to_owned())));
        }
        let pose = poses::rigid(rotation, -(rotation * center)).map_err(|w| wrong("orientation", w))?;
        let focal = self.focal_length.ok_or_else(|| missing("focal_length"))?;
        let principal = self.principal_point.ok_or_else(|| missing("principal_point"))?;
        let size = self.image_size.ok_or_else(|| missing("image_size"))?;
        if self.skew != 0.0 {
            return Err(wrong("skew", ("0: skewed cameras are not supported", self.skew.to_string())));
        }
        let at = |list: &[f64], i: usize| list.get(i).copied().unwrap_or(0.0);
        let k = [0, 1, 2].map(|i| at(&self.radial_distortion, i));
        let p = [0, 1].map(|i| at(&self.tangential_distortion, i));
        let lens = Lens::radial([k[0], k[1], k[2], 0.0, 0.0, 0.0], p);
        lens.check(frame, "radial_distortion` or `tangential_distortion")?;
        Ok(FrameSpec {
            camera_from_world: pose.as_mat4(),
            own: Intrinsics::of([focal, focal * self.pixel_aspect_ratio], principal, Some(size)),
            lens,
            size_rule: SizeRule::Scaled,
            ..FrameSpec::default()
        })
    }
}

#[cfg(test)]
mod tests;
