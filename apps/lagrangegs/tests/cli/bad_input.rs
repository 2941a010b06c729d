//! Input that is wrong: exit code 1, one line that names the file and what is wrong, nothing half-written.

use std::path::Path;

use crate::program::{call, falling_alone, falling_run, files, folder, tiny_dataset, unwritable};

#[test]
fn times_outside_the_scene_are_refused_before_anything_is_written() {
    let (dir, run) = falling_alone();
    let out = dir.path().join("out");
    for command in ["render", "export"] {
        for times in ["2.3", "-0.76", "0:3:0.5", "0,9"] {
            let done = call(
                &format!("{command} {{run}} --times {times} --out {{out}}"),
                &[("run", &run), ("out", &out)],
            );
            done.fails(&run, &["-0.75 to 2.25"]);
            assert!(!out.exists(), "{command} {times}");
        }
    }
}

#[test]
fn outputs_that_cannot_be_written_are_named() {
    let (dir, run) = falling_alone();
    let out = unwritable(dir.path());
    for command in ["render {run} --times 0 --out {out}", "export {run} --times 0 --out {out}"] {
        call(command, &[("run", &run), ("out", &out)]).fails(&out, &["create folder"]);
    }
}

#[test]
fn a_dataset_is_never_written_into() {
    let dir = folder();
    let data = tiny_dataset(dir.path());
    let run = falling_run(dir.path(), &data);
    let before = files(&data);
    let inside = data.join("deep/out");
    for command in [
        "render {run} --times 0 --out {out}",
        "export {run} --times 0 --out {out}",
        "train {data} --out {out}",
        "demo --out {out}",
    ] {
        call(command, &[("run", &run), ("out", &inside), ("data", &data)])
            .fails(&inside, &["inside a dataset"]);
    }
    assert_eq!(files(&data), before);
}

#[test]
fn a_scene_cut_anywhere_is_damaged() {
    let (dir, run) = falling_alone();
    let scene = run.join("lagrangian.safetensors");
    let whole = std::fs::read(&scene).expect("bytes");
    let out = dir.path().join("out");
    for length in [0, 4, 8, whole.len() / 3, whole.len() - 1] {
        std::fs::write(&scene, &whole[..length]).expect("cut");
        call("render {run} --times 0 --out {out}", &[("run", &run), ("out", &out)])
            .fails(&scene, &["damaged"]);
    }
    assert!(!out.exists());
}

#[test]
fn a_folder_that_is_no_run_is_named() {
    let dir = folder();
    let config = dir.path().join("config.toml");
    for command in ["eval {run}", "render {run} --times 0 --out x", "export {run} --times 0 --out x"] {
        call(command, &[("run", dir.path())]).fails(&config, &["not a run"]);
    }
}

#[test]
fn a_run_whose_dataset_is_gone_says_so() {
    let dir = folder();
    let gone = dir.path().join("gone");
    let run = falling_run(dir.path(), &gone);
    call("eval {run}", &[("run", &run)]).fails(&gone, &[]);
    assert!(!run.join("metrics.json").exists());
}

#[test]
fn bad_datasets_are_refused_by_every_reader() {
    let dir = folder();
    let data = tiny_dataset(dir.path());
    let transforms = data.join("transforms_train.json");
    let good = std::fs::read_to_string(&transforms).expect("transforms");
    let mut json: serde_json::Value = serde_json::from_str(&good).expect("JSON");
    refuses(&data, &transforms, "{ \"frames\": [", &["malformed JSON"]);
    refuses(&data, &transforms, "{ \"camera_angle_x\": 0.7, \"frames\": [] }", &["empty"]);
    let time = json["frames"][2].as_object_mut().expect("frame").remove("time").expect("time");
    refuses(&data, &transforms, &json.to_string(), &["frame 2", "`time`"]);
    json["frames"][2]["time"] = time;
    json["frames"][1]["transform_matrix"][0][0] = 5.0.into();
    refuses(&data, &transforms, &json.to_string(), &["frame 1", "`transform_matrix`"]);
    let none = dir.path().join("none");
    let out = dir.path().join("out");
    call("train {data} --out {out}", &[("data", &none), ("out", &out)]).fails(&none, &[]);
    assert!(!out.exists());
}

#[track_caller]
fn refuses(data: &Path, transforms: &Path, text: &str, words: &[&str]) {
    let good = std::fs::read(transforms).expect("transforms");
    std::fs::write(transforms, text).expect("write");
    let out = data.with_file_name("out");
    call("train {data} --out {out}", &[("data", data), ("out", &out)]).fails(transforms, words);
    call("info {data}", &[("data", data)]).fails(transforms, words);
    assert!(!out.exists());
    std::fs::write(transforms, good).expect("restore");
}

#[test]
fn an_image_that_does_not_decode_is_named() {
    let dir = folder();
    let data = tiny_dataset(dir.path());
    let train = data.join("train");
    let image = train.join(&files(&train)[0]);
    std::fs::write(&image, b"\x89PNG\r\n\x1a\nbroken").expect("write");
    call("info {data}", &[("data", &data)]).fails(&image, &["decode"]);
}
