//! `render` into videos, along camera paths, beside something else and under labels.

use std::path::Path;

use serde_json::json;

use crate::program::{call, falling, falling_alone, files, json_file, unwritable};

/// Width, height and delays (hundredths of a second) of a GIF.
fn gif(path: &Path) -> (u16, u16, Vec<u16>) {
    let file = std::fs::File::open(path).expect("a file");
    let mut decoder = gif::DecodeOptions::new().read_info(file).expect("a GIF");
    let mut delays = Vec::new();
    while let Some(frame) = decoder.read_next_frame().expect("a frame") {
        delays.push(frame.delay);
    }
    (decoder.width(), decoder.height(), delays)
}

#[test]
fn a_video_has_one_frame_per_time() {
    let (dir, run) = falling_alone();
    let out = dir.path().join("a/film.gif");
    let paths: [(&str, &Path); 2] = [("run", &run), ("out", &out)];
    let said = call("render {run} --times 0:1:0.25 --size 40 --fps 10 --out {out}", &paths).ok();
    assert!(said.contains("5 frames"), "{said}");
    assert_eq!(gif(&out), (40, 40, vec![10; 5]));
    assert_eq!(files(out.parent().expect("a folder")), ["film.gif"]);
}

#[test]
fn what_cannot_be_written_is_said_before_anything_is_drawn() {
    let (dir, run) = falling_alone();
    let refuse = |out: &Path, flags: &str, words: &[&str]| {
        let paths: [(&str, &Path); 2] = [("run", &run), ("out", out)];
        // Ten thousand frames would take minutes.
        let line = format!("render {{run}} --times 0:1:0.0001 {flags} --out {{out}}");
        call(&line, &paths)
            .fails(if words.is_empty() { out.parent().expect("a folder") } else { out }, words);
    };
    refuse(&unwritable(dir.path()).join("film.gif"), "", &[]);
    refuse(&dir.path().join("film.gif"), "--fps 60", &["1 to 50"]);
    refuse(&dir.path().join("film.mp4"), "--size 8", &["16"]);
    for (name, flags, word) in [("film.mov", "", ".mp4, .webm or .gif"), ("frames", "--fps 10", "--fps")] {
        let out = dir.path().join(name);
        let paths: [(&str, &Path); 2] = [("run", &run), ("out", &out)];
        call(&format!("render {{run}} --times 0:1:0.0001 {flags} --out {{out}}"), &paths)
            .is_bad_usage(&[word]);
        assert!(!out.exists());
    }
    std::fs::create_dir(dir.path().join("b.gif")).expect("a folder");
    refuse(&dir.path().join("b.gif"), "", &["folder"]);
}

#[test]
fn the_name_of_one_file_stands_for_one_time() {
    let (dir, run) = falling_alone();
    let path = |name: &str| dir.path().join(name);
    let [picture, splats, frames] = ["new/a.png", "a.ply", "frames"].map(path);
    let paths: [(&str, &Path); 4] = [("run", &run), ("png", &picture), ("ply", &splats), ("frames", &frames)];
    for line in [
        "render {run} --times 0,1 --out {png}",
        "render {run} --times 0 --out {png}.jpg",
        "export {run} --times 0,1 --out {ply}",
        "export {run} --times 0 --format splat --out {ply}",
    ] {
        call(line, &paths).is_bad_usage(&["go into a folder"]);
    }
    call("render {run} --times 0 --size 20 --out {png}", &paths).ok();
    assert_eq!(image::open(&picture).expect("a PNG").width(), 20);
    call("export {run} --times 0.5 --out {frames}", &paths).ok();
    let info = call("info {frames}", &paths).ok();
    assert!(info.contains("1 at 0.5") && info.contains("67"), "{info}");
    call("convert {frames} {ply}", &paths).is_bad_usage(&["frames go into a folder"]);
    assert!(!splats.exists());
}

#[test]
fn a_path_from_a_file_brings_its_own_times_and_cameras() {
    let (dir, run) = falling_alone();
    let path = dir.path().join("path.json");
    let key = |seconds: f64, time: f64, depth: f64| {
        json!({"seconds": seconds, "time": time, "fx": 40, "fy": 40, "cx": 24, "cy": 16, "camera_from_world":
               [[1, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, depth], [0, 0, 0, 1]]})
    };
    let keys = [key(0.0, 0.5, 2.0), key(0.4, -0.5, 4.0)];
    let file = json!({"format": "lagrangegs-camera-path/1", "width": 48, "height": 32, "keyframes": keys});
    std::fs::write(&path, file.to_string()).expect("written");
    let out = dir.path().join("film.gif");
    let paths: [(&str, &Path); 3] = [("run", &run), ("out", &out), ("path", &path)];
    call("render {run} --camera {path} --fps 10 --out {out}", &paths).ok();
    assert_eq!(gif(&out), (48, 32, vec![10; 5]));
    let frames = dir.path().join("frames");
    let paths: [(&str, &Path); 3] = [("run", &run), ("out", &frames), ("path", &path)];
    call("render {run} --camera {path} --times 0,1 --out {out}", &paths).ok();
    assert_eq!(json_file(&frames.join("frames.json"))["frames"][1]["time"], 1.0);
    std::fs::write(&path, file.to_string().replace("-0.5", "-5.0")).expect("written");
    call("render {run} --camera {path} --out {out}", &paths).fails(&path, &["outside"]);
    std::fs::write(&path, "{}").expect("written");
    call("render {run} --camera {path} --out {out}", &paths).fails(&path, &["no camera path"]);
}

#[test]
fn frames_stand_beside_others_under_labels() {
    let (dir, _, run) = falling();
    let width = |line: &str| {
        let out = dir.path().join("out");
        call(&format!("render {{run}} --times 0.5 {line} --out {{out}}"), &[("run", &run), ("out", &out)])
            .ok();
        let image = image::open(out.join("0000_t+0.5000.png")).expect("a PNG");
        [image.width(), image.height()]
    };
    let camera = "--camera val/r_0000";
    let [plain, labelled] = [width(camera), width(&format!("{camera} --label"))];
    assert!(labelled[1] > plain[1] && labelled[0] < 2 * plain[0], "{labelled:?}");
    for what in ["unedited --velocity-scale 2", "truth"] {
        assert!(width(&format!("{camera} --compare {what}"))[0] > 2 * plain[0], "{what}");
    }
    let out = dir.path().join("out");
    let paths: [(&str, &Path); 2] = [("run", &run), ("out", &out)];
    call("render {run} --times 0 --compare truth --out {out}", &paths).fails(&run, &["--camera NAME"]);
    call("render {run} --times 0 --compare source --out {out}", &paths).fails(&run, &["no source model"]);
}

#[cfg(feature = "av1")]
#[test]
fn an_mp4_and_a_webm_are_written() {
    let (dir, run) = falling_alone();
    for (name, mark) in [("film.mp4", &b"ftyp"[..]), ("film.webm", b"webm")] {
        let out = dir.path().join(name);
        let paths: [(&str, &Path); 2] = [("run", &run), ("out", &out)];
        call("render {run} --times 0:0.5:0.1 --size 40 --label --out {out}", &paths).ok();
        let bytes = std::fs::read(&out).expect("a file");
        assert!(bytes[..128].windows(4).any(|window| window == mark), "{name}");
    }
}
