mod defects;

use super::testing::{load, refusal, synthetic};
use super::*;
use image::{Rgba, RgbaImage};
use serde_json::{Value, json};
use std::fs;
use std::path::Path;

const POSE: [[f64; 4]; 4] =
    [[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, -1.0, -4.0], [0.0, 1.0, 0.0, 0.5], [0.0, 0.0, 0.0, 1.0]];

fn frame(path: &str, time: f64) -> Value {
    json!({ "file_path": path, "time": time, "transform_matrix": POSE })
}

/// A valid set of two training and one test image, 8×6 pixels, that `edit` may spoil.
fn folder(edit: impl FnOnce(&mut Value, &Path)) -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    for (name, shade) in [("a.png", 10), ("b.png", 200), ("c.png", 90)] {
        RgbaImage::from_fn(8, 6, |x, y| {
            Rgba([shade, x as u8 * 20, y as u8 * 30, if x < 4 { 255 } else { 0 }])
        })
        .save(dir.path().join(name))
        .unwrap();
    }
    let mut train = json!({ "camera_angle_x": 0.8, "frames": [frame("./a", 0.0), frame("b.png", 0.5)] });
    let test = json!({ "camera_angle_x": 0.8, "frames": [frame("./c", 0.9)] });
    edit(&mut train, dir.path());
    fs::write(dir.path().join("transforms_train.json"), train.to_string()).unwrap();
    fs::write(dir.path().join("transforms_test.json"), test.to_string()).unwrap();
    dir
}

#[test]
fn a_set_loads_with_its_splits_in_file_order() {
    let dir = folder(|_, _| {});
    let dataset = load(&dir).unwrap();
    let names: Vec<&str> = dataset.splits["train"].iter().map(|f| f.name.as_str()).collect();
    assert_eq!(names, ["a", "b.png"]);
    assert_eq!(dataset.splits.keys().collect::<Vec<_>>(), ["test", "train"]);
    let first = &dataset.splits["train"][0];
    assert_eq!(
        (first.picture().rgba.len(), first.time, first.camera.width, first.camera.height),
        (4 * 48, 0.0, 8, 6)
    );
    assert!((first.camera.fx - 4.0 / 0.4f32.tan()).abs() < 1e-4 && first.camera.fx == first.camera.fy);
    assert_eq!((first.camera.cx, first.camera.cy), (4.0, 3.0));
    assert_eq!(first.camera.center_in_world(), [0.0, -4.0, 0.5]);
    assert_eq!(dataset.splits["test"][0].camera_id, 0, "one pose, one camera");
    assert_eq!(dataset.background, [1.0; 3]);
}

#[test]
fn a_set_without_any_time_is_still() {
    let dir = folder(|_, _| {});
    assert!(!load(&dir).unwrap().is_still());
    let without_times = |file: &str| {
        let path = dir.path().join(file);
        let mut json: Value = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
        for frame in json["frames"].as_array_mut().unwrap() {
            frame.as_object_mut().unwrap().remove("time");
        }
        fs::write(path, json.to_string()).unwrap();
    };
    without_times("transforms_train.json");
    assert!(refusal(&dir, "transforms_train.json").contains("`time`"), "the test images have times");
    without_times("transforms_test.json");
    let still = load(&dir).unwrap();
    assert!(still.is_still() && still.splits.values().flatten().all(|frame| frame.time == 0.0));
    assert!(!Dataset::none([1.0; 3]).is_still());
}

#[test]
fn progress_counts_every_image() {
    let dir = folder(|_, _| {});
    let calls = std::sync::Mutex::new(Vec::new());
    Dataset::load(dir.path(), &LoadOptions::default(), &|done, all| calls.lock().unwrap().push((done, all)))
        .unwrap();
    let mut calls = calls.into_inner().unwrap();
    calls.sort_unstable();
    assert_eq!(calls, [(1, 3), (2, 3), (3, 3)]);
}

#[test]
fn intrinsics_of_the_frame_win_over_the_file_and_the_file_over_the_angle() {
    let dir = folder(|json, _| {
        json["fl_x"] = 11.0.into();
        json["fl_y"] = 12.0.into();
        json["cx"] = 3.5.into();
        json["frames"][1]["fl_x"] = 20.0.into();
        json["frames"][1]["cy"] = 2.5.into();
        json["frames"][1]["w"] = 8.into();
        json["frames"][1]["h"] = 6.into();
    });
    let dataset = load(&dir).unwrap();
    let intrinsics = |i: usize| {
        let c = dataset.splits["train"][i].camera;
        [c.fx, c.fy, c.cx, c.cy]
    };
    assert_eq!(intrinsics(0), [11.0, 12.0, 3.5, 3.0]);
    assert_eq!(
        intrinsics(1),
        [20.0, 20.0, 3.5, 2.5],
        "a frame's fl_x means square pixels, whatever the file's fl_y"
    );
    let ids: Vec<usize> =
        dataset.splits["train"].iter().chain(&dataset.splits["test"]).map(|f| f.camera_id).collect();
    assert_eq!(ids, [0, 1, 2]);
}

#[test]
fn images_are_composited_over_the_background() {
    let dir = folder(|_, _| {});
    let dataset = load(&dir).unwrap();
    let frame = &dataset.splits["train"][0];
    assert!(frame.has_alpha());
    assert_eq!((frame.alpha()[3], frame.alpha()[4]), (1.0, 0.0));
    let image = frame.composited([1.0, 0.5, 0.0]);
    assert_eq!((image.pixels[0], image.pixels[4]), ([10.0 / 255.0, 0.0, 0.0], [1.0, 0.5, 0.0]));
    let black = LoadOptions { white_background: false, ..LoadOptions::default() };
    assert_eq!(Dataset::load(dir.path(), &black, &|_, _| {}).unwrap().background, [0.0; 3]);
}

#[test]
fn images_without_alpha_are_opaque() {
    let dir = folder(|_, path| image::RgbImage::new(8, 6).save(path.join("a.png")).unwrap());
    assert!(!load(&dir).unwrap().splits["train"][0].has_alpha());
}

#[test]
fn resizing_scales_the_camera_and_keeps_colours_unpolluted() {
    let dir = folder(|_, _| {});
    let options = LoadOptions { resolution: Some(4), ..LoadOptions::default() };
    let dataset = Dataset::load(dir.path(), &options, &|_, _| {}).unwrap();
    let frame = &dataset.splits["train"][0];
    let native = load(&dir).unwrap().splits["train"][0].camera;
    assert_eq!((frame.camera.width, frame.camera.height), (4, 3));
    assert!((frame.camera.fx - 0.5 * native.fx).abs() < 1e-5 && frame.camera.cx == 2.0);
    assert_eq!(frame.picture().rgba.len(), 4 * 12);
    for pixel in frame.picture().rgba.as_chunks::<4>().0.iter().filter(|p| p[3] > 0) {
        assert!(pixel[0].abs_diff(10) <= 1, "transparent pixels bleed: {pixel:?}");
    }
    let zero = LoadOptions { resolution: Some(0), ..LoadOptions::default() };
    assert!(Dataset::load(dir.path(), &zero, &|_, _| {}).unwrap_err().to_string().contains("resolution"));
}

#[test]
fn chosen_splits_are_loaded_and_unknown_ones_named() {
    let dir = folder(|_, _| {});
    let only = |name: &str| LoadOptions { splits: Some(vec![name.into()]), ..LoadOptions::default() };
    let dataset = Dataset::load(dir.path(), &only("test"), &|_, _| {}).unwrap();
    assert_eq!(dataset.splits.len(), 1);
    assert_eq!(
        dataset.fingerprint,
        load(&dir).unwrap().fingerprint,
        "the fingerprint is the set's, not the load's"
    );
    let error = Dataset::load(dir.path(), &only("tset"), &|_, _| {}).unwrap_err().to_string();
    assert!(error.contains("`tset`") && error.ends_with("transforms_tset.json"), "{error}");
}

#[test]
fn a_truncated_window_drops_late_training_frames_only() {
    let dir = folder(|_, _| {});
    let before = |limit| LoadOptions { train_before: Some(limit), ..LoadOptions::default() };
    let dataset = Dataset::load(dir.path(), &before(0.5), &|_, _| {}).unwrap();
    assert_eq!(
        dataset.split("train").iter().map(|f| f.time).collect::<Vec<_>>(),
        [0.0],
        "the limit itself is not below it"
    );
    assert_eq!(dataset.split("test").len(), 1);
    let error = Dataset::load(dir.path(), &before(0.0), &|_, _| {}).unwrap_err().to_string();
    assert!(error.contains("below 0") && error.ends_with("transforms_train.json"), "{error}");
}

#[test]
fn the_fingerprint_sees_poses_and_pixels() {
    let original = load(&folder(|_, _| {})).unwrap().fingerprint;
    assert_eq!(original, load(&folder(|_, _| {})).unwrap().fingerprint);
    assert_eq!(original.len(), 16);
    let moved = folder(|json, _| json["frames"][0]["transform_matrix"][0][3] = 0.1.into());
    assert_ne!(original, load(&moved).unwrap().fingerprint);
    let painted =
        folder(|_, path| RgbaImage::from_pixel(8, 6, Rgba([1, 2, 3, 255])).save(path.join("a.png")).unwrap());
    assert_ne!(original, load(&painted).unwrap().fingerprint);
}

#[test]
fn shipped_points_win_and_bad_ones_are_an_error() {
    let points = Points { positions: vec![[1.0, 2.0, 3.0]], colors: vec![[1.0, 0.0, 0.4]] };
    let dir = folder(|_, path| crate::ply::write_points(&path.join("points3d.ply"), &points).unwrap());
    let dataset = load(&dir).unwrap();
    assert_eq!(dataset.initial_points(100, 0), points);
    fs::write(dir.path().join("points3d.ply"), "ply\n").unwrap();
    refusal(&dir, "points3d.ply");
}

#[test]
fn random_points_fill_the_box_that_the_cameras_look_at() {
    let (_dir, out) = synthetic("pendulum", 32, 9);
    let dataset = Dataset::load(&out, &LoadOptions::default(), &|_, _| {}).unwrap();
    let cube = dataset.scene_box();
    assert!(glam::Vec3::from(cube.center).abs_diff_eq(glam::Vec3::ZERO, 1e-3), "{cube:?}");
    assert!((cube.half_side - 1.3).abs() < 0.01, "{cube:?}");
    assert!((dataset.viewing_distance() - 4.4).abs() < 0.01, "{}", dataset.viewing_distance());
    assert_eq!(Dataset::none([1.0; 3]).viewing_distance(), 0.0);
    let points = dataset.initial_points(1000, 3);
    assert_eq!(points.positions.len(), 1000);
    assert_eq!(points, dataset.initial_points(1000, 3));
    assert_ne!(points, dataset.initial_points(1000, 4));
    assert!(
        points
            .positions
            .iter()
            .flatten()
            .zip(cube.center.iter().cycle())
            .all(|(v, c)| (v - c).abs() <= cube.half_side)
    );

    let carved = dataset.carved_points(500, 3);
    assert_eq!(carved.positions.len(), 500);
    let truth = crate::synth::ground_truth("pendulum", &[0.0], 2000, 0).unwrap();
    let nearest = lgs_core::nearest_indices(&truth.points[0], &carved.positions);
    let near =
        |(p, &i): (&[f32; 3], &u32)| glam::Vec3::from(*p).distance(truth.points[0][i as usize].into()) < 0.35;
    let close = carved.positions.iter().zip(&nearest).filter(|&pair| near(pair)).count();
    assert!(close > 450, "{close} of 500 carved points are near the pendulum");
}

#[test]
fn parallel_cameras_still_give_a_box() {
    let dir = folder(|json, _| json["frames"][1]["transform_matrix"][0][3] = 1.0.into());
    let cube = load(&dir).unwrap().scene_box();
    assert!(cube.center.iter().all(|v| v.is_finite()) && cube.half_side > 0.0, "{cube:?}");
    assert!(cube.center[1] > -4.0, "in front of the cameras: {cube:?}");
}
