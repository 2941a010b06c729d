//! The layout of Dynamic 3D Gaussians for captures of many synchronised cameras, CMU Panoptic's among them:
//! `train_meta.json` and `test_meta.json`, which become the splits `train` and `test`, and images in `ims/`.
//!
//! A file has the size `w`, `h` of all images and, for every moment and camera, `k` (3×3, pixels), `w2c`
//! (4×4, camera-from-world, OpenCV axes), `fn` (the image below `ims/`) and `cam_id`. Moment `i` of `n` has
//! the time i / n. Points are those of `init_pt_cld.npz`: rows x y z r g b and whether a person is there.
//! The masks in `seg/` say where people are, not what to leave out, and are not read.

use super::reader::{FormatReader, Label};
use crate::dataset::error::{DatasetError, Problem};
use crate::dataset::frame_spec::{FrameSpec, Intrinsics, SizeRule};
use crate::dataset::lens::Lens;
use crate::dataset::set::CameraOrigin;
use crate::dataset::{npy, poses, transforms};
use crate::ply::Points;
use glam::{DMat3, DVec3};
use serde::Deserialize;
use serde_json::Value;
use std::path::{Path, PathBuf};

pub(super) struct Panoptic;

/// A file; numbers that are none are `null`.
#[derive(Deserialize)]
struct Meta {
    w: Option<f64>,
    h: Option<f64>,
    k: Vec<Vec<Vec<Vec<Option<f64>>>>>,
    w2c: Vec<Vec<Vec<Vec<Option<f64>>>>>,
    #[serde(rename = "fn")]
    images: Vec<Vec<String>>,
    cam_id: Vec<Vec<Value>>,
}

impl FormatReader for Panoptic {
    fn label(&self) -> Label {
        Label { name: "panoptic", marker: "`train_meta.json`" }
    }

    fn is_at(&self, root: &Path) -> bool {
        self.split_file(root, "train").is_file()
    }

    fn splits(&self, root: &Path) -> Result<Vec<String>, DatasetError> {
        let there = |split: &&str| self.split_file(root, split).is_file();
        Ok(["train", "test"].iter().filter(|s| there(s)).map(|&s| s.to_owned()).collect())
    }

    fn split_file(&self, root: &Path, split: &str) -> PathBuf {
        root.join(format!("{split}_meta.json"))
    }

    fn camera_origin(&self, _: &Path) -> Result<CameraOrigin, DatasetError> {
        Ok(CameraOrigin::Calibrated)
    }

    fn frames(&self, root: &Path, split: &str) -> Result<Vec<FrameSpec>, DatasetError> {
        let path = self.split_file(root, split);
        let meta: Meta = transforms::read(&path)?;
        let wrong = |problem| DatasetError::new(&path, problem);
        meta.check_counts().map_err(wrong)?;
        let mut specs = Vec::new();
        for moment in 0..meta.images.len() {
            for camera in 0..meta.images[moment].len() {
                let spec = meta.spec((root, &path), [moment, camera], specs.len()).map_err(wrong)?;
                specs.push(spec);
            }
        }
        if specs.is_empty() { Err(wrong(Problem::Empty)) } else { Ok(specs) }
    }

    fn points(&self, root: &Path) -> Result<Option<Points>, DatasetError> {
        let path = root.join("init_pt_cld.npz");
        if !path.exists() {
            return Ok(None);
        }
        let table = npy::read_npz(&path, "data")?;
        npy::points(&table).map(Some).map_err(|problem| DatasetError::new(&path, problem))
    }
}

impl Meta {
    /// Every list must have as many moments, and every moment as many cameras, as `fn`.
    fn check_counts(&self) -> Result<(), Problem> {
        let of = |lengths: Vec<usize>, field| (lengths, field);
        let counts: Vec<usize> = self.images.iter().map(Vec::len).collect();
        for (lengths, field) in [
            of(self.k.iter().map(Vec::len).collect(), "k"),
            of(self.w2c.iter().map(Vec::len).collect(), "w2c"),
            of(self.cam_id.iter().map(Vec::len).collect(), "cam_id"),
        ] {
            let differs = (0..lengths.len().max(counts.len())).find(|&i| lengths.get(i) != counts.get(i));
            if let Some(moment) = differs {
                let count = |list: &[usize]| list.get(moment).copied().unwrap_or(0);
                return Err(Problem::Part {
                    part: format!("moment {moment}"),
                    field,
                    expected: format!("as many entries as `fn`, {}", count(&counts)),
                    found: count(&lengths).to_string(),
                });
            }
        }
        Ok(())
    }

    fn spec(
        &self,
        (root, path): (&Path, &Path),
        [moment, camera]: [usize; 2],
        index: usize,
    ) -> Result<FrameSpec, Problem> {
        let wrong = |field, (expected, found)| Problem::Value { frame: index, field, expected, found };
        let k = matrix::<3>(&self.k[moment][camera]).map_err(|found| wrong("k", found))?;
        let pose = matrix::<4>(&self.w2c[moment][camera]).map_err(|found| wrong("w2c", found))?;
        let rows = [0, 1, 2].map(|i| DVec3::new(pose[i][0], pose[i][1], pose[i][2]));
        let rotation = DMat3::from_cols(rows[0], rows[1], rows[2]).transpose();
        let translation = DVec3::new(pose[0][3], pose[1][3], pose[2][3]);
        let pose = poses::rigid(rotation, translation).map_err(|found| wrong("w2c", found))?;
        if k[0][1] != 0.0 {
            return Err(wrong("k", ("a camera without skew", k[0][1].to_string())));
        }
        let name = &self.images[moment][camera];
        let size = self.w.zip(self.h).map(|(w, h)| [w, h]);
        let id = &self.cam_id[moment][camera];
        Ok(FrameSpec {
            described_in: path.to_owned(),
            index,
            name: format!("ims/{name}"),
            image_path: root.join("ims").join(name),
            mask_path: None,
            view: Some(id.as_str().map_or_else(|| id.to_string(), str::to_owned)),
            time: (moment as f64 / self.images.len() as f64) as f32,
            camera_from_world: pose.as_mat4(),
            own: Intrinsics::of([k[0][0], k[1][1]], [k[0][2], k[1][2]], size),
            shared: Intrinsics::default(),
            lens: Lens::Pinhole,
            size_rule: SizeRule::Exact,
        })
    }
}

/// A finite N×N matrix, row by row.
fn matrix<const N: usize>(rows: &[Vec<Option<f64>>]) -> Result<[[f64; N]; N], poses::Wrong> {
    if rows.len() != N || rows.iter().any(|row| row.len() != N) {
        let widths: Vec<usize> = rows.iter().map(Vec::len).collect();
        return Err(("a square matrix", format!("rows of {widths:?} values")));
    }
    let mut out = [[0.0; N]; N];
    for (i, (out, row)) in out.iter_mut().zip(rows).enumerate() {
        for (j, (out, value)) in out.iter_mut().zip(row).enumerate() {
            let absent = || ("finite", format!("no number in row {i}, column {j}"));
            *out = value.filter(|v| v.is_finite()).ok_or_else(absent)?;
        }
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dataset::testing::load;
    use crate::dataset::{AbsentImages, Dataset, DatasetFormat, LoadOptions};
    use serde_json::json;

    /// Two cameras at three moments, whose training file `edit` may change.
    fn folder(edit: impl FnOnce(&mut Value)) -> tempfile::TempDir {
        let dir = tempfile::tempdir().unwrap();
        let k = json!([[5.0, 0.0, 3.1], [0.0, 5.5, 2.0], [0.0, 0.0, 1.0]]);
        let pose = |x: f64| {
            json!([[1.0, 0.0, 0.0, x], [0.0, 0.0, -1.0, 0.5], [0.0, 1.0, 0.0, 4.0], [0.0, 0.0, 0.0, 1.0]])
        };
        for split in ["train", "test"] {
            let ids = if split == "train" { [3, 7] } else { [0, 9] };
            for id in ids {
                std::fs::create_dir_all(dir.path().join(format!("ims/{id}"))).unwrap();
                for moment in 0..3 {
                    let image = image::RgbImage::from_pixel(6, 4, image::Rgb([id as u8, moment, 0]));
                    image.save(dir.path().join(format!("ims/{id}/{moment:06}.png"))).unwrap();
                }
            }
            let each = |f: &dyn Fn(usize, i32) -> Value| -> Value {
                (0..3).map(|t| ids.iter().map(|&id| f(t, id)).collect::<Value>()).collect()
            };
            let meta = json!({ "w": 6, "h": 4, "k": each(&|_, _| k.clone()),
                "w2c": each(&|_, id| pose(0.1 * f64::from(id))),
                "fn": each(&|t, id| json!(format!("{id}/{t:06}.png"))), "cam_id": each(&|_, id| json!(id)) });
            std::fs::write(dir.path().join(format!("{split}_meta.json")), meta.to_string()).unwrap();
        }
        let path = dir.path().join("train_meta.json");
        let mut meta: Value = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
        edit(&mut meta);
        std::fs::write(&path, meta.to_string()).unwrap();
        dir
    }

    fn refusal(edit: impl FnOnce(&mut Value)) -> String {
        let message = load(&folder(edit)).unwrap_err().to_string();
        assert!(message.ends_with("train_meta.json"), "{message}");
        message
    }

    #[test]
    fn moments_cameras_and_points_are_read() {
        let dir = folder(|_| {});
        npy::tests::write_npz(
            &dir.path().join("init_pt_cld.npz"),
            "data",
            ([2, 7], &[1., 2., 3., 0.5, 0.25, 0., 1., 4., 5., 6., 1., 1., 0., 0.]),
        );
        assert_eq!(DatasetFormat::detect(dir.path()), Some(DatasetFormat::Panoptic));
        crate::dataset::import::tests::assert_round_trip(dir.path());
        let set = load(&dir).unwrap();
        assert_eq!(set.splits.keys().collect::<Vec<_>>(), ["test", "train"]);
        let first = &set.split("train")[1];
        assert_eq!((first.name.as_str(), first.time, set.split("train").len()), ("ims/7/000000.png", 0.0, 6));
        assert_eq!(set.split("train")[5].time, 2.0 / 3.0);
        assert_eq!(
            [first.camera.fx, first.camera.fy, first.camera.cx, first.camera.cy],
            [5.0, 5.5, 3.1, 2.0]
        );
        assert_eq!(first.picture().rgba[..4], [7, 0, 0, 255]);
        // The camera is at x = −0.7 and looks along +y.
        assert!((first.camera.center_in_world()[0] + 0.7).abs() < 1e-6);
        assert!(first.camera.ray_direction_in_world([3.1, 2.0])[1] > 0.999);
        let points = set.init_points.unwrap();
        assert_eq!((points.positions[1], points.colors[0]), ([4.0, 5.0, 6.0], [0.5, 0.25, 0.0]));
    }

    #[test]
    fn what_no_camera_is_or_does_not_fit_is_named() {
        let message = refusal(|json| json["w2c"][1][0][0][0] = (-1.0).into());
        assert!(message.contains("frame 2") && message.contains("`w2c`") && message.contains("reflection"));
        assert!(refusal(|json| json["w2c"][2][1][0][3] = Value::Null).contains("frame 5"));
        assert!(refusal(|json| json["k"][0][0][0][0] = Value::Null).contains("`k`"));
        assert!(refusal(|json| json["k"][0][1][0][1] = 0.5.into()).contains("skew"));
        let message = refusal(|json| json["k"][1] = json!([]));
        assert!(message.contains("moment 1") && message.contains("found 0"), "{message}");
        let message = refusal(|json| json["cam_id"].as_array_mut().map_or((), |a| a.truncate(2)));
        assert!(message.contains("moment 2") && message.contains("`cam_id`"), "{message}");
        assert!(refusal(|json| json["w"] = 7.into()).contains("7 x 4"));
    }

    #[test]
    fn absent_images_are_counted_and_named_or_skipped() {
        let dir = folder(|_| {});
        std::fs::remove_file(dir.path().join("ims/7/000001.png")).unwrap();
        std::fs::remove_file(dir.path().join("ims/7/000002.png")).unwrap();
        let message = load(&dir).unwrap_err().to_string();
        assert!(message.contains("2 of 12") && message.contains("7/000002.png"), "{message}");
        assert!(message.ends_with("ims/7/000001.png"), "{message}");
        let skip = LoadOptions { absent: AbsentImages::Skip, ..LoadOptions::default() };
        let set = Dataset::load(dir.path(), &skip, &|_, _| {}).unwrap();
        assert_eq!((set.split("train").len(), set.absent.len()), (4, 2));
    }
}
