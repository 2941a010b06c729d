//! `bench`, with settings that take seconds.

use std::path::{Path, PathBuf};

use crate::program::{call, folder};
#[cfg(unix)]
use crate::program::{files, interrupted, json_file};

const TINY: &str = r#"name = "tiny"
title = "Tiny"
scenes = ["falling-ball"]
methods = ["defgs"]
variants = ["without-stage-3"]
seeds = [0]
settings = ["source.iterations=80", "source.warmup_iterations=20", "source.initial_gaussians=400",
"distill.matching.steps=10", "distill.rollout.steps=2", "refine_gaussians.iterations=2",
"tune_dynamics.iterations=4", "tune_gaussians.iterations=4"]
[synthetic]
size = 24
views = 3
train_fps = 6
"#;

fn suite_file(folder: &Path, text: &str) -> PathBuf {
    let path = folder.join("suite.toml");
    std::fs::write(&path, text).expect("a suite file");
    path
}

#[test]
#[cfg(unix)]
fn an_interrupted_suite_goes_on_and_its_cells_share_a_source() {
    let dir = folder();
    let (suite, out) = (suite_file(dir.path(), TINY), dir.path().join("out"));
    let paths: [(&str, &Path); 2] = [("s", &suite), ("out", &out)];
    let cells = out.join("cells/falling-ball/defgs");
    let (full, ablated) = (cells.join("full/seed-0"), cells.join("without-stage-3/seed-0"));
    call("bench {s} --out {out} --cell 1", &paths)
        .fails(&ablated, &["source of cell 0", "falling-ball/defgs/full/seed-0"]);
    let words = ["bench", suite.to_str().expect("text"), "--out", out.to_str().expect("text")];
    let code = interrupted(&words, &full);
    assert!(code == Some(1) || code == Some(0), "{code:?}");

    let printed = call("bench {s} --out {out}", &paths).ok();
    assert!(printed.contains("### Tiny: ablations") && printed.contains("without stage 3"), "{printed}");
    let source = |run: &Path| std::fs::read(run.join("source/defgs.safetensors")).expect("source");
    assert!(source(&full) == source(&ablated));
    assert!(
        files(&ablated.join("checkpoints")).iter().all(|name| !name.contains("source")),
        "the source was not trained again"
    );
    let metrics = json_file(&ablated.join("metrics.json"));
    assert_eq!(metrics["cost"]["stages"][0]["stage"], "source", "its cost counts");
    a_finished_suite_only_makes_tables(&paths, &full, &printed);
    // Other settings do not mix with the runs that are there.
    std::fs::write(&suite, TINY.replace("iterations=80", "iterations=90")).expect("write");
    call("bench {s} --out {out} --cell 0", &paths).fails(&full, &["other settings", "in the suite"]);
}

/// Done cells are not run again: the same tables are printed and made, and no run is touched.
#[cfg(unix)]
fn a_finished_suite_only_makes_tables(paths: &[(&str, &Path); 2], run: &Path, printed: &str) {
    let written = || std::fs::metadata(run.join("metrics.json")).expect("metrics").modified().expect("time");
    let before = written();
    assert_eq!(call("bench {s} --out {out}", paths).ok(), printed);
    assert_eq!(written(), before);
    assert_eq!(call("bench {s} --out {out} --tables", paths).ok(), printed);
    let document = call("bench {s} --out {out} --tables --json", paths).json();
    assert!(document["tables"][0]["rows"][1]["entries"][0]["mean"].is_f64(), "{document}");
    for name in ["extrapolation.md", "ablations.csv", "figures.tex", "tables.md", "tables.json"] {
        assert!(paths[1].1.join("tables").join(name).exists(), "{name}");
    }
}

#[test]
fn what_a_suite_does_not_know_is_named_with_what_is_known() {
    let dir = folder();
    for (from, to, words) in [
        ("[\"falling-ball\"]", "[\"falling-bell\"]", ["unknown scene `falling-bell`", "`pendulum`"]),
        ("[\"defgs\"]", "[\"nerf\"]", ["unknown method `nerf`", "`defgs`"]),
        (
            "[\"without-stage-3\"]",
            "[\"without-luck\"]",
            ["unknown variant `without-luck`", "`without-force`"],
        ),
        ("seeds", "seed", ["unknown field `seed`", "`seeds`"]),
        ("source.iterations", "source.iteration", ["unknown key `source.iteration`", "warmup_iterations"]),
    ] {
        let suite = suite_file(dir.path(), &TINY.replace(from, to));
        call("bench {s}", &[("s", &suite)]).fails(&suite, &words);
    }
    let nothing = dir.path().join("nothing");
    call("bench {s}", &[("s", &nothing)]).fails(&nothing, &["`synthetic-objects`"]);
    let suite = suite_file(dir.path(), TINY);
    let out = dir.path().join("out");
    call("bench {s} --out {out} --cell 2", &[("s", &suite), ("out", &out)]).fails(&suite, &["no cell 2"]);
    call("bench", &[]).is_bad_usage(&["SUITE"]);
}

#[test]
fn published_suites_say_which_folder_they_want() {
    let dir = folder();
    let (data, out) = (dir.path().join("sets"), dir.path().join("out"));
    let paths: [(&str, &Path); 2] = [("data", &data), ("out", &out)];
    call("bench nvfi-objects --data {data} --out {out}", &paths)
        .fails(&data, &["Dynamic Object", "fallingball", "transforms_test.json"]);
    assert!(!out.exists());
    let listed = call("bench nvfi-indoor --list --out {out}", &paths).ok();
    assert!(listed.contains("factory/defgs/full/seed-0") && listed.contains("missing"), "{listed}");
    let suites = call("bench --list-suites", &[]).ok();
    assert_eq!(suites.lines().count(), 11, "{suites}");
    let tables = call("bench nvfi-objects --tables --out {out}", &paths).ok();
    assert!(
        tables.contains("27.594") && tables.contains("n/a"),
        "the paper's numbers stand without any run: {tables}"
    );
}
