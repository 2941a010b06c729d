//! Recordings for rerun's viewer.

use std::path::Path;

use crate::program::{call, falling};

/// Flags of a training that takes seconds.
#[cfg(feature = "rerun")]
const SHORT: &str = "--set source.iterations=30 --set source.warmup_iterations=10 \
                     --set source.initial_gaussians=200 --last-stage 1";

#[cfg(not(feature = "rerun"))]
#[test]
fn a_build_without_recordings_says_how_to_get_one_before_anything_is_done() {
    let (dir, data, run) = falling();
    let (out, file) = (dir.path().join("new"), dir.path().join("a.rrd"));
    let paths: [(&str, &Path); 4] = [("data", &data), ("run", &run), ("out", &out), ("file", &file)];
    let words = ["this build writes no recordings", "--features rerun"];
    call("train {data} --out {out} --rerun {file}", &paths).fails(&file, &words);
    assert!(!out.exists(), "no run was begun");
    call("render {run} --times 0:1:0.0001 --out {file}", &paths).fails(&file, &words);
    assert!(!file.exists());
}

#[test]
fn a_recording_inside_a_dataset_or_with_flags_of_videos_is_refused() {
    let (dir, data, run) = falling();
    let inside = data.join("a.rrd");
    let out = dir.path().join("new");
    let paths: [(&str, &Path); 4] = [("data", &data), ("run", &run), ("out", &out), ("file", &inside)];
    call("train {data} --out {out} --rerun {file}", &paths).fails(&inside, &["inside a dataset"]);
    let file = dir.path().join("a.rrd");
    let paths: [(&str, &Path); 2] = [("run", &run), ("file", &file)];
    for flags in ["--label", "--compare unedited", "--fps 10"] {
        call(&format!("render {{run}} --times 0 {flags} --out {{file}}"), &paths)
            .is_bad_usage(&["not for recordings"]);
    }
}

#[cfg(feature = "rerun")]
#[test]
fn training_and_playback_are_recorded() {
    let (dir, data, run) = falling();
    let [trained, playback] = ["train/a.rrd", "play/a.rrd"].map(|name| dir.path().join(name));
    let out = dir.path().join("new");
    let paths: [(&str, &Path); 3] = [("data", &data), ("out", &out), ("file", &trained)];
    call(&format!("train {{data}} --out {{out}} {SHORT} --rerun {{file}}"), &paths).ok();
    let paths: [(&str, &Path); 2] = [("run", &run), ("file", &playback)];
    let said = call("render {run} --times 0:1:0.25 --size 40 --out {file}", &paths).ok();
    assert!(said.contains("a recording of 5 times"), "{said}");
    for path in [trained, playback] {
        assert!(std::fs::read(&path).expect("a recording").starts_with(b"RRF2"), "{}", path.display());
        assert_eq!(crate::program::files(path.parent().expect("a folder")), ["a.rrd"]);
    }
}

#[cfg(feature = "rerun")]
#[test]
fn what_cannot_be_recorded_is_said_before_training_begins() {
    let dir = crate::program::folder();
    let data = crate::program::tiny_dataset(dir.path());
    let out = dir.path().join("new");
    let refuse = |file: &Path, about: &Path, words: &[&str]| {
        let paths: [(&str, &Path); 3] = [("data", &data), ("out", &out), ("file", file)];
        call("train {data} --out {out} --rerun {file}", &paths).fails(about, words);
        assert!(!out.exists());
    };
    let taken = dir.path().join("b.rrd");
    std::fs::create_dir(&taken).expect("a folder");
    refuse(&taken, &taken, &["no file"]);
    let name = dir.path().join("a.txt");
    refuse(&name, &name, &[".rrd"]);
    let below = crate::program::unwritable(dir.path()).join("a.rrd");
    refuse(&below, below.parent().expect("a folder"), &[]);
}
