//! The nerfstudio layout: one `transforms.json` for all images.
//!
//! `camera_model` may be absent, `OPENCV`, `PINHOLE`, `SIMPLE_PINHOLE` or `OPENCV_FISHEYE`, in the file or in
//! a frame; coefficients k1 … k4, p1 and p2 may stand in either too, and those of a frame win. Images are
//! undistorted when they are loaded. A frame's `mask_path` names an image whose black pixels are left out.
//!
//! The time of an image is its `time`, which must then be there for every image. If no image has one, it is
//! the last number in the file's name without extension: with numbers from `a` to `b`, the image of number
//! `n` has the time (n − a) / (b − a + 1), so that the sequence spans [0, 1). Images of several cameras with
//! the same number share a time. If no name has a number either, the scene is still: all images are at time
//! 0.
//!
//! Splits are the lists `train_filenames`, `val_filenames` and `test_filenames` where the file has a
//! `train_filenames`. Otherwise every eighth image, beginning with the first, is in `val`, as is usual for
//! static captures, the others are in `train`, and there is no `test`; fewer than eight images are all in
//! `train`.

use super::reader::{FormatReader, Label, points_of};
use crate::dataset::error::{DatasetError, Problem};
use crate::dataset::frame_spec::FrameSpec;
use crate::dataset::lens::Lens;
use crate::dataset::times;
use crate::dataset::transforms::{self, TransformsFile, TransformsFrame};
use crate::ply::Points;
use crate::thresholds::VALIDATION_STEP;
use serde::Deserialize;
use serde_json::{Map, Value};
use std::path::{Path, PathBuf};

const PERSPECTIVE: [&str; 3] = ["OPENCV", "PINHOLE", "SIMPLE_PINHOLE"];
const FISHEYE: &str = "OPENCV_FISHEYE";

const DISTORTION: [&str; 6] = ["k1", "k2", "p1", "p2", "k3", "k4"];

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
    fn label(&self) -> Label {
        Label { name: "nerfstudio", marker: "`transforms.json`" }
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
        let wrong = |problem| DatasetError::new(&path, problem);
        let lenses =
            (0..file.frames.len()).map(|i| layout.lens(i).map_err(wrong)).collect::<Result<Vec<_>, _>>()?;
        let chosen: Vec<bool> =
            file.frames.iter().enumerate().map(|(i, f)| layout.split(i, f, &file) == Some(split)).collect();
        set_times(&mut file.frames);
        let specs = file.specs(root, &path)?;
        let specs = specs.into_iter().zip(lenses).map(|(spec, lens)| FrameSpec { lens, ..spec });
        let specs: Vec<FrameSpec> = specs.zip(chosen).filter_map(|(s, c)| c.then_some(s)).collect();
        if specs.is_empty() {
            Err(DatasetError::new(&path, Problem::NoSplit(split.to_owned())))
        } else {
            Ok(specs)
        }
    }

    fn points(&self, root: &Path) -> Result<Option<Points>, DatasetError> {
        let layout: Layout = transforms::read(&file_of(root))?;
        points_of(layout.ply_file_path.map(|name| root.join(name)))
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

    /// The lens of a frame, by the keys of the frame, else of the file.
    fn lens(&self, frame: usize) -> Result<Lens, Problem> {
        let value = |field| self.frames[frame].get(field).or_else(|| self.camera.get(field));
        let mut k = [0.0; 6];
        for (slot, field) in k.iter_mut().zip(DISTORTION) {
            let number = |found: &Value| {
                let wrong =
                    || Problem::Value { frame, field, expected: "a number", found: found.to_string() };
                found.as_f64().ok_or_else(wrong)
            };
            *slot = value(field).map(number).transpose()?.unwrap_or(0.0);
        }
        let lens = match value("camera_model").map(|model| (model, model.as_str().unwrap_or_default())) {
            Some((_, FISHEYE)) => Lens::Fisheye([k[0], k[1], k[4], k[5]]),
            Some((found, name)) if !PERSPECTIVE.contains(&name) => {
                let expected = "`OPENCV`, `OPENCV_FISHEYE`, `PINHOLE` or `SIMPLE_PINHOLE`";
                let found = found.to_string();
                return Err(Problem::Value { frame, field: "camera_model", expected, found });
            }
            // nerfstudio's own k4 of a perspective camera is the next power of r², which OpenCV lacks.
            _ if k[5] != 0.0 => {
                let expected = "0 for a perspective camera";
                return Err(Problem::Value { frame, field: "k4", expected, found: k[5].to_string() });
            }
            _ => Lens::radial([k[0], k[1], k[4], 0.0, 0.0, 0.0], [k[2], k[3]]),
        };
        lens.check(frame, "k1` … `p2")?;
        Ok(lens)
    }
}

/// Gives every frame a time by the number in its file's name, unless some frame has a `time`.
fn set_times(frames: &mut [TransformsFrame]) {
    if frames.iter().any(|frame| frame.time.is_some()) {
        return;
    }
    let number = |frame: &TransformsFrame| frame.file_path.as_deref().and_then(times::last_number);
    let numbers: Vec<Option<u64>> = frames.iter().map(number).collect();
    if numbers.iter().all(Option::is_none) {
        frames.iter_mut().for_each(|frame| frame.time = Some(0.0));
        return;
    }
    let found = times::of_numbers(&numbers);
    frames.iter_mut().zip(found).for_each(|(frame, time)| frame.time = time);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dataset::testing::load;
    use crate::dataset::{Dataset, DatasetFormat, LoadOptions};
    use crate::ply::Points;
    use crate::ply::write_points;
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
    fn lenses_are_taken_out_and_others_refused() {
        let dir = folder(4, |json| {
            json["k1"] = 0.3.into();
            json["frames"][2]["camera_model"] = "OPENCV_FISHEYE".into();
        });
        crate::dataset::import::tests::assert_round_trip(dir.path());
        let set = load(&dir).unwrap();
        let masked =
            |i: usize| set.split("train")[i].weights().map_or(0, |w| w.iter().filter(|w| **w == 0.0).count());
        assert!(masked(0) > 0, "pincushions leave the image");
        assert!(set.split("train")[0].pixels.has_mask() && !set.split("train")[0].has_alpha());
        assert_eq!(set.split("train")[0].picture().rgba[4 * 14..][..3], [0; 3]);
        let message = refusal(|json| json["camera_model"] = "EQUIRECTANGULAR".into());
        assert!(message.contains("`camera_model`") && message.contains("EQUIRECTANGULAR"), "{message}");
        let message = refusal(|json| json["frames"][2]["k2"] = "x".into());
        assert!(message.contains("frame 2") && message.contains("`k2`"), "{message}");
        assert!(refusal(|json| json["k1"] = 1e9.into()).contains("`k1`"));
    }

    #[test]
    fn masks_are_read_and_have_the_size_of_their_image() {
        let dir = folder(4, |json| json["frames"][1]["mask_path"] = "m.png".into());
        let write = |w, h| {
            let black = |x, _| image::Luma([if x == 2 { 0 } else { 200 }]);
            image::GrayImage::from_fn(w, h, black).save(dir.path().join("m.png")).unwrap();
        };
        write(6, 4);
        let set = load(&dir).unwrap();
        assert_eq!(set.split("train")[1].weights().unwrap()[..6], [1.0, 1.0, 0.0, 1.0, 1.0, 1.0]);
        assert_eq!(set.split("train")[0].weights(), None);
        let half = LoadOptions { resolution: Some(3), ..LoadOptions::default() };
        let set = Dataset::load(dir.path(), &half, &|_, _| {}).unwrap();
        assert_eq!(
            set.split("train")[1].weights().unwrap()[..3],
            [0.0; 3],
            "a resized pixel mixes its neighbours"
        );
        write(6, 5);
        let message = load(&dir).unwrap_err().to_string();
        assert!(message.contains("6 x 4") && message.ends_with("m.png"), "{message}");
    }

    #[test]
    fn frames_without_a_time_are_named() {
        assert!(
            refusal(|json| json["frames"][1]["time"] = 0.5.into()).contains("frame 0: missing field `time`")
        );
        assert!(refusal(|json| json["frames"][1]["file_path"] = "still.png".into()).contains("frame 1"));
        assert!(refusal(|json| json["frames"] = json!([])).contains("`train`"));
    }
}
