//! Files of datasets: what must stay as it is for the default seed, and the splits of edits.

use super::tests::{make, small};
use super::*;
use crate::dataset::{Dataset, LoadOptions};
use crate::edit::MotionEdit;
use serde_json::Value;
use std::fs;
use std::path::PathBuf;

/// FNV-1a of the files that the first seven scenes have always had, in order.
fn digest(folder: &Path) -> u64 {
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    let mut add = |path: PathBuf| {
        for byte in fs::read(path).unwrap() {
            hash = (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    };
    for split in ["train", "val", "test", "long", "past"] {
        let images = fs::read_dir(folder.join(split)).unwrap();
        let mut images: Vec<PathBuf> = images.map(|entry| entry.unwrap().path()).collect();
        images.sort();
        images.into_iter().for_each(&mut add);
        add(folder.join(format!("transforms_{split}.json")));
    }
    add(folder.join("ground_truth.safetensors"));
    hash
}

#[test]
fn the_first_seven_scenes_keep_every_byte_for_the_default_seed() {
    let known = [
        ("falling-ball", 0x24f3_7133_9a14_085c),
        ("fan", 0x179b_4bd5_4830_06e3),
        ("projectile", 0x5b15_a3d0_4ac9_a7ba),
        ("pendulum", 0x7da0_3f55_96bc_9610),
        ("spring", 0x2933_e9ec_3ada_be9c),
        ("sled", 0xc042_836d_53f7_4fe8),
        ("room", 0x310a_d4af_c7f3_c902_u64),
    ];
    for (scene, expected) in known {
        let (_dir, out) = make(scene, &small());
        assert_eq!(digest(&out), expected, "{scene}");
    }
}

#[test]
fn edited_splits_have_images_truth_and_their_edit() {
    let (_dir, out) = make("torsion-spring", &small());
    let dataset = Dataset::load(&out, &LoadOptions::default(), &|_, _| {}).unwrap();
    let truth = GroundTruth::load(&out).unwrap().unwrap();
    assert_eq!(dataset.edits.len(), 5);
    for (split, edit) in &dataset.edits {
        assert_eq!((dataset.split(split).len(), dataset.cameras(split).len()), (8, 2), "{split}");
        let edited = &truth.edited[split];
        assert_eq!((edited.times[0], *edited.times.last().unwrap()), (0.0, 2.25));
        assert_eq!(edited.points[0], truth.points[75], "the same start: {split}");
        assert_ne!(edited.points[100], truth.points[175], "{split}");
        assert_ne!(*edit, MotionEdit::default());
    }
    let none = MotionEdit { force_scale: 0.0, ..MotionEdit::default() };
    assert_eq!(dataset.edits["edit-force-none"], none);
    assert_eq!((truth.law["expected"].as_str(), truth.law["seed"].as_u64()), (Some("explained"), Some(0)));
}

#[test]
fn a_scene_without_a_law_has_no_edited_splits() {
    for scene in ["walker", "led", "grabbed", "released"] {
        let (_dir, out) = make(scene, &small());
        let dataset = Dataset::load(&out, &LoadOptions::default(), &|_, _| {}).unwrap();
        let truth = GroundTruth::load(&out).unwrap().unwrap();
        assert!(dataset.edits.is_empty() && truth.edited.is_empty());
        assert_eq!(truth.law["expected"], "outside");
    }
}

#[test]
fn an_edited_split_without_its_edit_is_an_error_with_its_path() {
    let (_dir, out) = make("sled", &small());
    let path = out.join("transforms_edit-force-none.json");
    for (edit, word) in [("null", "null"), (r#"{"velocity_scale": 1}"#, "potential_scale")] {
        let text = fs::read_to_string(&path).unwrap();
        let mut file: Value = serde_json::from_str(&text).unwrap();
        file["edit"] = serde_json::from_str(edit).unwrap();
        fs::write(&path, file.to_string()).unwrap();
        let error = Dataset::load(&out, &LoadOptions::default(), &|_, _| {}).unwrap_err().to_string();
        assert!(error.contains(word) && error.ends_with("transforms_edit-force-none.json"), "{error}");
    }
}

#[test]
fn points_without_a_scene_file_are_a_truth_too() {
    let (_dir, out) = make("fan", &small());
    fs::remove_file(out.join("scene.json")).unwrap();
    let truth = GroundTruth::load(&out).unwrap().unwrap();
    assert!(truth.law.is_null() && truth.points.len() == 301);
}

#[test]
fn tracks_are_the_truth_with_the_noise_that_was_asked_for() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("tracks.safetensors");
    let clean = tracks("double-pendulum", &TrackOptions::default()).unwrap();
    clean.save(&path).unwrap();
    assert_eq!(crate::frames::read_frames(&path).unwrap(), clean);
    assert_eq!((clean.times.len(), clean.positions[0].len()), (61, 320));
    let noisy = tracks("double-pendulum", &TrackOptions { noise: 0.002, seed: 0 }).unwrap();
    let off = |t: usize, i: usize, c: usize| f64::from(noisy.positions[t][i][c] - clean.positions[t][i][c]);
    let (mut variance, mut lagged, mut count) = (0.0, 0.0, 0.0);
    for (t, i, c) in (0..60).flat_map(|t| (0..320).flat_map(move |i| (0..3).map(move |c| (t, i, c)))) {
        variance += off(t, i, c).powi(2);
        lagged += off(t, i, c) * off(t + 1, i, c);
        count += 1.0;
    }
    let deviation = f64::sqrt(variance / count);
    assert!((deviation / 0.002 - 1.0).abs() < 0.05 && (lagged / variance - 0.75).abs() < 0.03);
}

#[test]
fn points_alone_are_a_truth_also_in_other_types_of_numbers() {
    use safetensors::tensor::{Dtype, TensorView};
    let folder = tempfile::tempdir().unwrap();
    let write = |times: [f64; 2], object: Dtype| {
        let bytes = |values: &[f64]| values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
        let (times, points) = (bytes(&times), bytes(&[1.0, 2.0, 3.0, 1.5, 2.0, 3.0]));
        let label: Vec<u8> = vec![1, 0, 0, 0];
        let label = if object == Dtype::U8 { &label[..1] } else { &label };
        let tensors = [
            ("times", TensorView::new(Dtype::F64, vec![2], &times).unwrap()),
            ("points", TensorView::new(Dtype::F64, vec![2, 1, 3], &points).unwrap()),
            ("object", TensorView::new(object, vec![1], label).unwrap()),
        ];
        let path = folder.path().join("ground_truth.safetensors");
        fs::write(path, safetensors::serialize(tensors, None).unwrap()).unwrap();
        GroundTruth::load(folder.path())
    };
    for object in [Dtype::I32, Dtype::U8] {
        let truth = write([0.0, 0.5], object).unwrap().unwrap();
        assert_eq!((truth.object.as_slice(), truth.points[1][0]), ([1].as_slice(), [1.5, 2.0, 3.0]));
        assert!(truth.law.is_null());
    }
    for (times, object, word) in [([0.5, 0.0], Dtype::I32, "increasing"), ([0.0, 0.5], Dtype::F32, "I64")] {
        let message = write(times, object).unwrap_err().to_string();
        assert!(message.contains(word) && message.ends_with("ground_truth.safetensors"), "{message}");
    }
}

#[test]
fn a_set_may_show_each_time_from_few_views_and_finer_times_in_training_alone() {
    let few = SynthOptions { images_per_time: Some(1), views: 3, train_fps: 240, ..small() };
    let (_dir, out) = make("fan", &few);
    let dataset = Dataset::load(&out, &LoadOptions::default(), &|_, _| {}).unwrap();
    let train = dataset.split("train");
    let mut times: Vec<f32> = train.iter().map(|frame| frame.time).collect();
    times.dedup();
    assert_eq!((train.len(), times.len()), (181, 181), "one image per time");
    let mut cameras: Vec<usize> = train.iter().map(|frame| frame.camera_id).collect();
    cameras.sort_unstable();
    cameras.dedup();
    assert_eq!(cameras.len(), 3, "every view has its turns");
    assert_eq!(dataset.split("val").len(), 3 * 16);
}
