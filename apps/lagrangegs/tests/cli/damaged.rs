//! Files that are damaged: every reader names the file.

use std::path::Path;

use crate::program::{call, edit_json, falling, folder, tiny_dataset};
use lagrangegs::lgs_core::GaussianCloud;
use lagrangegs::lgs_data::ply::write_ply;

#[test]
fn every_file_of_a_run_is_checked() {
    let (dir, _, run) = falling();
    let cloud = run.join("source/point_cloud/iteration_9");
    std::fs::create_dir_all(&cloud).expect("folders");
    let out = dir.path().join("out");
    let paths: [(&str, &Path); 2] = [("run", &run), ("out", &out)];
    call("info {run}", &paths).ok();
    let orbit = "render {run} --times 0 --size 16 --out {out}";
    for (name, text, readers) in [
        ("config.toml", "", &["eval {run}", "view {run} --port 0", "report {run}", orbit][..]),
        ("config.toml", "preset = [", &["eval {run}", orbit]),
        ("source/cameras.json", "", &["eval {run}", "view {run} --port 0 --no-images", orbit]),
        ("source/cameras.json", "[{}]", &["eval {run}"]),
        ("cost.json", "", &["eval {run}"]),
        ("distillation.json", "{", &["eval {run}", "view {run} --port 0", orbit]),
        ("events.jsonl", "{}\n", &["eval {run}"]),
        ("metrics.json", "", &["report {run}", "eval {run} --split val"]),
        ("source/point_cloud/iteration_9/point_cloud.ply", "", &[]),
    ] {
        let path = run.join(name);
        let before = std::fs::read(&path).ok();
        std::fs::write(&path, text).expect("damaged");
        for command in [&["info {run}"], readers].concat() {
            call(command, &paths).fails(&path, &[]);
        }
        match before {
            Some(bytes) => std::fs::write(&path, bytes).expect("restored"),
            None => std::fs::remove_file(&path).expect("removed"),
        }
    }
    assert!(!run.join("metrics.json").exists() && !out.join("frames.json").exists());
    std::fs::write(run.join("events.jsonl"), "{\"stage\":\"sou").expect("cut short by a crash");
    call("info {run}", &paths).ok();
}

#[test]
fn what_another_version_wrote_stops_no_picture() {
    let (dir, _, run) = falling();
    let out = dir.path().join("out");
    let paths: [(&str, &Path); 2] = [("run", &run), ("out", &out)];
    let (distilled, metrics) = (run.join("distillation.json"), run.join("metrics.json"));
    let warnings = |stderr: &str, path: &Path| {
        let is_it =
            |line: &&str| line.contains("another version") && line.ends_with(&path.display().to_string());
        stderr.lines().filter(is_it).count()
    };
    std::fs::write(&distilled, "[{\"later\": 1}]").expect("written");
    for line in ["render {run} --times 0 --size 16 --out {out}", "info {run}"] {
        let done = call(line, &paths);
        assert_eq!((done.code, warnings(&done.stderr, &distilled)), (0, 1), "{line}: {}", done.stderr);
    }
    let old = "{\"schema\": 1, \"splits\": {\"test\": {}, \"val\": {}}}";
    std::fs::write(&metrics, old).expect("written");
    let done = call("info {run}", &paths);
    assert_eq!(warnings(&done.stderr, &metrics), 1, "{}", done.stderr);
    assert!(done.ok().contains("test, val"));
    let done = call("eval {run} --split val", &paths);
    assert!(done.stderr.contains("stays as it is, since it has test"), "{}", done.stderr);
    assert_eq!(std::fs::read_to_string(&metrics).expect("a file"), old);
}

#[test]
fn splats_that_lost_their_contents_or_have_no_size_are_named() {
    let dir = folder();
    let path = |name: &str| dir.path().join(name);
    std::fs::write(path("a.splat"), b"").expect("written");
    let mut cloud = GaussianCloud::isotropic(vec![[0.0; 3]; 2], 0.1, [0.5; 3], 0.5);
    cloud.log_scales[1][2] = 500.0;
    write_ply(&path("b.ply"), &cloud).expect("ply");
    for (name, words) in [("a.splat", ["32 bytes", "found 0"]), ("b.ply", ["`scale_2` of vertex 1", "500"])] {
        call("info {p}", &[("p", &path(name))]).fails(&path(name), &words);
        call("convert {p} {p}.spz", &[("p", &path(name))]).fails(&path(name), &words);
    }
}

#[test]
fn times_outside_of_the_sequence_are_remarked() {
    let dir = folder();
    let data = tiny_dataset(dir.path());
    edit_json(&data.join("transforms_train.json"), |json| {
        json["frames"][2]["time"] = 1.5.into();
        json["frames"][4]["time"] = (-0.1).into();
    });
    let words = ["`time` should be in [0, 1]", "2 of", "frame 2 with 1.5", "transforms_train.json"];
    let info = call("info {data}", &[("data", &data)]).ok();
    // Whatever becomes of the training, the remark comes before it.
    let run = dir.path().join("run");
    let line = "train {data} --out {run} --set source.iterations=1 --last-stage 1 --set seed=1";
    let done = call(line, &[("data", &data), ("run", &run)]);
    for word in words {
        assert!(info.contains(word), "should contain {word}: {info}");
        assert!(done.stderr.contains(word), "should contain {word}: {}", done.stderr);
    }
}
