//! `train --resume`: what the run says itself, and what flags may not change. Folders that hold no run.

use std::path::Path;

use crate::program::{call, falling_alone, files, folder, tiny_dataset};

#[test]
fn a_run_of_frames_resumes_without_its_flags() {
    let (dir, original) = falling_alone();
    let (frames, run) = (dir.path().join("frames"), dir.path().join("imported"));
    let paths: [(&str, &Path); 3] = [("original", &original), ("frames", &frames), ("run", &run)];
    call("export {original} --times 0:0.72:0.03 --out {frames}", &paths).ok();
    std::fs::create_dir(&run).expect("a folder");
    std::fs::write(run.join("train.log"), "what the shell has put here").expect("a log");
    call("train --source frames {frames} --out {run} --seed 2", &paths).ok();
    let scene = run.join("lagrangian.safetensors");
    let bytes = std::fs::read(&scene).expect("a scene");
    for call_again in [
        "train {frames} --out {run} --resume",
        "train --out {run} --resume",
        "train --source frames {frames} --out {run} --resume",
        "train --import {frames} --out {run} --resume --seed 2",
    ] {
        call(call_again, &paths).ok();
        assert!(bytes == std::fs::read(&scene).expect("a scene"), "{call_again}");
    }
    for (flags, words) in [
        ("--seed 3", ["`seed` is 2", "asked for is 3"]),
        ("--preset paper", ["`preset` is \"quick\"", "\"paper\""]),
        ("--set distill.rollout.steps=7", ["`distill.rollout.steps`", "asked for is 7"]),
        ("--import {original}", ["`source.import`", "frames"]),
    ] {
        call(&format!("train --out {{run}} --resume {flags}"), &paths)
            .fails(&run, &[&["another configuration"], &words[..]].concat());
    }
    call("train --out {run} --resume --set distill.rollout.step=7", &paths).is_bad_usage(&["unknown key"]);
    assert!(bytes == std::fs::read(&scene).expect("a scene"));
}

#[test]
fn a_folder_that_a_run_would_mix_with_is_no_place_for_it() {
    let dir = folder();
    let data = tiny_dataset(dir.path());
    let out = dir.path().join("thesis");
    std::fs::create_dir_all(out.join("figures")).expect("folders");
    std::fs::write(out.join("chapter.tex"), "mine").expect("a file");
    let paths: [(&str, &Path); 2] = [("data", &data), ("out", &out)];
    call("train {data} --out {out}", &paths).fails(&out, &["no run", "figures"]);
    assert_eq!(files(&out), ["chapter.tex", "figures"]);
}
