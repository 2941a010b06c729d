//! Datasets of other layouts: what `info` says, what `import` makes of them.

use std::path::Path;

use crate::program::{call, files, folder, json_file, tiny_dataset};

#[test]
fn import_resizes_cuts_and_holds_out() {
    let dir = folder();
    let data = tiny_dataset(dir.path());
    let before = files(&data);
    let out = dir.path().join("imported");
    let line = "import {data} {out} --reduce 2 --times 0:0.5 --test-cameras 1 --test-after 0.3 --json";
    let done = call(line, &[("data", &data), ("out", &out)]).json();
    assert!(
        done["splits"]["train"].as_u64() > Some(0) && done["splits"]["test"].as_u64() > Some(0),
        "{done}"
    );
    let train = json_file(&out.join("transforms_train.json"));
    assert_eq!(
        (train["frames"][0]["w"].as_u64(), train["frames"][0]["time"].as_f64()),
        (Some(12), Some(0.0))
    );
    let info = call("info {out} --json", &[("out", &out)]).json();
    assert_eq!(info["image_sizes"], "12x12");
    assert_eq!(files(&data), before, "nothing is written into the source");
    call("import {data} {out}", &[("data", &data), ("out", &out)]).fails(&out, &["not empty"]);
    call("import {data} {out}", &[("data", &data), ("out", &data.join("deep"))])
        .fails(&data, &["inside a dataset"]);
    for wrong in ["--times 0.5:0.1", "--size 0", "--size 4 --reduce 2", "--format none"] {
        call(&format!("import {{data}} x {wrong}"), &[("data", &data)]).is_bad_usage(&[]);
    }
}

#[test]
fn absent_images_are_named_counted_and_left_out() {
    let dir = folder();
    let data = tiny_dataset(dir.path());
    let image = data.join("train/r_0003.png");
    std::fs::remove_file(&image).expect("an image");
    let run = dir.path().join("run");
    for line in ["info {data}", "train {data} --out {run}", "import {data} {run}"] {
        call(line, &[("data", &data), ("run", &run)]).fails(&image, &["1 of", "absent", "r_0003.png"]);
    }
    let info = call("info {data} --skip-missing --json", &[("data", &data)]).json();
    assert_eq!(info["absent_images"], "1: train/r_0003.png");
    let done = call("import {data} {run} --skip-missing --json", &[("data", &data), ("run", &run)]).json();
    assert_eq!(done["absent"], 1);
}

#[test]
fn a_rig_is_drawn() {
    let dir = folder();
    let data = tiny_dataset(dir.path());
    let [svg, png, other] = ["rig.svg", "rig.png", "rig.pdf"].map(|name| dir.path().join(name));
    let draw = |path: &Path| call("info {data} --rig {path}", &[("data", &data), ("path", path)]);
    let said = draw(&svg).ok();
    assert!(said.contains("3 cameras") && said.contains("times"), "{said}");
    let text = std::fs::read_to_string(&svg).expect("a drawing");
    for words in ["from above", "from the side", "train: 3 cameras"] {
        assert!(text.contains(words), "{words}");
    }
    draw(&png).ok();
    assert_eq!(std::fs::read(&png).expect("a picture")[1..4], *b"PNG");
    draw(&other).is_bad_usage(&[".svg or .png", "rig.pdf"]);
    draw(&data.join("rig.svg")).fails(&data.join("rig.svg"), &["inside a dataset"]);
}
