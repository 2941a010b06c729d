use super::*;
use crate::dataset::testing::synthetic;
use crate::dataset::{Dataset, LoadOptions};

fn load(root: &Path) -> Dataset {
    Dataset::load(root, &LoadOptions::default(), &|_, _| {}).unwrap()
}

/// Imports a set and asserts that what comes back is the set.
pub(in crate::dataset) fn assert_round_trip(root: &Path) {
    let parent = tempfile::tempdir().unwrap();
    let out = parent.path().join("imported");
    import(root, &out, &ImportOptions::default(), &|_, _| {}).unwrap();
    assert_eq!(DatasetFormat::detect(&out), Some(DatasetFormat::Blender));
    let (before, after) = (load(root), load(&out));
    assert_eq!(before.splits.keys().collect::<Vec<_>>(), after.splits.keys().collect::<Vec<_>>());
    for (split, frames) in &before.splits {
        assert_eq!(frames.len(), after.split(split).len(), "{split}");
        for (a, b) in frames.iter().zip(after.split(split)) {
            assert_eq!(a.time, b.time, "{}", a.name);
            assert_eq!(a.picture(), b.picture(), "{}", a.name);
            let intrinsics = |c: &Camera| [c.fx, c.fy, c.cx, c.cy];
            assert_eq!(intrinsics(&a.camera), intrinsics(&b.camera));
            assert!(a.camera.camera_from_world.abs_diff_eq(b.camera.camera_from_world, 1e-5), "{}", a.name);
        }
    }
    let positions = |set: &Dataset| set.init_points.as_ref().map(|points| points.positions.clone());
    assert_eq!(positions(&before), positions(&after));
}

/// Three cameras at eight moments with a truth.
fn falling_ball() -> (tempfile::TempDir, PathBuf) {
    synthetic("falling-ball", 8, 3)
}

fn imported(root: &Path, rules: ImportRules) -> (tempfile::TempDir, Dataset) {
    let dir = tempfile::tempdir().unwrap();
    let options = ImportOptions { rules, size: ImportSize::Reduced(2), ..ImportOptions::default() };
    import(root, &dir.path().join("out"), &options, &|_, _| {}).unwrap();
    let set = load(&dir.path().join("out"));
    (dir, set)
}

fn times(set: &Dataset, split: &str) -> Vec<f32> {
    let mut times: Vec<f32> = set.split(split).iter().map(|f| f.time).collect();
    times.sort_by(f32::total_cmp);
    times.dedup();
    times
}

#[test]
fn a_set_with_edits_and_a_truth_comes_back_whole() {
    let (_dir, root) = falling_ball();
    assert_round_trip(&root);
    let (dir, set) = imported(&root, ImportRules::default());
    assert!(dir.path().join("out/scene.json").exists() && !set.edits.is_empty());
    assert!(dir.path().join("out/ground_truth.safetensors").exists());
    assert_eq!(set.split("train")[0].camera.width, 4);
}

#[test]
fn times_are_cut_and_thinned() {
    let (_dir, root) = falling_ball();
    let rules = ImportRules { times: Some([0.25, 0.75]), every: Some(5), ..ImportRules::default() };
    let (dir, set) = imported(&root, rules);
    // Moments of train and val: every 1/60 from 15/60 to 44/60, as val or train show them; every fifth.
    let all = [times(&set, "train"), times(&set, "val")].concat();
    assert!(all.iter().all(|t| (0.0..1.0).contains(t)) && !times(&set, "train").is_empty(), "{all:?}");
    assert!(times(&set, "train").contains(&0.0));
    assert!(!dir.path().join("out/scene.json").exists(), "the truth is of other times");
}

#[test]
fn rules_say_what_is_test() {
    let (_dir, root) = falling_ball();
    let late = ImportRules { test_after: Some(0.5), ..ImportRules::default() };
    let (_dir2, set) = imported(&root, late);
    assert!(times(&set, "train").iter().all(|&t| t <= 0.5) && times(&set, "test")[0] > 0.5);
    assert!(!set.split("val").is_empty() && !set.split("long").is_empty());
    assert!(times(&set, "val").iter().all(|&t| t <= 0.5), "what was held out stays so");
    let held =
        ImportRules { test_cameras: vec!["1".into()], val_cameras: vec!["2".into()], ..Default::default() };
    let (_dir3, set) = imported(&root, held);
    assert_eq!((set.cameras("test").len(), set.cameras("val").len()), (1, 1));
    assert!(set.cameras("train").iter().all(|f| f.camera_id != set.split("test")[0].camera_id));
    let unknown = ImportRules { test_cameras: vec!["left".into()], ..ImportRules::default() };
    let options = ImportOptions { rules: unknown, ..ImportOptions::default() };
    let message = import(&root, &root.with_extension("out"), &options, &|_, _| {}).unwrap_err().to_string();
    assert!(message.contains("`left`") && message.contains("0, 1, 2"), "{message}");
    assert!(!root.with_extension("out").exists());
    let nothing = ImportRules { times: Some([7.0, 8.0]), ..ImportRules::default() };
    let options = ImportOptions { rules: nothing, ..ImportOptions::default() };
    assert!(import(&root, &root.with_extension("out"), &options, &|_, _| {}).is_err());
}

#[test]
fn nothing_is_written_into_the_source_or_over_something() {
    let (_dir, root) = falling_ball();
    let count = || std::fs::read_dir(&root).unwrap().count();
    let before = count();
    let inside = import(&root, &root.join("deep/out"), &ImportOptions::default(), &|_, _| {});
    assert!(inside.unwrap_err().to_string().contains("inside"));
    assert!(import(&root, &root, &ImportOptions::default(), &|_, _| {}).is_err());
    assert_eq!(count(), before);
    let taken = tempfile::tempdir().unwrap();
    std::fs::write(taken.path().join("x"), "").unwrap();
    let error = import(&root, taken.path(), &ImportOptions::default(), &|_, _| {}).unwrap_err().to_string();
    assert!(error.contains("not empty"), "{error}");
}
