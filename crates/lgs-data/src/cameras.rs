//! `cameras.json` in the layout of the INRIA viewers: one object per view with id, image name, size, centre,
//! camera-to-world rotation (rows, OpenCV axes) and focal lengths.
//!
//! The principal point is written too (`cx`, `cy`); viewers that don't know the keys ignore them, and a file
//! without them means the image centre.

use crate::files::{self, FileError};
use crate::thresholds::ROTATION_TOLERANCE;
use glam::{Mat3, Mat4, Vec3};
use lgs_core::{Camera, DEFAULT_NEAR, PixelFilter};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// A camera list that cannot be read or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CamerasError {
    /// The file can't be read or written.
    #[error(transparent)]
    File(#[from] FileError),
    /// Not JSON, or a field is missing or of another type.
    #[error("malformed camera list: {reason}: {}", path.display())]
    Malformed {
        /// The file.
        path: PathBuf,
        /// The parser's message.
        reason: serde_json::Error,
    },
    /// A value that no camera has.
    #[error("camera {index}: `{field}` should be {expected}, found {found}: {}", path.display())]
    Value {
        /// The file.
        path: PathBuf,
        /// Number of the camera in the list.
        index: usize,
        /// The key.
        field: &'static str,
        /// The expectation.
        expected: &'static str,
        /// The value in the file.
        found: String,
    },
}

impl CamerasError {
    /// The file that the error is about.
    #[must_use]
    pub fn path(&self) -> &Path {
        match self {
            Self::File(error) => error.path(),
            Self::Malformed { path, .. } | Self::Value { path, .. } => path,
        }
    }
}

#[derive(Serialize, Deserialize)]
struct Entry {
    id: usize,
    img_name: String,
    width: u32,
    height: u32,
    position: [f32; 3],
    rotation: [[f32; 3]; 3],
    fy: f32,
    fx: f32,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    cx: Option<f32>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    cy: Option<f32>,
}

/// Writes named cameras; the folder must exist.
///
/// # Errors
/// If the file can't be written.
pub fn write_cameras_json(path: &Path, cameras: &[(String, Camera)]) -> Result<(), CamerasError> {
    let entries: Vec<Entry> =
        cameras.iter().enumerate().map(|(id, (name, camera))| entry(id, name, camera)).collect();
    files::write_atomically(path, |w| serde_json::to_writer(w, &entries).map_err(Into::into))?;
    Ok(())
}

/// Reads the cameras of a file with their image names, in file order.
///
/// # Errors
/// If the file can't be read, is malformed, or has a size, focal length or pose that can't be.
pub fn read_cameras_json(path: &Path) -> Result<Vec<(String, Camera)>, CamerasError> {
    let bytes = files::read_bytes(path)?;
    let entries: Vec<Entry> = serde_json::from_slice(&bytes)
        .map_err(|reason| CamerasError::Malformed { path: path.to_path_buf(), reason })?;
    entries.into_iter().enumerate().map(|(index, entry)| camera(path, index, entry)).collect()
}

fn entry(id: usize, name: &str, camera: &Camera) -> Entry {
    // The columns of camera-from-world are the rows of its transpose.
    let rows = Mat3::from_mat4(camera.camera_from_world).to_cols_array_2d();
    Entry {
        id,
        img_name: name.to_owned(),
        width: camera.width,
        height: camera.height,
        position: camera.center_in_world(),
        rotation: rows,
        fy: camera.fy,
        fx: camera.fx,
        cx: Some(camera.cx),
        cy: Some(camera.cy),
    }
}

fn camera(path: &Path, index: usize, entry: Entry) -> Result<(String, Camera), CamerasError> {
    entry.check().map_err(|(field, expected, found)| CamerasError::Value {
        path: path.to_path_buf(),
        index,
        field,
        expected,
        found,
    })?;
    let camera_from_world = Mat3::from_cols_array_2d(&entry.rotation);
    let translation = -(camera_from_world * Vec3::from(entry.position));
    let camera = Camera {
        width: entry.width,
        height: entry.height,
        fx: entry.fx,
        fy: entry.fy,
        cx: entry.cx.unwrap_or(0.5 * entry.width as f32),
        cy: entry.cy.unwrap_or(0.5 * entry.height as f32),
        camera_from_world: Mat4::from_cols(
            camera_from_world.x_axis.extend(0.0),
            camera_from_world.y_axis.extend(0.0),
            camera_from_world.z_axis.extend(0.0),
            translation.extend(1.0),
        ),
        near: DEFAULT_NEAR,
        filter: PixelFilter::default(),
    };
    Ok((entry.img_name, camera))
}

impl Entry {
    /// The first field that no camera has: its name, the expectation, the value.
    fn check(&self) -> Result<(), (&'static str, &'static str, String)> {
        for (field, size) in [("width", self.width), ("height", self.height)] {
            if size == 0 {
                return Err((field, "above 0", size.to_string()));
            }
        }
        for (field, focal) in [("fx", self.fx), ("fy", self.fy)] {
            if !(focal.is_finite() && focal > 0.0) {
                return Err((field, "finite and above 0", focal.to_string()));
            }
        }
        if !self.position.iter().all(|v| v.is_finite()) {
            return Err(("position", "finite", format!("{:?}", self.position)));
        }
        if !is_rotation(Mat3::from_cols_array_2d(&self.rotation)) {
            return Err(("rotation", "a rotation matrix", format!("{:?}", self.rotation)));
        }
        Ok(())
    }
}

/// Whether a matrix is a proper rotation, up to the rounding of values printed with a few digits.
pub(crate) fn is_rotation(m: Mat3) -> bool {
    (m * m.transpose()).abs_diff_eq(Mat3::IDENTITY, ROTATION_TOLERANCE) && m.determinant() > 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample() -> Vec<(String, Camera)> {
        let mut second = Camera::look_at([1.0, -3.0, 2.0], [0.1, 0.0, 0.3], 0.8, 64, 48);
        second.cx += 3.5;
        vec![
            ("train/r_0".into(), Camera::look_at([0.0, -4.0, 1.0], [0.0; 3], 0.7, 40, 30)),
            ("train/r_1".into(), second),
        ]
    }

    #[test]
    fn cameras_round_trip() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("cameras.json");
        write_cameras_json(&path, &sample()).unwrap();
        let back = read_cameras_json(&path).unwrap();
        for ((name, camera), (other_name, other)) in sample().iter().zip(&back) {
            assert_eq!(name, other_name);
            assert_eq!(
                (camera.width, camera.height, camera.fx, camera.cx),
                (other.width, other.height, other.fx, other.cx)
            );
            assert!(camera.camera_from_world.abs_diff_eq(other.camera_from_world, 1e-5));
        }
    }

    #[test]
    fn the_rotation_is_camera_to_world_by_rows() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("cameras.json");
        write_cameras_json(&path, &sample()).unwrap();
        let json: serde_json::Value = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
        // The first camera looks from y = −4, z = 1 at the origin: the third column (forward) is (0, 4,
        // −1)/√17.
        let forward: Vec<f64> = (0..3).map(|row| json[0]["rotation"][row][2].as_f64().unwrap()).collect();
        assert!(
            (forward[1] - 4.0 / 17f64.sqrt()).abs() < 1e-6 && (forward[2] + 1.0 / 17f64.sqrt()).abs() < 1e-6,
            "{forward:?}"
        );
    }

    #[test]
    fn bad_lists_are_named() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("cameras.json");
        let mut entries = serde_json::to_value([entry(0, "a", &sample()[0].1)]).unwrap();
        entries[0]["fx"] = 0.0.into();
        std::fs::write(&path, entries.to_string()).unwrap();
        let message = read_cameras_json(&path).unwrap_err().to_string();
        assert!(
            message.contains("camera 0") && message.contains("`fx`") && message.ends_with("cameras.json"),
            "{message}"
        );
        entries[0]["fx"] = 10.0.into();
        entries[0]["rotation"][0][0] = 3.0.into();
        std::fs::write(&path, entries.to_string()).unwrap();
        assert!(read_cameras_json(&path).unwrap_err().to_string().contains("`rotation`"));
        std::fs::write(&path, "[{]").unwrap();
        assert!(matches!(read_cameras_json(&path), Err(CamerasError::Malformed { .. })));
    }
}
