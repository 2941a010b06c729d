//! `train` and `demo`, with settings that take seconds.

use std::path::Path;

#[cfg(unix)]
use crate::program::interrupted;
use crate::program::{Done, call, edit_json, files, folder, tiny_dataset, unwritable};

/// Settings under which training takes seconds and learns next to nothing.
const TINY: &str = "--set source.iterations=40 --set source.warmup_iterations=20 \
                    --set source.initial_gaussians=400 \
                    --set distill.matching.steps=10 --set distill.rollout.steps=2 \
                    --set refine_gaussians.iterations=2 --set tune_dynamics.iterations=4 \
                    --set tune_gaussians.iterations=4";

fn train(data: &Path, run: &Path, more: &str) -> Done {
    call(&format!("train {{data}} --out {{run}} {TINY} {more}"), &[("data", data), ("run", run)])
}

#[test]
fn a_run_is_trained_measured_rendered_and_exported() {
    let dir = folder();
    let data = tiny_dataset(dir.path());
    let (run, out) = (dir.path().join("run"), dir.path().join("out"));
    let printed = train(&data, &run, "--seed 3").ok();
    assert_eq!(printed.trim(), run.display().to_string(), "results only on stdout");
    for name in ["config.toml", "checkpoints", "source", "lagrangian.safetensors", "events.jsonl"] {
        assert!(run.join(name).exists(), "{name}");
    }
    assert!(std::fs::read_to_string(run.join("config.toml")).expect("config").contains("seed = 3"));
    let paths: [(&str, &Path); 2] = [("run", &run), ("out", &out)];
    let metrics = call("eval {run} --json", &paths).json();
    assert!(metrics["splits"]["val"]["source"]["psnr"].is_f64(), "{metrics}");
    assert!(metrics["cost"]["train_secs"].as_f64().is_some_and(|secs| secs > 0.0));
    let report = std::fs::read_to_string(run.join("report.html")).expect("report");
    assert!(report.contains("lagrangian") && report.contains("<svg"));
    call("render {run} --times -0.5:2:0.5 --camera 0 --out {out}", &paths).ok();
    assert_eq!(files(&out).len(), 8);
    let splats = dir.path().join("splats");
    call("export {run} --times 0:1:0.5 --out {splats}", &[("run", &run), ("splats", &splats)]).ok();
    assert_eq!(files(&splats).len(), 4);
    assert!(call("info {run}", &paths).ok().contains("seed"));
    let checkpoint =
        run.join("checkpoints").join(files(&run.join("checkpoints")).pop().expect("a checkpoint"));
    assert!(call("info {c}", &[("c", &checkpoint)]).ok().contains("checkpoint"));
    // A second run does not overwrite the first; resuming a finished one changes nothing.
    train(&data, &run, "").fails(&run, &["already holds a run"]);
    let scene = std::fs::read(run.join("lagrangian.safetensors")).expect("scene");
    call("train {data} --out {run} --resume", &[("data", &data), ("run", &run)]).ok();
    assert_eq!(scene, std::fs::read(run.join("lagrangian.safetensors")).expect("scene"));
    call("train {data} --out {run} --resume --seed 4", &[("data", &data), ("run", &run)])
        .fails(&run, &["another configuration", "`seed` is 3", "4"]);
    cut_checkpoint_is_an_error(&data, &run, &checkpoint);
}

fn cut_checkpoint_is_an_error(data: &Path, run: &Path, checkpoint: &Path) {
    let whole = std::fs::read(checkpoint).expect("bytes");
    std::fs::write(checkpoint, &whole[..whole.len() / 2]).expect("cut");
    call("train {data} --out {run} --resume", &[("data", data), ("run", run)])
        .fails(checkpoint, &["damaged"]);
    call("info {c}", &[("c", checkpoint)]).fails(checkpoint, &["damaged"]);
}

#[test]
#[cfg(unix)]
fn a_run_that_was_interrupted_resumes_to_the_same_bytes() {
    const MORE: &str = "--set source.iterations=80";
    let dir = folder();
    let data = tiny_dataset(dir.path());
    let (whole, parts) = (dir.path().join("whole"), dir.path().join("parts"));
    train(&data, &whole, MORE).ok();
    let line = format!("train {} --out {} {TINY} {MORE}", data.display(), parts.display());
    let code = interrupted(&line.split_whitespace().collect::<Vec<_>>(), &parts);
    assert!(code == Some(1) || code == Some(0), "{code:?}");
    call("train {data} --out {run} --resume", &[("data", &data), ("run", &parts)]).ok();
    for name in ["lagrangian.safetensors", "source/defgs.safetensors", "events.jsonl"] {
        assert!(
            std::fs::read(whole.join(name)).expect(name) == std::fs::read(parts.join(name)).expect(name),
            "{name} differs"
        );
    }
}

#[test]
fn a_velocity_field_is_a_source_like_any_other() {
    let dir = folder();
    let data = tiny_dataset(dir.path());
    let (run, out) = (dir.path().join("run"), dir.path().join("out"));
    train(&data, &run, "--source freegave").ok();
    let paths: [(&str, &Path); 3] = [("data", &data), ("run", &run), ("out", &out)];
    call("train {data} --out {run} --source defgs --resume", &paths)
        .fails(&run, &["another configuration", "`source.kind`"]);
    let metrics = call("eval {run} --json", &paths).json();
    assert!(metrics["splits"]["long"]["source"]["psnr"].is_f64(), "{metrics}");
    call("render {run} --times 0:1:0.5 --camera 0 --model source --out {out}", &paths).ok();
    assert_eq!(files(&out).len(), 5);
    assert!(call("info {run}", &paths).ok().contains("freegave"));
    let model = run.join("source/freegave.safetensors");
    assert!(call("info {model}", &[("model", &model)]).ok().contains("freegave"));
    let whole = std::fs::read(&model).expect("bytes");
    std::fs::write(&model, &whole[..whole.len() / 2]).expect("cut");
    call("eval {run}", &paths).fails(&model, &["damaged"]);
}

#[test]
fn settings_that_do_not_exist_are_named() {
    let dir = folder();
    let (data, run) = (dir.path().join("data"), dir.path().join("run"));
    for (setting, word) in
        [("source.iteration=3", "source.iteration"), ("source.iterations=many", "source.iterations")]
    {
        let done =
            call(&format!("train {{data}} --out {{run}} --set {setting}"), &[("data", &data), ("run", &run)]);
        done.is_bad_usage(&[word]);
    }
    let config = dir.path().join("c.toml");
    std::fs::write(&config, "seed = = 1").expect("write");
    let paths: [(&str, &Path); 3] = [("data", &data), ("run", &run), ("config", &config)];
    call("train {data} --out {run} --config {config}", &paths).fails(&config, &["TOML"]);
    std::fs::write(&config, "[source]\niterations = \"many\"").expect("write");
    call("train {data} --out {run} --config {config}", &paths).fails(&config, &["source.iterations"]);
    assert!(!run.exists());
}

#[test]
fn runs_that_cannot_be_started_or_resumed_are_named() {
    let dir = folder();
    let data = tiny_dataset(dir.path());
    let run = unwritable(dir.path());
    assert_eq!(train(&data, &run, "").code, 1);
    let none = dir.path().join("none");
    call("train {data} --out {run} --resume", &[("data", &data), ("run", &none)])
        .fails(&none.join("config.toml"), &["no run to resume"]);
    assert_eq!(call("train {data} --out {run} --source magic", &[("data", &data), ("run", &none)]).code, 2);
    assert!(!none.exists());
}

#[test]
fn the_demo_tells_the_whole_story() {
    let dir = folder();
    let out = dir.path().join("demo");
    let table = call(&format!("demo --out {{out}} --size 24 --views 3 {TINY}"), &[("out", &out)]).ok();
    for word in ["train", "val", "test", "long", "past", "source", "lagrangian", "cycle error"] {
        assert!(table.contains(word), "{word}: {table}");
    }
    let renders = out.join("run/renders");
    for name in ["future", "past", "potential-0.25", "potential-2", "potential-scales.png", "comparison.png"]
    {
        assert!(renders.join(name).exists(), "{name}");
    }
    assert!(renders.join("future/sheet.png").exists());
    assert!(out.join("run/metrics.json").exists());
}

#[test]
fn a_still_scene_is_trained_measured_rendered_and_exported() {
    let dir = folder();
    let data = tiny_dataset(dir.path());
    for split in ["train", "val", "test"] {
        edit_json(&data.join(format!("transforms_{split}.json")), |json| {
            for frame in json["frames"].as_array_mut().expect("frames") {
                frame.as_object_mut().expect("a frame").remove("time");
            }
        });
    }
    let kept = ["train", "val", "test"].map(|split| format!("transforms_{split}.json"));
    for other in files(&data) {
        if other.starts_with("transforms_") && !kept.contains(&other) {
            std::fs::remove_file(data.join(other)).expect("remove");
        }
    }
    std::fs::remove_file(data.join("ground_truth.safetensors")).expect("remove");
    let (run, out) = (dir.path().join("run"), dir.path().join("out"));
    let paths: [(&str, &Path); 3] = [("data", &data), ("run", &run), ("out", &out)];
    assert!(call("info {data}", &paths).ok().contains("a still scene"));
    let done = train(&data, &run, "");
    assert!(done.stderr.contains("no motion is learned"), "{}", done.stderr);
    done.ok();
    let metrics = call("eval {run} --json", &paths).json();
    let scores = |model: &str| metrics["splits"]["test"][model]["psnr"].as_f64().expect("a score");
    assert!((scores("source") - scores("lagrangian")).abs() < 0.01, "{metrics}");
    assert_eq!(metrics["footprint"]["objects"], 0);
    assert!(std::fs::read_to_string(run.join("report.html")).expect("report").contains("<svg"));
    call("report {run}", &paths).ok();
    call("render {run} --times 0,0.5 --camera 0 --out {out}", &paths).ok();
    let images: Vec<_> = files(&out).into_iter().filter(|name| name.ends_with("000.png")).collect();
    let [first, second] = &images[..] else { panic!("{images:?}") };
    let read = |name: &String| std::fs::read(out.join(name)).expect("image");
    assert!(read(first) == read(second), "nothing moves");
    call("render {run} --times 0 --model source --camera 0 --out {out}", &paths).ok();
    call("export {run} --times 0 --out {out}/still.ply", &paths).ok();
    assert!(call("info {run}", &paths).ok().contains("linear"));
    train(&data, &run, "--resume").ok();
}

#[test]
fn images_of_too_short_a_time_are_refused_before_training() {
    let dir = folder();
    let data = tiny_dataset(dir.path());
    edit_json(&data.join("transforms_train.json"), |json| {
        for frame in json["frames"].as_array_mut().expect("frames") {
            frame["time"] = (0.01 * frame["time"].as_f64().expect("a time")).into();
        }
    });
    let run = dir.path().join("run");
    train(&data, &run, "").fails(&data, &["end at time", "0.07"]);
    assert!(!run.exists(), "before anything is written");
}
