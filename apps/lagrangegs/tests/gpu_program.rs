//! The program on a device of Vulkan, Metal or DX12 (feature `gpu`), with settings that take seconds.
//!
//! Where no driver offers a device the tests say so and pass, unless `LAGRANGEGS_GPU=required` is set.
#![cfg(feature = "gpu")]

use std::path::Path;
use std::process::{Command, Output};

/// Settings under which training takes seconds and learns next to nothing.
const TINY: &str = "--set source.iterations=40 --set source.warmup_iterations=20 \
                    --set source.initial_gaussians=400 \
                    --set distill.matching.steps=10 --set distill.rollout.steps=2 \
                    --set refine_gaussians.iterations=2 --set tune_dynamics.iterations=4 \
                    --set tune_gaussians.iterations=4";

fn run(line: &str) -> Output {
    Command::new(env!("CARGO_BIN_EXE_lagrangegs"))
        .args(line.split_whitespace())
        .env_remove("RUST_LOG")
        .env("LAGRANGEGS_WEIGHTS", "no-weights")
        .output()
        .expect("the program starts")
}

#[track_caller]
fn ok(line: &str) -> (String, String) {
    let done = run(line);
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("text");
    let (stdout, stderr) = (text(done.stdout), text(done.stderr));
    assert!(done.status.success(), "{line}: {stderr}");
    (stdout, stderr)
}

#[track_caller]
fn fails(line: &str, word: &str) {
    let done = run(line);
    let stderr = String::from_utf8(done.stderr).expect("text");
    let errors: Vec<&str> = stderr.lines().filter(|line| line.starts_with("error: ")).collect();
    assert!(done.status.code() == Some(1) && errors.len() == 1 && errors[0].contains(word), "{stderr}");
}

/// Whether a driver offers a device.
fn has_device() -> bool {
    let (devices, _) = ok("info --devices --json");
    let found = devices.contains("wgpu:0");
    let required = std::env::var("LAGRANGEGS_GPU").is_ok_and(|value| value == "required");
    assert!(found || !required, "no driver of Vulkan, Metal or DX12 offers a device: {devices}");
    if !found {
        println!("skipped: no driver of Vulkan, Metal or DX12 offers a device");
    }
    found
}

fn metrics(run: &Path) -> serde_json::Value {
    let text = std::fs::read_to_string(run.join("metrics.json")).expect("metrics");
    serde_json::from_str(&text).expect("JSON")
}

#[test]
fn the_demo_runs_to_its_end_and_scores_what_it_does_on_the_processor() {
    if !has_device() {
        return;
    }
    let dir = tempfile::tempdir().expect("a folder");
    let scores = ["cpu", "wgpu:0"].map(|device| {
        let out = dir.path().join(device.replace(':', ""));
        let line = format!("demo --out {} --size 24 --views 3 {TINY} --device {device}", out.display());
        ok(&line);
        let metrics = metrics(&out.join("run"));
        ["source", "lagrangian"].map(|model| {
            metrics["splits"]["val"][model]["psnr"].as_f64().unwrap_or_else(|| panic!("{metrics}"))
        })
    });
    for (cpu, gpu) in scores[0].iter().zip(scores[1]) {
        assert!((cpu - gpu).abs() < 0.3, "PSNR {scores:?}");
    }
}

/// Trains twice on the device, with more arguments: the results have the same bytes, and the processor can go
/// on with the first.
fn assert_same_bytes_twice_and_resumes(more: &str, results: &[&str]) {
    let dir = tempfile::tempdir().expect("a folder");
    let data = dir.path().join("data");
    ok(&format!("synth falling-ball --out {} --size 24 --views 3", data.display()));
    let runs = ["one", "two"].map(|name| dir.path().join(name));
    for run in &runs {
        ok(&format!("train {} --out {} {TINY} {more} --device wgpu", data.display(), run.display()));
    }
    for file in results {
        let [one, two] = runs.each_ref().map(|run| std::fs::read(run.join(file)).expect("a result"));
        assert!(one == two, "{file} differs");
    }
    ok(&format!("train {} --out {} --resume --device cpu", data.display(), runs[0].display()));
}

#[test]
fn a_run_has_the_same_bytes_twice_and_resumes_on_the_processor() {
    if has_device() {
        let results = ["lagrangian.safetensors", "source/defgs.safetensors", "events.jsonl"];
        assert_same_bytes_twice_and_resumes("", &results);
    }
}

#[test]
fn networks_train_on_the_device_and_their_run_resumes_on_the_processor() {
    if has_device() {
        assert_same_bytes_twice_and_resumes("--dynamics networks", &["lagrangian.safetensors"]);
    }
}

#[test]
fn a_device_that_is_not_there_is_one_error() {
    if !has_device() {
        return;
    }
    fails("train data --out nowhere --device wgpu:99", "wgpu:99");
    let absent = Command::new(env!("CARGO_BIN_EXE_lagrangegs"))
        .args(["train", "data", "--out", "nowhere", "--device", "wgpu"])
        .envs([("VK_DRIVER_FILES", "/dev/null"), ("VK_ICD_FILENAMES", "/dev/null")])
        .env("__EGL_VENDOR_LIBRARY_FILENAMES", "/dev/null")
        .output()
        .expect("the program starts");
    let stderr = String::from_utf8(absent.stderr).expect("text");
    assert!(absent.status.code() == Some(1) && stderr.contains("no driver"), "{stderr}");
}
