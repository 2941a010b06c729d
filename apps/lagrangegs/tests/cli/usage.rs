//! Bad usage exits with 2, help with 0.

use crate::program::{call, folder, lagrangegs};

#[test]
fn help_and_version_are_no_errors() {
    for command in [
        "--help",
        "demo --help",
        "synth --help",
        "train --help",
        "eval --help",
        "render --help",
        "export --help",
        "convert --help",
        "info --help",
        "weights --help",
    ] {
        assert!(call(command, &[]).ok().contains("Usage"), "{command}");
    }
    assert!(lagrangegs(&["--version"]).ok().starts_with("lagrangegs "));
}

#[test]
fn unknown_or_missing_arguments_are_bad_usage() {
    for (line, word) in [
        ("", "Usage"),
        ("paint", "paint"),
        ("synth", "SCENE"),
        ("synth fan", "--out"),
        ("train data", "--out"),
        ("train data --out x --preset slow", "slow"),
        ("train data --out x --set seed", "KEY=VALUE"),
        ("train data --out x --device tpu", "tpu"),
        ("eval", "RUN"),
        ("render run --out x", "--times"),
        ("render run --times 0 --out x --reversal none", "none"),
        ("render run --times 0 --out x --potential-scale much", "much"),
        ("render run --times 0 --out x --potential-scale nan", "nan"),
        ("render run --times 0 --out x --size 0", "0"),
        ("render run --times 0 --out x --camera orbit:left", "left"),
        ("render run --times 0 --out x.avi", ".mp4"),
        ("render run --times 0 --out x --model source --potential-scale 2", "no physics"),
        ("export run --times 0 --out x --model source --velocity-scale 2", "no physics"),
        ("export run --times 0 --out x --format obj", "obj"),
        ("eval run --split=", "a split needs a name"),
        ("eval run --split=val,,test", "a split needs a name"),
        ("import data x --every 0", "1 or more"),
        ("import data x --test-every 0", "1 or more"),
        ("convert one.ply", "OUT"),
        ("info", "PATH"),
        ("weights import", "FILE"),
    ] {
        call(line, &[]).is_bad_usage(&[word]);
    }
}

#[test]
fn kinds_of_terms_are_listed_with_parameters_and_the_scale_that_edits_them() {
    let table = call("info --terms", &[]).ok();
    let field = table.lines().find(|line| line.starts_with("uniform-field")).expect("a row");
    assert!(field.contains("--potential-scale") && field.contains("[u/t²]"), "{field}");
    let kinds = call("info --terms --json", &[]).json();
    let drag = kinds.as_array().expect("a list").iter().find(|kind| kind["kind"] == "quadratic-drag");
    let drag = drag.expect("quadratic drag");
    assert_eq!((&drag["role"], &drag["scaled_by"]), (&"dissipates".into(), &"--force-scale".into()));
    assert_eq!(drag["parameters"][0]["unit"], "1/u");
    call("info --terms --rig a.svg", &[]).is_bad_usage(&["--terms"]);
}

#[test]
fn the_processor_is_listed_and_other_devices_say_what_they_need() {
    assert!(call("info --devices", &[]).ok().starts_with("cpu"));
    assert_eq!(call("info --devices --json", &[]).json()[0]["name"], "cpu");
    let out = folder();
    let run = out.path().join("run");
    let done = call("train data --out {run} --device wgpu:999", &[("run", &run)]);
    assert_eq!(done.code, 1);
    let errors: Vec<&str> = done.stderr.lines().filter(|line| line.starts_with("error: ")).collect();
    let word = if cfg!(feature = "gpu") { "wgpu:999" } else { "--features gpu" };
    assert!(errors.len() == 1 && errors[0].contains(word), "{}", done.stderr);
    assert!(!run.exists());
}

#[test]
fn times_that_do_not_parse_are_bad_usage() {
    for times in ["x", "0:1", "0:1:0", "1:0:0.1", "0:1:-1", "nan"] {
        lagrangegs(&["render", "run", "--out", "x", "--times", times]).is_bad_usage(&["--times"]);
    }
}

#[test]
fn the_scenes_are_listed() {
    let list = call("synth --list", &[]).ok();
    for scene in ["falling-ball", "fan", "projectile", "pendulum", "spring", "sled", "room"] {
        assert!(list.lines().any(|line| line.starts_with(scene)), "{scene}: {list}");
    }
}

#[test]
fn nothing_is_written_by_bad_usage() {
    let dir = folder();
    let out = dir.path().join("out");
    call("render run --times 1:0:1 --out {out}", &[("out", &out)]).is_bad_usage(&[]);
    assert!(!out.exists());
}
