//! The nerfstudio layout: one `transforms.json` for all images.
//!
//! Cameras are pinholes. `camera_model` may be absent, `OPENCV` or `PINHOLE`, and every distortion
//! coefficient of the file and of its frames must be zero; images with distortion have to be undistorted
//! first.
//!
//! The time of an image is its `time`, which must then be there for every image. If no image has one, it is
//! the last number in the file's name without extension: with numbers from `a` to `b`, the image of number
//! `n` has the time (n − a) / (b − a + 1), so that the sequence spans [0, 1). Images of several cameras with
//! the same number share a time.
//!
//! Splits are the lists `train_filenames`, `val_filenames` and `test_filenames` where the file has a
//! `train_filenames`. Otherwise every eighth image, beginning with the first, is in `val`, as is usual for
//! static captures, the others are in `train`, and there is no `test`; fewer than eight images are all in
//! `train`.

use super::reader::FormatReader;
use crate::dataset::error::{DatasetError, Problem};
use crate::dataset::frame_spec::FrameSpec;
use crate::dataset::transforms::{self, TransformsFile, TransformsFrame};
use crate::names::{last_number, time_of_number};
use crate::thresholds::VALIDATION_STEP;
use serde::Deserialize;
use serde_json::{Map, Value};
use std::path::{Path, PathBuf};

const CAMERA_MODELS: [&str; 2] = ["OPENCV", "PINHOLE"];

const DISTORTION: [&str; 6] = ["k1", "k2", "k3", "k4", "p1", "p2"];

pub(super) struct Nerfstudio;

/// The keys of the file that only this format has.
#[derive(Deserialize)]
struct Layout {
    train_filenames: Option<Vec<String>>,
    val_filenames: Option<Vec<String>>,
    test_filenames: Option<Vec<String>>,
    ply_file_path: Option<String>,
    #[serde(default)]
    frames: Vec<Map<String, Value>>,
    #[serde(flatten)]
    camera: Map<String, Value>,
}

impl FormatReader for Nerfstudio {
    fn name(&self) -> &'static str {
        "nerfstudio"
    }

    fn marker(&self) -> &'static str {
        "`transforms.json`"
    }

    fn is_at(&self, root: &Path) -> bool {
        file_of(root).is_file()
    }

    fn splits(&self, root: &Path) -> Result<Vec<String>, DatasetError> {
        let path = file_of(root);
        let (layout, file) = (transforms::read::<Layout>(&path)?, transforms::read::<TransformsFile>(&path)?);
        let holds = |split: &&str| {
            file.frames.iter().enumerate().any(|(i, f)| layout.split(i, f, &file) == Some(split))
        };
        Ok(["train", "val", "test"]
            .iter()
            .filter(|split| holds(split))
            .map(|&name| name.to_owned())
            .collect())
    }

    fn split_file(&self, root: &Path, _: &str) -> PathBuf {
        file_of(root)
    }

    fn frames(&self, root: &Path, split: &str) -> Result<Vec<FrameSpec>, DatasetError> {
        let path = file_of(root);
        let (layout, mut file) =
            (transforms::read::<Layout>(&path)?, transforms::read::<TransformsFile>(&path)?);
        layout.check_cameras().map_err(|problem| DatasetError::new(&path, problem))?;
        let chosen: Vec<bool> =
            file.frames.iter().enumerate().map(|(i, f)| layout.split(i, f, &file) == Some(split)).collect();
        set_times(&mut file.frames);
        let specs = file.specs(root, &path)?;
        let specs: Vec<FrameSpec> =
            specs.into_iter().zip(chosen).filter_map(|(s, c)| c.then_some(s)).collect();
        if specs.is_empty() {
            Err(DatasetError::new(&path, Problem::NoSplit(split.to_owned())))
        } else {
            Ok(specs)
        }
    }

    fn points_file(&self, root: &Path) -> Result<Option<PathBuf>, DatasetError> {
        let layout: Layout = transforms::read(&file_of(root))?;
        Ok(layout.ply_file_path.map(|name| root.join(name)))
    }
}

fn file_of(root: &Path) -> PathBuf {
    root.join("transforms.json")
}

impl Layout {
    /// The split of a frame; nothing if the file lists its splits and the frame is in none of them.
    fn split(&self, index: usize, frame: &TransformsFrame, file: &TransformsFile) -> Option<&'static str> {
        let Some(train) = &self.train_filenames else {
            let held_out = file.frames.len() >= VALIDATION_STEP && index.is_multiple_of(VALIDATION_STEP);
            return Some(if held_out { "val" } else { "train" });
        };
        let lists = [
            ("train", Some(train)),
            ("val", self.val_filenames.as_ref()),
            ("test", self.test_filenames.as_ref()),
        ];
        let bare = |name: &str| name.trim_start_matches("./").to_owned();
        let name = bare(frame.file_path.as_deref()?);
        let holds = |list: Option<&Vec<String>>| {
            list.is_some_and(|list| list.iter().any(|other| bare(other) == name))
        };
        lists.into_iter().find(|&(_, list)| holds(list)).map(|(split, _)| split)
    }

    /// Refuses cameras that are not pinholes, in the file or in a frame.
    fn check_cameras(&self) -> Result<(), Problem> {
        for (frame, keys) in self.frames.iter().enumerate() {
            let value = |field| keys.get(field).or_else(|| self.camera.get(field));
            if let Some(model) = value("camera_model")
                && !model.as_str().is_some_and(|name| CAMERA_MODELS.contains(&name))
            {
                let (field, expected) = ("camera_model", "`OPENCV` or `PINHOLE`");
                return Err(Problem::Value { frame, field, expected, found: model.to_string() });
            }
            for field in DISTORTION {
                let found = value(field).filter(|v| v.as_f64() != Some(0.0));
                if let Some(found) = found.map(ToString::to_string) {
                    let expected = "0, because distorted images are not supported: undistort them first";
                    return Err(Problem::Value { frame, field, expected, found });
                }
            }
        }
        Ok(())
    }
}

/// Gives every frame a time by the number in its file's name, unless some frame has a `time`.
fn set_times(frames: &mut [TransformsFrame]) {
    if frames.iter().any(|frame| frame.time.is_some()) {
        return;
    }
    let numbers: Vec<Option<u64>> =
        frames.iter().map(|frame| Some(last_number(frame.file_path.as_deref()?)?.1)).collect();
    let (first, last) = numbers.iter().flatten().fold((u64::MAX, 0), |(a, b), &n| (a.min(n), b.max(n)));
    for (frame, number) in frames.iter_mut().zip(numbers) {
        frame.time = number.map(|number| time_of_number(number, first, last));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dataset::{Dataset, DatasetFormat, LoadOptions};
    use crate::ply::Points;
    use crate::testing::write_points;
    use serde_json::json;

    /// A set of `count` images from two cameras, whose JSON `edit` may change.
    fn folder(count: usize, edit: impl FnOnce(&mut Value)) -> tempfile::TempDir {
        let dir = tempfile::tempdir().unwrap();
        let frame = |i: usize| {
            let name = format!("cam{}_{:04}.png", i % 2, 10 + i / 2);
            image::RgbImage::from_pixel(6, 4, image::Rgb([i as u8; 3])).save(dir.path().join(&name)).unwrap();
            let side = (i % 2) as f64;
            let pose =
                [[1.0, 0.0, 0.0, side], [0.0, 0.0, -1.0, -4.0], [0.0, 1.0, 0.0, 0.5], [0.0, 0.0, 0.0, 1.0]];
            json!({ "file_path": name, "transform_matrix": pose })
        };
        let frames: Vec<Value> = (0..count).map(frame).collect();
        let mut file = json!({ "camera_model": "OPENCV", "fl_x": 5.0, "fl_y": 5.5, "cx": 3.0, "cy": 2.0,
            "w": 6, "h": 4, "k1": 0.0, "p2": 0, "frames": frames });
        edit(&mut file);
        std::fs::write(dir.path().join("transforms.json"), file.to_string()).unwrap();
        dir
    }

    fn load(dir: &tempfile::TempDir) -> Result<Dataset, DatasetError> {
        Dataset::load(dir.path(), &LoadOptions::default(), &|_, _| {})
    }

    fn refusal(edit: impl FnOnce(&mut Value)) -> String {
        let message = load(&folder(4, edit)).unwrap_err().to_string();
        assert!(message.ends_with("transforms.json"), "{message}");
        message
    }

    #[test]
    fn every_eighth_image_is_held_out_and_numbers_in_names_are_times() {
        let dir = folder(16, |_| {});
        assert_eq!(DatasetFormat::detect(dir.path()), Some(DatasetFormat::Nerfstudio));
        let set = load(&dir).unwrap();
        assert_eq!(set.splits.keys().collect::<Vec<_>>(), ["train", "val"]);
        let times = |split: &str| set.split(split).iter().map(|f| f.time).collect::<Vec<_>>();
        assert_eq!(times("val"), [0.0, 0.5]);
        assert_eq!(times("train")[..4], [0.0, 0.125, 0.125, 0.25], "two images per time");
        assert_eq!(set.cameras("train").len(), 2);
        let camera = set.split("val")[0].camera;
        assert_eq!([camera.fx, camera.fy, camera.cx, camera.cy], [5.0, 5.5, 3.0, 2.0]);
        assert_eq!(camera.center_in_world(), [0.0, -4.0, 0.5]);
    }

    #[test]
    fn listed_splits_given_times_own_intrinsics_and_points_are_read() {
        let dir = folder(4, |json| {
            json["train_filenames"] = json!(["cam0_0010.png", "./cam1_0011.png"]);
            json["test_filenames"] = json!(["cam0_0011.png"]);
            json["ply_file_path"] = "sparse.ply".into();
            json["frames"][3]["fl_x"] = 7.0.into();
            (0..4).for_each(|i| json["frames"][i]["time"] = (0.2 * i as f64).into());
        });
        let points = Points { positions: vec![[1.0, 2.0, 3.0]], colors: vec![[1.0, 0.0, 0.4]] };
        write_points(&dir.path().join("sparse.ply"), &points).unwrap();
        let set = load(&dir).unwrap();
        assert_eq!(set.init_points, Some(points));
        assert_eq!(set.splits.keys().collect::<Vec<_>>(), ["test", "train"]);
        let train: Vec<_> = set.split("train").iter().map(|f| (f.time, f.camera.fx)).collect();
        assert_eq!(train, [(0.0, 5.0), (0.6, 7.0)]);
        assert_eq!(set.split("test")[0].name, "cam0_0011.png");
    }

    #[test]
    fn cameras_that_are_no_pinholes_are_refused() {
        let message = refusal(|json| json["k1"] = 0.03.into());
        assert!(message.contains("`k1`") && message.contains("undistort"), "{message}");
        let message = refusal(|json| json["frames"][2]["p1"] = 0.01.into());
        assert!(message.contains("frame 2") && message.contains("`p1`"), "{message}");
        let message = refusal(|json| json["camera_model"] = "OPENCV_FISHEYE".into());
        assert!(message.contains("`camera_model`") && message.contains("OPENCV_FISHEYE"), "{message}");
    }

    #[test]
    fn frames_without_a_time_or_with_a_mask_are_named() {
        assert!(
            refusal(|json| json["frames"][1]["time"] = 0.5.into()).contains("frame 0: missing field `time`")
        );
        assert!(refusal(|json| json["frames"][1]["file_path"] = "still.png".into()).contains("frame 1"));
        assert!(refusal(|json| json["frames"][1]["mask_path"] = "m.png".into()).contains("`mask_path`"));
        assert!(refusal(|json| json["frames"] = json!([])).contains("`train`"));
    }
}
