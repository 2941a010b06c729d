//! OpenCV's file storage as EasyMocap lays it out: `intri.yml` with `K_NAME` and `dist_NAME`, `extri.yml`
//! with `Rot_NAME` (3×3) or `R_NAME` (Rodrigues) and `T_NAME`, camera-from-world.
//!
//! Of YAML only matrices are understood: `KEY: !!opencv-matrix`, then `data: [ numbers ]`.

use super::RigCamera;
use crate::dataset::error::{DatasetError, Problem};
use crate::dataset::frame_spec::Intrinsics;
use crate::dataset::lens::Lens;
use crate::dataset::poses;
use crate::files;
use glam::{DMat3, DVec3};
use std::collections::BTreeMap;
use std::path::Path;

type Matrices = BTreeMap<String, Vec<f64>>;

/// The file of poses beside that of intrinsics.
pub(super) const POSES: &str = "extri.yml";
/// The file of intrinsics.
pub(super) const INTRINSICS: &str = "intri.yml";

/// Reads both files, given the one of intrinsics.
pub(super) fn cameras(path: &Path) -> Result<Vec<RigCamera>, DatasetError> {
    let poses_path = path.with_file_name(POSES);
    let read = |path: &Path| {
        let text = String::from_utf8_lossy(&files::read_bytes(path)?).into_owned();
        matrices(&text).map_err(|reason| DatasetError::new(path, Problem::Malformed(reason)))
    };
    let (intrinsics, poses) = (read(path)?, read(&poses_path)?);
    let names: Vec<&str> = intrinsics.keys().filter_map(|key| key.strip_prefix("K_")).collect();
    if names.is_empty() {
        let reason = "expected matrices `K_NAME` of cameras".to_owned();
        return Err(DatasetError::new(path, Problem::Malformed(reason)));
    }
    let camera = |name: &str| {
        let (own, lens) = intrinsics_of(name, &intrinsics).map_err(|p| DatasetError::new(path, p))?;
        let pose = pose_of(name, &poses).map_err(|p| DatasetError::new(&poses_path, p))?;
        Ok(RigCamera { name: name.to_owned(), intrinsics: own, lens, camera_from_world: pose.as_mat4() })
    };
    names.into_iter().map(camera).collect()
}

fn wrong(name: &str, field: &'static str, expected: &str, found: String) -> Problem {
    Problem::Part { part: format!("camera `{name}`"), field, expected: expected.to_owned(), found }
}

fn intrinsics_of(name: &str, matrices: &Matrices) -> Result<(Intrinsics, Lens), Problem> {
    let matrix = matrices.get(&format!("K_{name}")).cloned().unwrap_or_default();
    let [fx, 0.0, cx, _, fy, cy, ..] = matrix[..] else {
        return Err(wrong(name, "K", "3 x 3 numbers without skew", format!("{matrix:?}")));
    };
    let found = matrices.get(&format!("dist_{name}")).cloned().unwrap_or_default();
    let lens = Lens::of_opencv(&found).ok_or_else(|| {
        wrong(name, "dist", "0, 1, 2, 4, 5 or 8 numbers", format!("{} numbers", found.len()))
    })?;
    lens.check(0, "dist")?;
    Ok((Intrinsics::of([fx, fy], [cx + 0.5, cy + 0.5], None), lens))
}

fn pose_of(name: &str, matrices: &Matrices) -> Result<glam::DMat4, Problem> {
    let of = |kind: &str| matrices.get(&format!("{kind}_{name}")).map(Vec::as_slice);
    let rotation = match (of("Rot"), of("R")) {
        (Some(&[a, b, c, d, e, f, g, h, i]), _) | (None, Some(&[a, b, c, d, e, f, g, h, i])) => {
            DMat3::from_cols_array(&[a, d, g, b, e, h, c, f, i])
        }
        (None, Some(&[x, y, z])) => poses::rotation_of_vector(DVec3::new(x, y, z)),
        _ => return Err(wrong(name, "Rot", "a 3 x 3 matrix, or `R` with 3 numbers", "neither".to_owned())),
    };
    let Some(&[x, y, z]) = of("T") else {
        return Err(wrong(name, "T", "3 numbers", "others or none".to_owned()));
    };
    let pose = poses::rigid(rotation, DVec3::new(x, y, z));
    pose.map_err(|(expected, found)| wrong(name, "Rot", expected, found))
}

/// All matrices of a file.
fn matrices(text: &str) -> Result<Matrices, String> {
    let mut found = Matrices::new();
    let mut rest = text;
    while let Some((before, after)) = rest.split_once("!!opencv-matrix") {
        let key = before.lines().last().unwrap_or_default().trim().trim_end_matches(':').trim_matches('"');
        let inside = || after.split_once("data:")?.1.trim_start().strip_prefix('[')?.split_once(']');
        let (data, next) = inside().ok_or_else(|| format!("matrix `{key}` has no `data: [ … ]`"))?;
        let number = |word: &str| match word.trim().parse::<f64>() {
            Ok(v) if v.is_finite() => Ok(v),
            _ => Err(format!("matrix `{key}`: expected a finite number, found `{}`", word.trim())),
        };
        let values = data.split(',').map(number).collect::<Result<Vec<f64>, String>>()?;
        found.insert(key.to_owned(), values);
        rest = next;
    }
    Ok(found)
}
