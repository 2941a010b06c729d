//! `transforms_<split>.json`: which splits a folder has, and the checked frames of each.

use super::{DatasetError, Problem};
use crate::cameras::is_rotation;
use crate::files::{self, FileError};
use glam::Mat3;
use lgs_core::{Camera, DEFAULT_NEAR};
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// The intrinsics that a file or a frame may carry.
#[derive(Clone, Copy, Default, Deserialize)]
struct Intrinsics {
    camera_angle_x: Option<f64>,
    fl_x: Option<f64>,
    fl_y: Option<f64>,
    cx: Option<f64>,
    cy: Option<f64>,
    w: Option<f64>,
    h: Option<f64>,
}

#[derive(Deserialize)]
struct RawFrame {
    file_path: Option<String>,
    time: Option<f64>,
    transform_matrix: Option<Vec<Vec<Option<f64>>>>,
    #[serde(flatten)]
    intrinsics: Intrinsics,
}

#[derive(Deserialize)]
struct RawFile {
    #[serde(flatten)]
    intrinsics: Intrinsics,
    #[serde(default)]
    frames: Vec<RawFrame>,
}

/// A frame of the JSON, checked except for what needs the image.
pub(super) struct FrameSpec {
    json_path: PathBuf,
    index: usize,
    pub(super) name: String,
    pub(super) image_path: PathBuf,
    pub(super) time: f32,
    camera_from_world: glam::Mat4,
    own: Intrinsics,
    shared: Intrinsics,
}

/// Split names with their files: `train` first, then by name.
pub(super) fn split_files(
    root: &Path,
    wanted: Option<&[String]>,
) -> Result<Vec<(String, PathBuf)>, DatasetError> {
    if !root.is_dir() {
        return Err(DatasetError::new(root, Problem::NoFolder));
    }
    let mut names: Vec<String> = match wanted {
        Some(names) => names.to_vec(),
        None => found_splits(root)?,
    };
    if wanted.is_none() && !names.iter().any(|name| name == "train") {
        names.push("train".into());
    }
    names.sort_by_key(|name| (name != "train", name.clone()));
    names.dedup();
    let with_path = |name: String| {
        let path = root.join(format!("transforms_{name}.json"));
        if path.is_file() { Ok((name, path)) } else { Err(DatasetError::new(&path, Problem::NoSplit(name))) }
    };
    names.into_iter().map(with_path).collect()
}

/// Every split of a folder with its file.
pub(super) fn all_split_files(root: &Path) -> Result<Vec<(String, PathBuf)>, DatasetError> {
    split_files(root, Some(&found_splits(root)?))
}

/// Names `x` of the files `transforms_x.json` in a folder, sorted.
fn found_splits(root: &Path) -> Result<Vec<String>, FileError> {
    let unreadable = |reason| FileError::new("list folder", root, reason);
    let mut names = Vec::new();
    for entry in std::fs::read_dir(root).map_err(unreadable)? {
        let name = entry.map_err(unreadable)?.file_name();
        if let Some(split) =
            name.to_str().and_then(|n| n.strip_prefix("transforms_")).and_then(|n| n.strip_suffix(".json"))
        {
            names.push(split.to_owned());
        }
    }
    names.sort();
    Ok(names)
}

/// The frames of a split file.
pub(super) fn read(root: &Path, path: &Path) -> Result<Vec<FrameSpec>, DatasetError> {
    let wrong = |problem| DatasetError::new(path, problem);
    let bytes = files::read_bytes(path)?;
    let file: RawFile = parse(&bytes).map_err(|e| wrong(Problem::Json(e)))?;
    if file.frames.is_empty() {
        return Err(wrong(Problem::Empty));
    }
    let shared = file.intrinsics;
    let spec = |(index, frame)| FrameSpec::new(root, path, index, frame, shared).map_err(wrong);
    file.frames.into_iter().enumerate().map(spec).collect()
}

/// Python writes `NaN` and `Infinity`, which JSON does not have. They become `null`, so that the frame that
/// holds them can be named.
fn parse(bytes: &[u8]) -> Result<RawFile, serde_json::Error> {
    match serde_json::from_slice(bytes) {
        Err(error) if error.is_syntax() => {
            serde_json::from_slice(&with_null_for_non_finite(bytes)).map_err(|_| error)
        }
        other => other,
    }
}

fn with_null_for_non_finite(bytes: &[u8]) -> Vec<u8> {
    let (mut out, mut at, mut in_string) = (Vec::with_capacity(bytes.len()), 0, false);
    while at < bytes.len() {
        let token = ["NaN", "-NaN", "Infinity", "-Infinity"]
            .into_iter()
            .find(|t| !in_string && bytes[at..].starts_with(t.as_bytes()));
        if let Some(token) = token {
            out.extend(b"null");
            at += token.len();
            continue;
        }
        let escaped = in_string && bytes[at] == b'\\' && at + 1 < bytes.len();
        in_string ^= bytes[at] == b'"';
        let taken = if escaped { 2 } else { 1 };
        out.extend(&bytes[at..at + taken]);
        at += taken;
    }
    out
}

impl FrameSpec {
    fn new(
        root: &Path,
        json_path: &Path,
        index: usize,
        frame: RawFrame,
        shared: Intrinsics,
    ) -> Result<Self, Problem> {
        let missing = |field| Problem::Missing { frame: index, field };
        let file_path = frame.file_path.ok_or_else(|| missing("file_path"))?;
        let time = frame.time.ok_or_else(|| missing("time"))? as f32;
        if !time.is_finite() {
            return Err(Problem::Value {
                frame: index,
                field: "time",
                expected: "finite",
                found: time.to_string(),
            });
        }
        let matrix = frame.transform_matrix.ok_or_else(|| missing("transform_matrix"))?;
        let pose = pose(&matrix).map_err(|(expected, found)| Problem::Value {
            frame: index,
            field: "transform_matrix",
            expected,
            found,
        })?;
        Ok(Self {
            json_path: json_path.to_path_buf(),
            index,
            image_path: image_path(root, &file_path),
            name: file_path.trim_start_matches("./").to_owned(),
            time,
            camera_from_world: Camera::camera_from_world_of_opengl(pose),
            own: frame.intrinsics,
            shared,
        })
    }

    /// The camera, given the size of the decoded image.
    pub(super) fn camera(&self, width: u32, height: u32) -> Result<Camera, DatasetError> {
        self.checked_camera(width, height).map_err(|problem| DatasetError::new(&self.json_path, problem))
    }

    fn checked_camera(&self, width: u32, height: u32) -> Result<Camera, Problem> {
        let frame = self.index;
        let size = [(self.own.w.or(self.shared.w), width), (self.own.h.or(self.shared.h), height)];
        if size.iter().any(|&(said, is)| said.is_some_and(|said| said != f64::from(is))) {
            let said = size.map(|(said, is)| said.unwrap_or(f64::from(is)));
            return Err(Problem::Size {
                frame,
                expected: format!("{} x {}", said[0], said[1]),
                found: format!("{width} x {height}"),
            });
        }
        let from_angle = |angle: f64| 0.5 * f64::from(width) / (0.5 * angle).tan();
        let focal_x = |i: &Intrinsics| i.fl_x.or(i.camera_angle_x.map(from_angle));
        let fx = focal_x(&self.own)
            .or(focal_x(&self.shared))
            .ok_or(Problem::Missing { frame, field: "fl_x` or `camera_angle_x" })?;
        // Pixels are square unless the same level says otherwise: a frame's own fl_x is not paired with the
        // file's fl_y.
        let fy = self.own.fl_y.or(focal_x(&self.own)).or(self.shared.fl_y).unwrap_or(fx);
        let cx = self.own.cx.or(self.shared.cx).unwrap_or(0.5 * f64::from(width));
        let cy = self.own.cy.or(self.shared.cy).unwrap_or(0.5 * f64::from(height));
        let [fx, fy, cx, cy] = [fx, fy, cx, cy].map(|v| v as f32);
        for (field, value, least) in [
            ("fl_x", fx, 0.0),
            ("fl_y", fy, 0.0),
            ("cx", cx, f32::NEG_INFINITY),
            ("cy", cy, f32::NEG_INFINITY),
        ] {
            if !(value.is_finite() && value > least) {
                let expected = if least == 0.0 { "finite and above 0" } else { "finite" };
                return Err(Problem::Value { frame, field, expected, found: value.to_string() });
            }
        }
        Ok(Camera {
            width,
            height,
            fx,
            fy,
            cx,
            cy,
            camera_from_world: self.camera_from_world,
            near: DEFAULT_NEAR,
        })
    }
}

/// `.png` is understood where the path has no image extension; a dot elsewhere (`r_0.25`) is part of the
/// name.
fn image_path(root: &Path, file_path: &str) -> PathBuf {
    const EXTENSIONS: [&str; 3] = ["png", "jpg", "jpeg"];
    let extension = Path::new(file_path).extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase);
    let file_path = file_path.trim_start_matches("./");
    match extension {
        Some(e) if EXTENSIONS.contains(&e.as_str()) => root.join(file_path),
        _ => root.join(format!("{file_path}.png")),
    }
}

/// A finite, rigid 4×4 (or 3×4) matrix; otherwise what was expected and found.
fn pose(matrix: &[Vec<Option<f64>>]) -> Result<[[f32; 4]; 4], (&'static str, String)> {
    if !(3..=4).contains(&matrix.len()) || matrix.iter().any(|row| row.len() != 4) {
        let widths: Vec<usize> = matrix.iter().map(Vec::len).collect();
        return Err(("a 4 x 4 matrix", format!("rows of {widths:?} values")));
    }
    let mut pose = [[0.0, 0.0, 0.0, 1.0]; 4];
    for (i, (row, values)) in pose.iter_mut().zip(matrix).enumerate() {
        for (j, (slot, value)) in row.iter_mut().zip(values).enumerate() {
            *slot = value.map_or(f32::NAN, |v| v as f32);
            if !slot.is_finite() {
                return Err(("finite", format!("{slot} in row {i}, column {j}")));
            }
        }
    }
    let rotation: [[f32; 3]; 3] = std::array::from_fn(|i| [pose[i][0], pose[i][1], pose[i][2]]);
    if is_rotation(Mat3::from_cols_array_2d(&rotation)) {
        Ok(pose)
    } else {
        Err(("a rigid pose", format!("the rotation part {rotation:?}")))
    }
}
