//! The JSON that D-NeRF, Blender and nerfstudio share: intrinsics of the file, and frames with a path, a pose
//! (camera-to-world, OpenGL axes) and perhaps a time and intrinsics of their own.

use super::error::{DatasetError, Problem};
use super::frame_spec::SizeRule;
use super::frame_spec::{FrameSpec, Intrinsics, given};
use super::lens::Lens;
use super::poses;
use crate::edit::MotionEdit;
use crate::files::{self, FileError};
use glam::{DMat3, DVec3};
use lgs_core::Camera;
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value, json};
use std::path::{Path, PathBuf};

#[derive(Deserialize)]
pub(super) struct TransformsFrame {
    pub(super) file_path: Option<String>,
    pub(super) mask_path: Option<String>,
    #[serde(default, deserialize_with = "given")]
    pub(super) time: Option<f64>,
    /// The camera's name, in sets that this program wrote.
    pub(super) camera: Option<String>,
    pub(super) transform_matrix: Option<Vec<Vec<Option<f64>>>>,
    #[serde(flatten)]
    pub(super) intrinsics: Intrinsics,
}

#[derive(Deserialize)]
pub(super) struct TransformsFile {
    #[serde(flatten)]
    pub(super) intrinsics: Intrinsics,
    #[serde(default)]
    pub(super) frames: Vec<TransformsFrame>,
}

/// Reads a file as it is; its values are not checked.
pub(super) fn read<T: DeserializeOwned>(path: &Path) -> Result<T, DatasetError> {
    parse(&files::read_bytes(path)?).map_err(|error| DatasetError::new(path, Problem::Json(error)))
}

/// Writes the file of a split, with the edit that the split shows, if it shows one.
pub(crate) fn write_split(
    folder: &Path,
    (split, edit): (&str, Option<MotionEdit>),
    mut file: Map<String, Value>,
) -> Result<(), FileError> {
    if let Some(edit) = edit {
        file.insert("edit".to_owned(), json!(edit));
    }
    files::write_atomically(&folder.join(format!("transforms_{split}.json")), |w| {
        serde_json::to_writer(w, &file).map_err(Into::into)
    })
}

impl TransformsFile {
    /// Whether some frame has a time.
    pub(super) fn has_times(&self) -> bool {
        self.frames.iter().any(|frame| frame.time.is_some())
    }

    /// Gives every frame the time 0: the file of a still scene has no times.
    pub(super) fn stand_still(&mut self) {
        self.frames.iter_mut().for_each(|frame| frame.time = Some(0.0));
    }

    /// The checked frames of the file at `path`; there must be one.
    pub(super) fn specs(self, root: &Path, path: &Path) -> Result<Vec<FrameSpec>, DatasetError> {
        let wrong = |problem| DatasetError::new(path, problem);
        if self.frames.is_empty() {
            return Err(wrong(Problem::Empty));
        }
        let shared = self.intrinsics;
        let spec = |(index, frame): (usize, TransformsFrame)| {
            let spec = frame.spec(root, path, index).map_err(wrong)?;
            Ok(FrameSpec { shared, ..spec })
        };
        self.frames.into_iter().enumerate().map(spec).collect()
    }
}

impl TransformsFrame {
    fn spec(self, root: &Path, described_in: &Path, index: usize) -> Result<FrameSpec, Problem> {
        let missing = |field| Problem::Missing { frame: index, field };
        let wrong = |field, expected, found| Problem::Value { frame: index, field, expected, found };
        let file_path = self.file_path.ok_or_else(|| missing("file_path"))?;
        let time = self.time.ok_or_else(|| missing("time"))? as f32;
        if !time.is_finite() {
            return Err(wrong("time", "finite", time.to_string()));
        }
        let matrix = self.transform_matrix.ok_or_else(|| missing("transform_matrix"))?;
        let pose = pose(&matrix).map_err(|(expected, found)| wrong("transform_matrix", expected, found))?;
        Ok(FrameSpec {
            described_in: described_in.to_path_buf(),
            index,
            image_path: image_path(root, &file_path),
            mask_path: self.mask_path.map(|path| root.join(path)),
            name: file_path.trim_start_matches("./").to_owned(),
            view: self.camera,
            time,
            camera_from_world: Camera::camera_from_world_of_opengl(pose),
            own: self.intrinsics,
            shared: Intrinsics::default(),
            lens: Lens::Pinhole,
            size_rule: SizeRule::Exact,
        })
    }
}

/// Python writes `NaN` and `Infinity`, which JSON does not have. They become `null`, so that the frame that
/// holds them can be named.
fn parse<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, serde_json::Error> {
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

/// `.png` is understood where the path has no image extension; a dot elsewhere (`r_0.25`) is part of the
/// name.
pub(super) fn image_path(root: &Path, file_path: &str) -> PathBuf {
    const EXTENSIONS: [&str; 3] = ["png", "jpg", "jpeg"];
    let extension = Path::new(file_path).extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase);
    let file_path = file_path.trim_start_matches("./");
    match extension {
        Some(e) if EXTENSIONS.contains(&e.as_str()) => root.join(file_path),
        _ => root.join(format!("{file_path}.png")),
    }
}

/// A finite, rigid 4×4 (or 3×4) matrix; otherwise what was expected and found.
fn pose(matrix: &[Vec<Option<f64>>]) -> Result<[[f32; 4]; 4], poses::Wrong> {
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
    let rows = [0, 1, 2].map(|i| DVec3::from_array([0, 1, 2].map(|j| f64::from(pose[i][j]))));
    poses::rigid(DMat3::from_cols(rows[0], rows[1], rows[2]).transpose(), DVec3::ZERO)?;
    Ok(pose)
}
