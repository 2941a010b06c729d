//! Camera paths: keyframes from a file or from views of the dataset, and the cameras between them.

use std::path::Path;

use anyhow::{Result, bail};
use glam::{Mat3, Mat4, Quat, Vec3};
use lgs_core::{Camera, DEFAULT_NEAR, PixelFilter};
use lgs_data::files::read_bytes;
use serde::Deserialize;

use super::failure::At;
use super::thresholds::{LARGEST_SIDE, MAX_KEYFRAMES, MAX_TIMES, ROTATION_TOLERANCE};

/// What the file says it is.
const FORMAT: &str = "lagrangegs-camera-path/1";

/// A camera and a time of the scene at a moment of the film.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Keyframe {
    /// Moment of the film.
    seconds: f32,
    /// Time of the scene.
    time: f32,
    camera: Camera,
}

/// Cameras over the moments of a film, of one size.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct CameraPath {
    /// In order; there is at least one.
    keys: Vec<Keyframe>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PathFile {
    format: String,
    width: u32,
    height: u32,
    keyframes: Vec<KeyframeEntry>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct KeyframeEntry {
    seconds: f32,
    time: f32,
    /// Rows.
    camera_from_world: [[f32; 4]; 4],
    fx: f32,
    fy: f32,
    cx: f32,
    cy: f32,
}

impl CameraPath {
    /// Reads a path.
    pub(crate) fn read(path: &Path) -> Result<Self> {
        let bytes = read_bytes(path).at(path)?;
        let file: PathFile = match serde_json::from_slice(&bytes) {
            Ok(file) => file,
            Err(error) => bail!("this is no camera path: {error}: {}", path.display()),
        };
        match checked(&file) {
            Ok(keys) => Ok(Self { keys }),
            Err(reason) => bail!("{reason}: {}", path.display()),
        }
    }

    /// A path through cameras, one second from each to the next, in the first one's size.
    pub(crate) fn through(cameras: &[Camera]) -> Option<Self> {
        let [width, height] = cameras.first().map(|first| [first.width, first.height])?;
        let key = |(index, camera): (usize, &Camera)| Keyframe {
            seconds: index as f32,
            time: 0.0,
            camera: camera.resized(width, height),
        };
        Some(Self { keys: cameras.iter().enumerate().map(key).collect() })
    }

    /// Cameras for `count` frames, evenly from the first keyframe to the last.
    pub(crate) fn spread(&self, count: usize) -> Vec<Camera> {
        let [first, last] = self.span();
        let part = |index: usize| index as f32 / count.saturating_sub(1).max(1) as f32;
        (0..count).map(|index| self.at(first + (last - first) * part(index)).camera).collect()
    }

    /// Times and cameras of all frames of the film at a rate.
    pub(crate) fn film(&self, frames_per_second: u32) -> Result<(Vec<f32>, Vec<Camera>), String> {
        let [first, last] = self.span();
        let count = (f64::from(last - first) * f64::from(frames_per_second)).round();
        if count >= MAX_TIMES as f64 {
            return Err(format!("a film of {} s has more than {MAX_TIMES} frames", last - first));
        }
        let moment = |index: usize| first + index as f32 / frames_per_second as f32;
        let shots = (0..=count as usize).map(|index| self.at(moment(index)));
        Ok(shots.map(|key| (key.time, key.camera)).unzip())
    }

    fn span(&self) -> [f32; 2] {
        [self.keys[0].seconds, self.keys[self.keys.len() - 1].seconds]
    }

    /// What is seen at a moment: rotations turn evenly, centres follow a cubic Hermite curve through all
    /// keyframes, all else is linear.
    fn at(&self, seconds: f32) -> Keyframe {
        let next = self.keys.partition_point(|key| key.seconds <= seconds);
        let (Some(before), Some(after)) = (next.checked_sub(1), self.keys.get(next)) else {
            return self.keys[next.min(self.keys.len() - 1)];
        };
        let from = self.keys[before];
        let whole = after.seconds - from.seconds;
        let part = (seconds - from.seconds) / whole;
        let mix = |a: f32, b: f32| a + (b - a) * part;
        let rotation = rotation(&from.camera).slerp(rotation(&after.camera), part);
        let slopes = [self.velocity(before) * whole, self.velocity(next) * whole];
        let center = hermite([center(&from.camera), center(&after.camera)], slopes, part);
        let camera = Camera {
            fx: mix(from.camera.fx, after.camera.fx),
            fy: mix(from.camera.fy, after.camera.fy),
            cx: mix(from.camera.cx, after.camera.cx),
            cy: mix(from.camera.cy, after.camera.cy),
            camera_from_world: Mat4::from_quat(rotation) * Mat4::from_translation(-center),
            ..from.camera
        };
        Keyframe { seconds, time: mix(from.time, after.time), camera }
    }

    /// Velocity of the camera's centre at a keyframe, from its neighbours.
    fn velocity(&self, index: usize) -> Vec3 {
        let [before, after] =
            [index.saturating_sub(1), (index + 1).min(self.keys.len() - 1)].map(|i| &self.keys[i]);
        let seconds = after.seconds - before.seconds;
        if seconds > 0.0 { (center(&after.camera) - center(&before.camera)) / seconds } else { Vec3::ZERO }
    }
}

fn center(camera: &Camera) -> Vec3 {
    camera.center_in_world().into()
}

/// Camera from world.
fn rotation(camera: &Camera) -> Quat {
    Quat::from_mat4(&camera.camera_from_world)
}

/// The cubic with given ends and slopes over [0, 1].
fn hermite(ends: [Vec3; 2], slopes: [Vec3; 2], part: f32) -> Vec3 {
    let (square, cube) = (part * part, part * part * part);
    ends[0] * (2.0 * cube - 3.0 * square + 1.0)
        + ends[1] * (3.0 * square - 2.0 * cube)
        + slopes[0] * (cube - 2.0 * square + part)
        + slopes[1] * (cube - square)
}

/// The keyframes of a file, or what is wrong with it.
fn checked(file: &PathFile) -> Result<Vec<Keyframe>, String> {
    if file.format != FORMAT {
        return Err(format!("`format` should be `{FORMAT}`, found `{}`", file.format));
    }
    for (name, side) in [("width", file.width), ("height", file.height)] {
        if !(1..=LARGEST_SIDE).contains(&side) {
            return Err(format!("`{name}` should be 1 to {LARGEST_SIDE}, found {side}"));
        }
    }
    if !(1..=MAX_KEYFRAMES).contains(&file.keyframes.len()) {
        return Err(format!(
            "there should be 1 to {MAX_KEYFRAMES} keyframes, found {}",
            file.keyframes.len()
        ));
    }
    let mut keys: Vec<Keyframe> = Vec::with_capacity(file.keyframes.len());
    for (index, entry) in file.keyframes.iter().enumerate() {
        let key = keyframe(entry, [file.width, file.height])
            .map_err(|reason| format!("keyframe {index}: {reason}"))?;
        if let Some(last) = keys.last().filter(|last| last.seconds >= key.seconds) {
            let [last, found] = [last.seconds, key.seconds];
            return Err(format!("keyframe {index}: `seconds` should be more than {last}, found {found}"));
        }
        keys.push(key);
    }
    Ok(keys)
}

fn keyframe(entry: &KeyframeEntry, [width, height]: [u32; 2]) -> Result<Keyframe, String> {
    let KeyframeEntry { seconds, time, camera_from_world: rows, fx, fy, cx, cy } = entry;
    let numbers = [*seconds, *time, *cx, *cy];
    if !numbers.iter().chain(rows.as_flattened()).all(|number| number.is_finite()) {
        return Err("all numbers should be finite".to_owned());
    }
    if ![fx, fy].iter().all(|focal| focal.is_finite() && **focal > 0.0) {
        return Err(format!("`fx` and `fy` should be above 0, found {fx} and {fy}"));
    }
    let pose = Mat4::from_cols_array_2d(rows).transpose();
    let turn = Mat3::from_mat4(pose);
    let error = (turn * turn.transpose() - Mat3::IDENTITY).abs().to_cols_array();
    let is_rigid = error.iter().all(|entry| *entry < ROTATION_TOLERANCE) && turn.determinant() > 0.0;
    if !is_rigid || rows[3] != [0.0, 0.0, 0.0, 1.0] {
        return Err("`camera_from_world` should be a rotation and a translation".to_owned());
    }
    let [fx, fy, cx, cy] = [*fx, *fy, *cx, *cy];
    let (near, filter) = (DEFAULT_NEAR, PixelFilter::default());
    let camera = Camera { width, height, fx, fy, cx, cy, camera_from_world: pose, near, filter };
    Ok(Keyframe { seconds: *seconds, time: *time, camera })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn view(azimuth: f32) -> Camera {
        let (s, c) = azimuth.sin_cos();
        Camera::look_at([4.0 * c, 4.0 * s, 1.0], [0.0; 3], 0.7, 100, 80)
    }

    #[test]
    fn a_path_meets_its_keyframes_and_stays_smooth_between_them() {
        let views = [view(0.0), view(0.4), view(0.8)];
        let path = CameraPath::through(&views).expect("a path");
        let cameras = path.spread(5);
        for (found, expected) in [(0, views[0]), (2, views[1]), (4, views[2])] {
            let (found_pose, pose) = (cameras[found].camera_from_world, expected.camera_from_world);
            assert!(found_pose.abs_diff_eq(pose, 1e-5), "keyframe {found}");
        }
        let (pixel, _) = cameras[1].pixel_from_world([0.0; 3]);
        assert!((pixel[0] - 50.0).abs() < 3.0 && (pixel[1] - 40.0).abs() < 3.0, "{pixel:?}");
        assert_eq!(CameraPath::through(&views[..1]).expect("one").spread(3)[2], views[0]);
    }

    fn file(change: impl Fn(&mut serde_json::Value)) -> Result<CameraPath> {
        let pose = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 4], [0, 0, 0, 1]];
        let key = |seconds: f32, time: f32| {
            serde_json::json!({ "seconds": seconds, "time": time, "camera_from_world": pose,
                                "fx": 90, "fy": 90, "cx": 50, "cy": 40 })
        };
        let mut value = serde_json::json!({
            "format": FORMAT, "width": 100, "height": 80, "keyframes": [key(0.0, 0.5), key(2.0, -0.5)],
        });
        change(&mut value);
        let dir = tempfile::tempdir().expect("a folder");
        let path = dir.path().join("path.json");
        std::fs::write(&path, value.to_string()).expect("written");
        CameraPath::read(&path)
    }

    #[test]
    fn a_film_has_the_times_of_its_keyframes() {
        let (times, cameras) = file(|_| {}).expect("a path").film(2).expect("a film");
        assert_eq!(times, [0.5, 0.25, 0.0, -0.25, -0.5]);
        assert_eq!((cameras.len(), cameras[0].width, cameras[4].height), (5, 100, 80));
    }

    #[test]
    fn faulty_files_are_refused_by_their_field() {
        type Change = fn(&mut serde_json::Value);
        let faults: [(&str, Change); 8] = [
            ("format", |v| v["format"] = "x".into()),
            ("1 to 8192", |v| v["width"] = 0.into()),
            ("keyframes", |v| v["keyframes"] = serde_json::json!([])),
            ("more than 0", |v| v["keyframes"][1]["seconds"] = 0.into()),
            ("fx", |v| v["keyframes"][0]["fx"] = (-1).into()),
            ("camera_from_world", |v| v["keyframes"][1]["camera_from_world"][0][0] = 2.into()),
            ("camera_from_world", |v| v["keyframes"][1]["camera_from_world"][3][0] = 1.into()),
            ("no camera path", |v| v["other"] = 1.into()),
        ];
        for (word, change) in faults {
            let error = file(change).expect_err(word).to_string();
            assert!(error.contains(word) && error.ends_with("path.json"), "{error}");
        }
        assert!(file(|v| v["keyframes"][1]["seconds"] = 1e9.into()).expect("long").film(25).is_err());
    }
}
