//! Sources from elsewhere: frames and official models in, a Lagrangian scene out.

use std::path::{Path, PathBuf};

use crate::program::{call, falling_run, files, folder, tiny_dataset};
use lagrangegs::lgs_core::{nearest_indices, spatial_order};
use lagrangegs::lgs_data::ply::read_ply;
use lagrangegs::lgs_data::testing::{CheckpointEntry, checkpoint};
use lagrangegs::lgs_model::load_scene;

/// Frames of a block in free fall, 25 of them in the captured window, and the run that they were exported
/// from.
fn frames(folder: &Path) -> (PathBuf, PathBuf) {
    let run = falling_run(folder, folder);
    let frames = folder.join("frames");
    call("export {run} --times 0:0.72:0.03 --out {frames}", &[("run", &run), ("frames", &frames)]).ok();
    (frames, run)
}

fn means_at(run: &Path, time: &str) -> Vec<[f32; 3]> {
    let file = run.join("one.ply");
    call(&format!("export {{run}} --times={time} --out {{file}}"), &[("run", run), ("file", &file)]).ok();
    read_ply(&file).expect("ply").means
}

#[test]
fn frames_alone_give_the_scene_that_they_came_from() {
    let dir = folder();
    let (frames, original) = frames(dir.path());
    let run = dir.path().join("imported");
    let paths: [(&str, &Path); 2] = [("frames", &frames), ("run", &run)];
    call("train --source frames {frames} --out {run}", &paths).ok();
    for time in ["0", "2.1", "-0.7"] {
        let (found, expected) = (means_at(&run, time), means_at(&original, time));
        assert_eq!(found.len(), expected.len());
        // A scene has an order of its own.
        for (points, others) in [(&found, &expected), (&expected, &found)] {
            for (&i, p) in nearest_indices(others, points).iter().zip(points) {
                let q = others[i as usize];
                assert!((0..3).all(|c| (p[c] - q[c]).abs() < 0.01), "t = {time}: {p:?} beside {q:?}");
            }
        }
    }
    let scene = load_scene(&run.join("lagrangian.safetensors")).expect("scene");
    assert!(
        spatial_order(&scene.dynamic_gaussians.means).into_iter().eq(0..64),
        "the body is in spatial order"
    );
    let metrics = call("eval {run} --json", &paths).json();
    assert!(metrics["splits"].as_object().is_some_and(serde_json::Map::is_empty), "there are no images");
    assert!((metrics["physics"]["fall_time_exponent"]["slope"].as_f64().expect("slope") + 0.5).abs() < 0.01);
    let info = call("info {run}", &paths).ok();
    assert!(info.contains("frames, 67 Gaussians"), "{info}");
    let again = dir.path().join("again");
    call(
        "export {run} --model source --times 0:0.72:0.03 --out {again}",
        &[("run", &run), ("again", &again)],
    )
    .ok();
    assert_eq!(files(&again), files(&frames));
    let name = &files(&frames)[7];
    assert_eq!(
        read_ply(&again.join(name)).expect("ply").means,
        read_ply(&frames.join(name)).expect("ply").means
    );
}

#[test]
fn with_a_dataset_all_stages_run_and_only_times_with_frames_are_scored() {
    let dir = folder();
    let data = tiny_dataset(dir.path());
    let (frames, _) = frames(dir.path());
    let run = dir.path().join("imported");
    let paths: [(&str, &Path); 3] = [("frames", &frames), ("run", &run), ("data", &data)];
    let few = "--set refine_gaussians.iterations=2 --set tune_dynamics.iterations=2 \
               --set tune_gaussians.iterations=2";
    call(&format!("train {{data}} --source frames --import {{frames}} --out {{run}} {few}"), &paths).ok();
    let metrics = call("eval {run} --split val,test --json", &paths).json();
    let score = |split: &str, model: &str| metrics["splits"][split][model].clone();
    assert!(score("test", "source").is_null(), "the frames end before");
    assert!(score("test", "lagrangian")["psnr"].is_f64() && score("val", "lagrangian")["psnr"].is_f64());
}

#[test]
fn frames_that_do_not_fit_are_refused_before_a_run_is_made() {
    let dir = folder();
    let (frames, _) = frames(dir.path());
    let out = dir.path().join("out");
    let refused = |path: &Path, words: &[&str]| {
        call("train --source frames {frames} --out {out}", &[("frames", &frames), ("out", &out)])
            .fails(path, words);
        assert!(!out.exists());
    };
    let list = frames.join("frames.json");
    let whole = std::fs::read(&list).expect("list");
    std::fs::write(&list, "{\"frames\": [{\"file\": \"frame0001.ply\"}]}").expect("write");
    refused(&list, &["has no time"]);
    std::fs::remove_file(&list).expect("remove");
    let named = frames.join("frame0004.ply");
    std::fs::rename(&named, frames.join("third.ply")).expect("rename");
    refused(&frames, &["`frame0001.ply` has no time"]);
    std::fs::rename(frames.join("third.ply"), &named).expect("rename");
    let bytes = std::fs::read(&named).expect("frame");
    std::fs::write(&named, &bytes[..bytes.len() - 4]).expect("cut");
    refused(&named, &["vertex"]);
    std::fs::write(&named, bytes).expect("restore");
    std::fs::write(&list, whole).expect("restore");
    let listed = |from: usize, to: usize| {
        let frame = |i: usize| format!(r#"{{"file": "frame000{i}.ply", "time": 0.{i}}}"#);
        let text = format!(r#"{{"frames": [{}]}}"#, (from..to).map(frame).collect::<Vec<_>>().join(", "));
        std::fs::write(&list, text).expect("write");
    };
    listed(3, 8);
    refused(&frames, &["frames from t = 0 on", "the first at t = 0.3"]);
    listed(3, 5);
    refused(&frames, &["at least 5 times", "2 times"]);
    call("train --source frames --out {out}", &[("out", &out)]).is_bad_usage(&["DATA"]);
}

#[test]
fn official_models_are_refused_with_what_is_wrong_with_them() {
    let dir = folder();
    let model = dir.path().join("model");
    let (gaussians, network) = (model.join("point_cloud/iteration_5"), model.join("deform/iteration_5"));
    std::fs::create_dir_all(&gaussians).expect("folder");
    std::fs::create_dir_all(&network).expect("folder");
    let out = dir.path().join("out");
    let refused = |path: &Path, words: &[&str]| {
        call("train --import {model} --out {out}", &[("model", &model), ("out", &out)]).fails(path, words);
        assert!(!out.exists());
    };
    let file = network.join("deform.pth");
    refused(&file, &["No such file"]);
    let call_of = CheckpointEntry::Call("posix", "system", "touch executed");
    std::fs::write(&file, checkpoint(&[("linear.0.weight", call_of)])).expect("write");
    refused(&file, &["`linear.0.weight`", "`posix.system`, which is not run"]);
    std::fs::write(
        &file,
        &checkpoint(&[("linear.0.weight", CheckpointEntry::Tensor(&[2, 84], &[0.0; 168]))])[..90],
    )
    .expect("write");
    refused(&file, &["can't read the PyTorch checkpoint"]);
}
