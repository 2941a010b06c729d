//! `synth` and `info`.

use crate::program::{call, falling, files, folder, tiny_dataset, unwritable};

#[test]
fn a_synthetic_dataset_is_complete_and_described() {
    let dir = folder();
    let data = tiny_dataset(dir.path());
    for name in ["transforms_train.json", "transforms_past.json", "ground_truth.safetensors", "scene.json"] {
        assert!(files(&data).iter().any(|f| f == name), "{name}");
    }
    let text = call("info {data}", &[("data", &data)]).ok();
    assert!(
        text.contains("24x24")
            && text.contains("train:")
            && text.contains("long:")
            && text.contains("ground truth"),
        "{text}"
    );
    let json = call("info {data} --json", &[("data", &data)]).json();
    assert_eq!(json["kind"], "dataset");
    let truth = data.join("ground_truth.safetensors");
    assert!(call("info {truth}", &[("truth", &truth)]).ok().contains("points"));
}

#[test]
fn a_destination_that_holds_something_is_refused() {
    let dir = folder();
    let data = tiny_dataset(dir.path());
    let before = files(&data);
    call("synth fan --out {data} --size 24", &[("data", &data)]).fails(&data, &["new or empty"]);
    let inside = data.join("more");
    call("synth fan --out {inside} --size 24", &[("inside", &inside)]).fails(&data, &["inside a dataset"]);
    assert_eq!(files(&data), before);
}

#[test]
fn bad_synth_options_are_named() {
    let dir = folder();
    let out = dir.path().join("out");
    for (line, word) in [
        ("synth volcano --out {out}", "volcano"),
        ("synth fan --out {out} --size 1", "--size"),
        ("synth fan --out {out} --views 0", "--views"),
        ("synth fan --out {out} --train-fps 7", "--train-fps"),
        ("synth fan --out {out} --images-per-time 0", "--images-per-time"),
        ("synth volcano --tracks --out {out}", "volcano"),
        ("synth fan --tracks --noise nan --out {out}", "--noise"),
        ("demo --scene volcano --out {out}", "volcano"),
        ("demo --views 0 --out {out}", "--views"),
    ] {
        call(line, &[("out", &out)]).is_bad_usage(&[word]);
        assert!(!out.exists(), "{line}");
    }
    let out = unwritable(dir.path());
    assert_eq!(call("synth fan --out {out} --size 8 --views 1", &[("out", &out)]).code, 1);
    assert_eq!(files(dir.path()), ["file"]);
}

#[test]
fn info_describes_runs_scenes_and_splats() {
    let (dir, _, run) = falling();
    let text = call("info {run}", &[("run", &run)]).ok();
    assert!(text.contains("64") && text.contains("-0.75 to 2.25"), "{text}");
    let scene = run.join("lagrangian.safetensors");
    assert!(call("info {scene}", &[("scene", &scene)]).ok().contains("Lagrangian scene"));
    let splats = dir.path().join("one.ply");
    call("export {run} --times 0 --out {splats}", &[("run", &run), ("splats", &splats)]).ok();
    assert!(call("info {splats}", &[("splats", &splats)]).ok().contains("67"));
}

#[test]
fn info_says_what_is_wrong() {
    let dir = folder();
    let path = |name: &str| dir.path().join(name);
    call("info {p}", &[("p", &path("none"))]).fails(&path("none"), &["no such file"]);
    call("info {p}", &[("p", dir.path())]).fails(dir.path(), &["neither a dataset"]);
    std::fs::write(path("a.ply"), "ply\nformat ascii 1.0\nelement vertex 1\nend_header\n").expect("write");
    call("info {p}", &[("p", &path("a.ply"))]).fails(&path("a.ply"), &[]);
    std::fs::write(path("a.safetensors"), [1, 2, 3]).expect("write");
    call("info {p}", &[("p", &path("a.safetensors"))]).fails(&path("a.safetensors"), &["damaged"]);
    std::fs::write(path("a.txt"), "hello").expect("write");
    call("info {p}", &[("p", &path("a.txt"))]).fails(&path("a.txt"), &["expected"]);
}
