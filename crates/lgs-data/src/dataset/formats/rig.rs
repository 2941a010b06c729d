//! Synchronised cameras with a calibration: a folder of images, or a video, for each camera.
//!
//! The calibration is a `.toml` as Pose2Sim and anipose write it (a table per camera with `name`, `size`,
//! `matrix`, `distortions` in OpenCV's order, `rotation` as a Rodrigues vector, `translation`, perhaps
//! `fisheye`; camera-from-world), in the folder or in `calibration/`; `intri.yml` and `extri.yml` of OpenCV's
//! file storage; or our own `cameras.json`, whose `img_name`s are the cameras' names. OpenCV counts pixels
//! from their centres, so that half a pixel is added to principal points of all but the last.
//!
//! Images of one number are of one moment: number `n` of a to b has the time (n − a) / (b − a + 1), unless
//! `times.csv` has a row for every moment. Of eight cameras or more, every eighth is in the split `val`.

mod opencv_file;

use super::reader::{FormatReader, Label};
use super::views::{Views, has_extension, place_of};
use super::{csv_times, hold_out};
use crate::cameras::read_cameras_json;
use crate::dataset::error::{DatasetError, Problem};
use crate::dataset::frame_spec::{FrameSpec, Intrinsics};
use crate::dataset::lens::Lens;
use crate::dataset::set::CameraOrigin;
use crate::dataset::{poses, times};
use crate::files;
use glam::{DVec3, Mat4};
use std::path::{Path, PathBuf};
use toml::{Table, Value};

const MARKER: &str =
    "a calibration (`*calib*.toml`, `intri.yml` or `cameras.json`) beside folders of its cameras";

pub(super) struct Rig;

/// A calibrated camera.
struct RigCamera {
    name: String,
    intrinsics: Intrinsics,
    lens: Lens,
    camera_from_world: Mat4,
}

impl FormatReader for Rig {
    fn label(&self) -> Label {
        Label { name: "rig", marker: MARKER }
    }

    fn is_at(&self, root: &Path) -> bool {
        let Some(path) = calibration_of(root) else { return false };
        match cameras(&path) {
            Ok(cameras) => cameras.iter().any(|camera| place_of(root, &camera.name).is_some()),
            // A calibration that is malformed should be named; `cameras.json` is in other folders too.
            Err(_) => !has_extension(&path, &["json"]),
        }
    }

    fn splits(&self, root: &Path) -> Result<Vec<String>, DatasetError> {
        Ok(hold_out::splits(&frames(root)?))
    }

    fn split_file(&self, root: &Path, _: &str) -> PathBuf {
        calibration_of(root).unwrap_or_else(|| root.join("calibration.toml"))
    }

    fn sources(&self, root: &Path, split: &str) -> Vec<PathBuf> {
        let csv = Some(csv_times::file_of(root)).filter(|path| path.exists());
        let poses = Some(root.join(opencv_file::POSES)).filter(|path| path.exists());
        std::iter::once(self.split_file(root, split)).chain(poses).chain(csv).collect()
    }

    fn camera_origin(&self, _: &Path) -> Result<CameraOrigin, DatasetError> {
        Ok(CameraOrigin::Calibrated)
    }

    fn frames(&self, root: &Path, split: &str) -> Result<Vec<FrameSpec>, DatasetError> {
        hold_out::of_split(frames(root)?, split, &self.split_file(root, split))
    }

    fn remarks(&self, root: &Path) -> Result<Vec<String>, DatasetError> {
        let known: Vec<String> =
            cameras(&self.split_file(root, ""))?.into_iter().map(|camera| camera.name).collect();
        let unknown = |path: PathBuf| {
            let name = path.file_stem()?.to_str()?.to_owned();
            (path.is_dir() && holds_images(&path) && !known.contains(&name)).then_some(name)
        };
        let entries = std::fs::read_dir(root).into_iter().flatten().flatten().map(|entry| entry.path());
        let mut names: Vec<String> = entries.filter_map(unknown).collect();
        names.sort();
        let note = |name: String| format!("the images in `{name}` have no camera in the calibration");
        Ok(names.into_iter().map(note).collect())
    }
}

fn holds_images(folder: &Path) -> bool {
    let mut entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    entries.any(|entry| has_extension(&entry.path(), &["png", "jpg", "jpeg"]))
}

/// The calibration of a folder.
fn calibration_of(root: &Path) -> Option<PathBuf> {
    let mut found = Vec::new();
    for folder in [root.to_owned(), root.join("calibration")] {
        let entries = std::fs::read_dir(&folder).into_iter().flatten().flatten().map(|entry| entry.path());
        let mut named: Vec<PathBuf> = entries
            .filter(|path| has_extension(path, &["toml"]))
            .filter(|path| path.to_string_lossy().to_ascii_lowercase().contains("calib"))
            .collect();
        named.sort();
        found.extend(named);
    }
    let opencv = root.join(opencv_file::INTRINSICS);
    found.extend(Some(opencv).filter(|path| path.is_file() && root.join(opencv_file::POSES).is_file()));
    found.extend(Some(root.join("cameras.json")).filter(|path| path.is_file()));
    found.into_iter().next()
}

/// All frames: moment after moment, camera after camera.
fn frames(root: &Path) -> Result<Vec<FrameSpec>, DatasetError> {
    let absent = || DatasetError::new(root, Problem::NoFormat("a calibration".to_owned()));
    let path = calibration_of(root).ok_or_else(absent)?;
    let cameras = cameras(&path)?;
    let place = |camera: &RigCamera| {
        let none = || Problem::Part {
            part: format!("camera `{}`", camera.name),
            field: "name",
            expected: "that of a folder of images or of a video".to_owned(),
            found: "neither".to_owned(),
        };
        place_of(root, &camera.name).ok_or_else(|| DatasetError::new(&path, none()))
    };
    let places = cameras.iter().map(place).collect::<Result<Vec<_>, _>>()?;
    let views = Views::of(&places)?;
    if views.moments.is_empty() {
        return Err(DatasetError::new(&path, Problem::Empty));
    }
    let numbers: Vec<Option<u64>> = views.moments.iter().map(|&n| Some(n)).collect();
    let counted = || times::of_numbers(&numbers).into_iter().flatten().collect();
    let times = csv_times::of_moments(root, views.moments.len())?.unwrap_or_else(counted);
    let mut specs = Vec::new();
    for (&moment, time) in views.moments.iter().zip(times) {
        for (number, camera) in cameras.iter().enumerate() {
            let (described_in, index, time) = (path.clone(), specs.len(), time as f32);
            specs.push(FrameSpec { described_in, index, time, ..camera.spec(views.image(number, moment)) });
        }
    }
    Ok(specs)
}

impl RigCamera {
    /// What the camera says of an image.
    fn spec(&self, image_path: PathBuf) -> FrameSpec {
        let file = image_path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        FrameSpec {
            name: format!("{}/{file}", self.name),
            image_path,
            view: Some(self.name.clone()),
            camera_from_world: self.camera_from_world,
            own: self.intrinsics,
            lens: self.lens,
            ..FrameSpec::default()
        }
    }
}

fn cameras(path: &Path) -> Result<Vec<RigCamera>, DatasetError> {
    if has_extension(path, &["json"]) {
        let wrong = |error| DatasetError::new(path, Problem::Malformed(format!("{error}")));
        let own = |(name, camera): (String, lgs_core::Camera)| RigCamera {
            name,
            intrinsics: Intrinsics::of(
                [camera.fx, camera.fy].map(f64::from),
                [camera.cx, camera.cy].map(f64::from),
                Some([camera.width, camera.height].map(f64::from)),
            ),
            lens: Lens::Pinhole,
            camera_from_world: camera.camera_from_world,
        };
        return Ok(read_cameras_json(path).map_err(wrong)?.into_iter().map(own).collect());
    }
    if has_extension(path, &["yml"]) {
        return opencv_file::cameras(path);
    }
    let text = String::from_utf8_lossy(&files::read_bytes(path)?).into_owned();
    let wrong = |problem| DatasetError::new(path, problem);
    let table: Table = text.parse().map_err(|e| wrong(Problem::Malformed(format!("malformed TOML: {e}"))))?;
    let calibrated = table.iter().filter_map(|(key, value)| Some((key, value.as_table()?)));
    let calibrated = calibrated.filter(|(_, table)| table.contains_key("matrix"));
    let found: Vec<RigCamera> =
        calibrated.map(|(key, table)| camera(key, table).map_err(wrong)).collect::<Result<_, _>>()?;
    if found.is_empty() {
        return Err(wrong(Problem::Malformed("expected tables of cameras with a `matrix`".to_owned())));
    }
    Ok(found)
}

/// A table of a `.toml` with the camera's name.
struct Calibrated<'a> {
    name: &'a str,
    table: &'a Table,
}

/// A camera of a `.toml`.
fn camera(key: &str, table: &Table) -> Result<RigCamera, Problem> {
    let name = table.get("name").and_then(Value::as_str).unwrap_or(key);
    let own = Calibrated { name, table };
    let matrix = own.list("matrix")?;
    let [fx, skew, cx, _, fy, cy, ..] = matrix[..] else {
        return Err(own.wrong("matrix", "3 x 3 numbers", format!("{} numbers", matrix.len())));
    };
    if skew != 0.0 {
        return Err(own.wrong("matrix", "a camera without skew", skew.to_string()));
    }
    let size = if table.contains_key("size") { own.list("size")? } else { Vec::new() };
    let rotation = poses::rotation_of_vector(own.three("rotation")?);
    let pose = poses::rigid(rotation, own.three("translation")?)
        .map_err(|(expected, found)| own.wrong("rotation", expected, found))?;
    Ok(RigCamera {
        intrinsics: Intrinsics::of([fx, fy], [cx + 0.5, cy + 0.5], size.first_chunk().copied()),
        lens: own.lens()?,
        camera_from_world: pose.as_mat4(),
        name: name.to_owned(),
    })
}

impl Calibrated<'_> {
    fn wrong(&self, field: &'static str, expected: &str, found: String) -> Problem {
        Problem::Part { part: format!("camera `{}`", self.name), field, expected: expected.to_owned(), found }
    }

    fn list(&self, field: &'static str) -> Result<Vec<f64>, Problem> {
        let absent = || self.wrong(field, "a list of numbers", "nothing".to_owned());
        let value = self.table.get(field).ok_or_else(absent)?;
        numbers(value).ok_or_else(|| self.wrong(field, "a list of finite numbers", value.to_string()))
    }

    fn three(&self, field: &'static str) -> Result<DVec3, Problem> {
        let found = self.list(field)?;
        match found[..] {
            [x, y, z] => Ok(DVec3::new(x, y, z)),
            _ => Err(self.wrong(field, "three numbers", format!("{found:?}"))),
        }
    }

    fn lens(&self) -> Result<Lens, Problem> {
        let field = "distortions";
        let found = if self.table.contains_key(field) { self.list(field)? } else { Vec::new() };
        let is_fisheye = self.table.get("fisheye").and_then(Value::as_bool).unwrap_or(false);
        let lens = match found[..] {
            [k1, k2, k3, k4] if is_fisheye => Some(Lens::Fisheye([k1, k2, k3, k4])),
            _ if is_fisheye => None,
            _ => Lens::of_opencv(&found),
        };
        let count = if is_fisheye { "4 numbers" } else { "0, 1, 2, 4, 5 or 8 numbers" };
        let lens = lens.ok_or_else(|| self.wrong(field, count, format!("{} numbers", found.len())))?;
        lens.check(0, field)?;
        Ok(lens)
    }
}

/// Finite numbers of a list, those of lists within it too.
fn numbers(value: &Value) -> Option<Vec<f64>> {
    match value {
        Value::Array(values) => Some(values.iter().map(numbers).collect::<Option<Vec<_>>>()?.concat()),
        Value::Float(v) => v.is_finite().then(|| vec![*v]),
        Value::Integer(v) => Some(vec![*v as f64]),
        _ => None,
    }
}

#[cfg(test)]
mod tests;
