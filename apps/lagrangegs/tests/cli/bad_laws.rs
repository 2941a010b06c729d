//! Laws, tracks and edits that are wrong: one line each that names the file and what is wrong.

use std::path::{Path, PathBuf};

use lagrangegs::lgs_mechanics::Law;
use lagrangegs::lgs_mechanics::bands::{Known, Verdict};
use lagrangegs::lgs_mechanics::coordinates::{Bodies, State};
use lagrangegs::lgs_model::{
    Dynamics, GeneralisedDynamics, LagrangianScene, TensorFile, load_scene, scene_to_tensors,
};

use crate::program::{call, falling, falling_alone, json_file};

const GRAVITY: &str = r#"{ "coordinates": { "kind": "point" }, "step": 0.01, "terms": [
    { "kind": "uniform-field", "on": "whole",
      "parameters": { "field-x": 0.0, "field-y": 0.0, "field-z": -2.0 } }] }"#;

/// The scene of a run by hand, its object under the law of gravity, which explains its motion to t = 1.5.
fn under_gravity(run: &Path) -> LagrangianScene {
    let mut scene = load_scene(&run.join("lagrangian.safetensors")).expect("scene");
    let law: Law = serde_json::from_str(GRAVITY).expect("law");
    let start = State { x: vec![0.15, 0.15, 0.15], v: vec![0.0; 3] };
    let known = Known { verdict: Verdict::Explained, trusted: [-0.5, 1.5], ..Known::default() };
    scene.objects[0].dynamics =
        Dynamics::Generalised(GeneralisedDynamics { law, bodies: Bodies::default(), start, known });
    scene
}

/// Writes a scene with a change of its file into the run; returns the path of the file.
fn write(run: &Path, scene: &LagrangianScene, change: impl FnOnce(&mut TensorFile)) -> PathBuf {
    let path = run.join("lagrangian.safetensors");
    let mut file = scene_to_tensors(scene, "lagrangegs-scene/2");
    change(&mut file);
    file.save(&path).expect("save");
    path
}

#[test]
fn laws_that_cannot_be_are_named() {
    let (_dir, run) = falling_alone();
    let scene = under_gravity(&run);
    let refused = |key: &str, entry: &str, words: &[&str]| {
        let path = write(&run, &scene, |file| file.set_metadata(key, entry.to_owned()));
        for command in ["render {run} --times 0 --out {run}/out", "info {run}"] {
            call(command, &[("run", &run)]).fails(&path, words);
        }
    };
    let law = |from: &str, to: &str| GRAVITY.replace(from, to);
    let unknown = law("uniform-field", "perpetual-motion");
    refused("object.0.law", &unknown, &["`object.0.law`", "unknown term `perpetual-motion`", "linear-drag"]);
    let size = ["`object.0.start`", "x of a state in point coordinates: 3 values expected, 2 found"];
    refused("object.0.start", r#"{"x": [0.0, 0.0], "v": [0.0, 0.0, 0.0]}"#, &size);
    let impulse = |time: f64| format!(r#"{{ "time": {time}, "change": [0.0, 0.0, 1.0] }}"#);
    let impulses = law("\"step\"", &format!(r#""impulses": [{}, {}], "step""#, impulse(0.5), impulse(0.25)));
    refused(
        "object.0.law",
        &impulses,
        &["impulse 1 of a law is at time 0.25, not after the one before at 0.5"],
    );
    let short = law("\"step\"", r#""impulses": [{ "time": 0.1, "change": [0.0] }], "step""#);
    refused("object.0.law", &short, &["change of velocity of impulse 0: 3 values expected, 1 found"]);
}

#[test]
fn objects_that_share_gaussians_are_named() {
    let (_dir, run) = falling_alone();
    let mut scene = under_gravity(&run);
    scene.objects.push(scene.objects[0].clone());
    scene.objects[0].members = 0..40;
    scene.objects[1].members = 30..64;
    let path = write(&run, &scene, |_| ());
    let words = ["`object.1.rows`", "from row 40 on", "row 30, which object 0 has already"];
    call("info {run}", &[("run", &run)]).fails(&path, &words);
}

#[test]
fn tracks_of_fewer_than_five_times_are_refused() {
    let (dir, run) = falling_alone();
    let (tracks, out) = (dir.path().join("tracks"), dir.path().join("out"));
    let paths: [(&str, &Path); 3] = [("run", &run), ("tracks", &tracks), ("out", &out)];
    call("export {run} --times 0:0.6:0.2 --out {tracks}", &paths).ok();
    let done = call("train --source frames {tracks} --out {out}", &paths);
    done.fails(&tracks, &["expected at least 5 times, found 4 times"]);
    assert!(!out.exists());
}

#[test]
fn edits_outside_of_their_range_are_refused() {
    for command in ["render run --times 0 --out x", "export run --times 0 --out x"] {
        for flag in ["--velocity-scale 11", "--potential-scale -10.5", "--force-scale 1e9"] {
            call(&format!("{command} {flag}"), &[]).is_bad_usage(&["outside its range, -10 to 10"]);
        }
    }
    let (_dir, data, _) = falling();
    let transforms = data.join("transforms_edit-heavy.json");
    let mut split = json_file(&data.join("transforms_val.json"));
    let scales =
        |beta: f64| serde_json::json!({ "velocity_scale": 1.0, "potential_scale": beta, "force_scale": 1.0 });
    split["edit"] = scales(40.0);
    std::fs::write(&transforms, split.to_string()).expect("write");
    let words = ["`potential_scale`", "scale 40 of an edit is outside its range, -10 to 10"];
    call("info {data}", &[("data", &data)]).fails(&transforms, &words);
    split["edit"] = scales(2.0);
    std::fs::write(&transforms, split.to_string()).expect("write");
    call("info {data}", &[("data", &data)]).ok();
}

#[test]
fn times_beyond_trust_are_marked_everywhere() {
    let (dir, run) = falling_alone();
    let scene = under_gravity(&run);
    write(&run, &scene, |_| ());
    let corner = |out: &Path, name: &str| {
        let image = image::open(out.join(name)).expect("a PNG").to_rgb8();
        image.get_pixel(image.width() - 1, 0).0
    };
    let marked = |flags: &str, name: &str| {
        let out = dir.path().join(name);
        let line = format!("render {{run}} --times=-0.5,1,2 --size 64 --out {{out}} {flags}");
        let done = call(&line, &[("run", &run), ("out", &out)]);
        assert_eq!(done.code, 0, "{}", done.stderr);
        let list = json_file(&out.join("frames.json"));
        let trusted: Vec<bool> = (0..3).map(|i| list["frames"][i]["trusted"] == true).collect();
        let corners = ["0000_t-0.5000.png", "0001_t+1.0000.png", "0002_t+2.0000.png"];
        (done.stderr, trusted, corners.map(|frame| corner(&out, frame) == [213, 94, 0]))
    };
    let (stderr, trusted, corners) = marked("", "plain");
    assert!(stderr.contains("warning: object 0, trusted from t = -0.50 to 1.50"), "{stderr}");
    assert!(stderr.contains("at 1 of 3 times: t = 2.00"), "{stderr}");
    assert_eq!((trusted, corners), (vec![true, true, false], [false, false, true]));
    assert_eq!(marked("--mark-untrusted none", "unmarked").2, [false; 3]);
    let splats = dir.path().join("splats");
    let done = call("export {run} --times 1,2 --out {out}", &[("run", &run), ("out", &splats)]);
    assert!(done.stderr.contains("t = 2.00"), "{}", done.stderr);
    let list = json_file(&splats.join("frames.json"));
    assert_eq!((&list["frames"][0]["trusted"], &list["frames"][1]["trusted"]), (&true.into(), &false.into()));
    assert_eq!(list["frames"][1]["untrusted_objects"], serde_json::json!([0]));
}
