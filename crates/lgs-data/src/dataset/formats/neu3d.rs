//! Neural 3D Video and other "Plenoptic video" sets: `poses_bounds.npy` and, for each of its rows in order of
//! their names, a camera `camXX` as a folder of images or a video.
//!
//! A row has 17 numbers (LLFF): a 3×5 matrix by rows, whose columns are the camera's axes down, right and
//! backwards, its centre, and height, width and focal length in pixels; then the bounds of depth, which are
//! not used. Images may be smaller than that size, as they often are: intrinsics scale. The first camera is
//! in the split `test`, as in the publications, and all others are in `train`. Images of one number are of
//! one moment.

use super::reader::{FormatReader, Label};
use super::views::{Views, place_of};
use crate::dataset::error::{DatasetError, Problem};
use crate::dataset::frame_spec::{FrameSpec, Intrinsics, SizeRule};
use crate::dataset::{npy, poses, times};
use glam::{DMat3, DVec3, Mat4};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

const COLUMNS: usize = 17;

pub(super) struct Neu3d;

impl FormatReader for Neu3d {
    fn label(&self) -> Label {
        Label { name: "neu3d", marker: "`poses_bounds.npy` beside `cam00`" }
    }

    fn is_at(&self, root: &Path) -> bool {
        file_of(root).is_file() && !names(root).is_empty()
    }

    fn splits(&self, root: &Path) -> Result<Vec<String>, DatasetError> {
        let count = names(root).len();
        Ok(["train", "test"].iter().take(count.min(2)).map(|&split| split.to_owned()).collect())
    }

    fn split_file(&self, root: &Path, _: &str) -> PathBuf {
        file_of(root)
    }

    fn frames(&self, root: &Path, split: &str) -> Result<Vec<FrameSpec>, DatasetError> {
        let path = file_of(root);
        let wrong = |problem| DatasetError::new(&path, problem);
        let (names, table) = (names(root), npy::read(&path)?);
        if table.columns != COLUMNS || table.rows().len() != names.len() {
            let (rows, columns) = (table.rows().len(), table.columns);
            let expected = format!("{} rows of {COLUMNS}, one for each of {}", names.len(), names.join(", "));
            let reason = format!("expected {expected}; found {rows} rows of {columns}");
            return Err(wrong(Problem::Malformed(reason)));
        }
        let places: Vec<PathBuf> = names.iter().filter_map(|name| place_of(root, name)).collect();
        let views = Views::of(&places)?;
        let numbers: Vec<Option<u64>> = views.moments.iter().map(|&n| Some(n)).collect();
        let times: Vec<f64> = times::of_numbers(&numbers).into_iter().flatten().collect();
        let cameras = table.rows().zip(&names).map(|(row, name)| camera(row, name).map_err(wrong));
        let cameras = cameras.collect::<Result<Vec<_>, _>>()?;
        let is_wanted = |camera: usize| (camera == 0 && names.len() > 1) == (split == "test");
        let mut specs = Vec::new();
        for (&moment, time) in views.moments.iter().zip(times) {
            for (number, (camera_from_world, own)) in
                cameras.iter().enumerate().filter(|(i, _)| is_wanted(*i))
            {
                let image_path = views.image(number, moment);
                let file = image_path.file_name().unwrap_or_default().to_string_lossy().into_owned();
                specs.push(FrameSpec {
                    described_in: path.clone(),
                    index: specs.len(),
                    name: format!("{}/{file}", names[number]),
                    image_path,
                    view: Some(names[number].clone()),
                    time: time as f32,
                    camera_from_world: *camera_from_world,
                    own: *own,
                    size_rule: SizeRule::Scaled,
                    ..FrameSpec::default()
                });
            }
        }
        if specs.is_empty() { Err(wrong(Problem::Empty)) } else { Ok(specs) }
    }
}

fn file_of(root: &Path) -> PathBuf {
    root.join("poses_bounds.npy")
}

/// Names of the cameras: folders and videos whose names begin with `cam`.
fn names(root: &Path) -> Vec<String> {
    let entries = |folder: &str| std::fs::read_dir(root.join(folder)).into_iter().flatten().flatten();
    let all = ["", "images", "videos"].map(entries).into_iter().flatten();
    let stem = |path: PathBuf| path.file_stem().map(|name| name.to_string_lossy().into_owned());
    let names: BTreeSet<String> = all.filter_map(|entry| stem(entry.path())).collect();
    let is_camera = |name: &String| {
        name.strip_prefix("cam").is_some_and(|rest| rest.starts_with(|c: char| c.is_ascii_digit()))
    };
    names.into_iter().filter(is_camera).filter(|name| place_of(root, name).is_some()).collect()
}

/// Pose and intrinsics of a row.
fn camera(row: &[f64], name: &str) -> Result<(Mat4, Intrinsics), Problem> {
    let part = |field, (expected, found): poses::Wrong| Problem::Part {
        part: format!("camera `{name}`"),
        field,
        expected: expected.to_owned(),
        found,
    };
    let column = |c: usize| DVec3::new(row[c], row[5 + c], row[10 + c]);
    let [height, width, focal] = column(4).to_array();
    let world_from_camera = DMat3::from_cols(column(1), column(0), -column(2));
    let rotation = world_from_camera.transpose();
    let pose = poses::rigid(rotation, -(rotation * column(3))).map_err(|wrong| part("pose", wrong))?;
    for (field, value) in [("height", height), ("width", width), ("focal length", focal)] {
        if !(value.is_finite() && value > 0.0) {
            return Err(part(field, ("finite and above 0", value.to_string())));
        }
    }
    let intrinsics = Intrinsics::of([focal; 2], [0.5 * width, 0.5 * height], Some([width, height]));
    Ok((pose.as_mat4(), intrinsics))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dataset::DatasetFormat;
    use crate::dataset::testing::load;

    /// Cameras at x = 0, 1, 2 that look along +y, at 4 moments, with `edit` on the rows.
    fn folder(edit: impl FnOnce(&mut Vec<f64>)) -> tempfile::TempDir {
        let dir = tempfile::tempdir().unwrap();
        let mut rows = Vec::new();
        for camera in 0..3 {
            let folder = dir.path().join(format!("cam{camera:02}"));
            std::fs::create_dir(&folder).unwrap();
            for moment in 0..4 {
                let image = image::RgbImage::from_pixel(6, 4, image::Rgb([camera as u8, moment, 0]));
                image.save(folder.join(format!("{moment:04}.png"))).unwrap();
            }
            // Down is −z, right is +x, backwards is −y.
            rows.extend([0., 1., 0., f64::from(camera), 8., 0., 0., -1., -4., 12., -1., 0., 0., 0.5, 10.]);
            rows.extend([1.0, 9.0]);
        }
        edit(&mut rows);
        let bytes = npy::tests::npy([rows.len() / 17, 17], &rows);
        std::fs::write(dir.path().join("poses_bounds.npy"), bytes).unwrap();
        dir
    }

    #[test]
    fn cameras_moments_and_scaled_intrinsics_are_read() {
        let dir = folder(|_| {});
        assert_eq!(DatasetFormat::detect(dir.path()), Some(DatasetFormat::Neu3d));
        crate::dataset::import::tests::assert_round_trip(dir.path());
        let set = load(&dir).unwrap();
        assert_eq!((set.split("train").len(), set.split("test").len()), (8, 4));
        let frame = &set.split("train")[3];
        assert_eq!((frame.name.as_str(), frame.time), ("cam02/0001.png", 0.25));
        let camera = frame.camera;
        assert_eq!([camera.fx, camera.fy, camera.cx, camera.cy], [5.0, 5.0, 3.0, 2.0]);
        assert_eq!(camera.center_in_world(), [2.0, -4.0, 0.5]);
        assert_eq!(camera.ray_direction_in_world([3.0, 2.0]), [0.0, 1.0, 0.0]);
        assert!(camera.ray_direction_in_world([3.0, 0.0])[2] > 0.1, "up is +z");
    }

    #[test]
    fn rows_that_fit_no_camera_are_named() {
        let message = |edit: fn(&mut Vec<f64>)| load(&folder(edit)).unwrap_err().to_string();
        let found = message(|rows| rows.truncate(34));
        assert!(found.contains("3 rows") && found.contains("2 rows") && found.contains("cam02"), "{found}");
        assert!(message(|rows| rows[17] = f64::NAN).contains("camera `cam01`"));
        assert!(message(|rows| rows[1] = -1.0).contains("reflection"));
        assert!(message(|rows| rows[4] = 0.0).contains("`height`"));
    }
}
