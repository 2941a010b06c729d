//! What `eval` and `report` write, and what they leave alone.

use std::path::Path;

use crate::program::{call, falling, falling_run, files, folder, json_file, lagrangegs, tiny_dataset};

#[test]
fn scores_of_some_splits_are_printed_and_replace_none_of_others() {
    let (_dir, data, run) = falling();
    let paths: [(&str, &Path); 1] = [("run", &run)];
    let kept = run.join("metrics.json");
    call("eval {run} --split val", &paths).ok();
    assert_eq!(json_file(&kept)["splits"].as_object().expect("splits").len(), 1, "there was none before");
    let all = call("eval {run} --json", &paths).json();
    let before = ["metrics.json", "report.html"].map(|name| std::fs::read(run.join(name)).expect("a file"));
    let run_text = run.display().to_string();
    let done = lagrangegs(&["eval", &run_text, "--split", "val, test", "--json"]);
    assert!(done.stderr.contains("stays as it is") && done.stderr.contains("past"), "{}", done.stderr);
    let some = done.json();
    assert_eq!(some["splits"].as_object().expect("splits").keys().collect::<Vec<_>>(), ["test", "val"]);
    assert_eq!(some["splits"]["val"], all["splits"]["val"]);
    for figure in ["extent_ratio_max", "extent_ratio_min", "trajectory_error", "edited_trajectory_error"] {
        assert_eq!(some["physics"][figure], all["physics"][figure], "{figure}");
    }
    let after = ["metrics.json", "report.html"].map(|name| std::fs::read(run.join(name)).expect("a file"));
    assert!(before == after, "the files of all splits stay");
    call("eval {run} --split nope", &paths).fails(&data, &["`nope`", "val"]);
}

#[test]
fn another_dataset_than_that_of_training_is_noted_and_a_moved_one_is_not() {
    let (dir, data, run) = falling();
    let moved = dir.path().join("moved");
    let fingerprint = call("info {data} --json", &[("data", &data)]).json()["fingerprint"].clone();
    std::fs::rename(&data, &moved).expect("moved");
    let paths: [(&str, &Path); 2] = [("run", &run), ("moved", &moved)];
    let line = "eval {run} --data {moved} --split val --json";
    let other = call(line, &paths);
    assert!(other.stderr.contains("another dataset (fingerprint 0)"), "{}", other.stderr);
    assert_eq!(other.json()["protocol"]["other_dataset"], fingerprint);
    let config = run.join("config.toml");
    let text = std::fs::read_to_string(&config).expect("config");
    let fingerprint = fingerprint.as_str().expect("a fingerprint");
    std::fs::write(&config, text.replace("fingerprint = '0'", &format!("fingerprint = '{fingerprint}'")))
        .expect("written");
    let same = call(line, &paths);
    assert!(!same.stderr.contains("another dataset"), "{}", same.stderr);
    assert!(same.json()["protocol"]["other_dataset"].is_null());
}

#[test]
fn splits_of_a_run_without_a_dataset_have_to_be_found_elsewhere() {
    let (_dir, data, run) = falling();
    let config = run.join("config.toml");
    let text = std::fs::read_to_string(&config).expect("config");
    let alone = text.split("[dataset]").next().expect("settings");
    std::fs::write(&config, alone).expect("written");
    let paths: [(&str, &Path); 2] = [("run", &run), ("data", &data)];
    call("eval {run} --split val", &paths).fails(&run, &["no dataset", "--data"]);
    assert!(!run.join("metrics.json").exists());
    let scores = call("eval {run} --split val --data {data} --json", &paths).json();
    assert!(scores["splits"]["val"]["lagrangian"]["psnr"].is_f64(), "{scores}");
}

#[test]
fn a_run_inside_a_dataset_is_not_written_into() {
    let dir = folder();
    let data = tiny_dataset(dir.path());
    let run = falling_run(&data, &data);
    let before = files(&run);
    for command in ["eval {run}", "report {run}", "eval {run} --split val"] {
        call(command, &[("run", &run)]).fails(&run, &["inside a dataset"]);
    }
    assert_eq!(files(&run), before);
}
