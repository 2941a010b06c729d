//! Files of other programs: splats of every format, motion capture, outputs of DefGS.

use std::path::Path;

use crate::program::{Done, call, falling_run, files, folder};
use lagrangegs::lgs_core::GaussianCloud;
use lagrangegs::lgs_data::ply::{read_ply, write_ply};
use lagrangegs::lgs_data::testing::{C3d, C3dForm, Processor, checkpoint_archive};

fn convert(input: &Path, out: &Path, flags: &str) -> Done {
    call(&format!("convert {{input}} {{out}} {flags}"), &[("input", input), ("out", out)])
}

fn info(path: &Path) -> String {
    call("info {path}", &[("path", path)]).ok()
}

#[test]
fn frames_are_converted_there_and_back_in_every_format() {
    let dir = folder();
    let path = |name: &str| dir.path().join(name);
    let run = falling_run(dir.path(), dir.path());
    let frames = path("frames");
    call("export {run} --times 0,0.5,0.75 --out {out}", &[("run", &run), ("out", &frames)]).ok();
    for (format, end) in
        [("ply", "ply"), ("compressed-ply", "compressed.ply"), ("splat", "splat"), ("spz", "spz")]
    {
        let (there, back) = (path(format), path(&format!("{format}-back")));
        let said = convert(&frames, &there, &format!("--format {format}")).ok();
        assert!(said.contains("3 frames of 67 Gaussians"), "{said}");
        assert_eq!(files(&there)[2], format!("frame0003.{end}"));
        let facts = info(&there);
        assert!(facts.contains(format) && facts.contains("3 from 0 to 0.75"), "{facts}");
        assert!(info(&there.join(format!("frame0001.{end}"))).contains(format));
        convert(&there, &back, "").ok();
        assert_eq!(files(&back), files(&frames));
        for name in &files(&frames)[..3] {
            let [found, expected] = [&back, &frames].map(|folder| read_ply(&folder.join(name)).expect("ply"));
            for (p, q) in found.means.iter().zip(&expected.means) {
                assert!((0..3).all(|axis| (p[axis] - q[axis]).abs() < 3e-3), "{format}: {p:?} {q:?}");
            }
        }
        let single = path(&format!("single.{end}"));
        call("export {run} --times 0 --out {out}", &[("run", &run), ("out", &single)]).ok();
        convert(&single, &path("again.ply"), "").ok();
        assert_eq!(read_ply(&path("again.ply")).expect("ply").len(), 67);
    }
    let tensors = path("frames.safetensors");
    convert(&frames, &tensors, "").ok();
    assert!(info(&tensors).contains("3 from 0 to 0.75"));
    convert(&tensors, &path("unpacked"), "").ok();
    assert_eq!(files(&path("unpacked")), files(&frames));
}

#[test]
fn what_cannot_be_converted_is_named() {
    let dir = folder();
    let path = |name: &str| dir.path().join(name);
    convert(&path("none.ply"), &path("out.spz"), "").fails(&path("none.ply"), &["no such file"]);
    std::fs::write(path("cut.spz"), b"\x1f\x8b\x08").expect("write");
    convert(&path("cut.spz"), &path("out.ply"), "").fails(&path("cut.spz"), &["decompress"]);
    call("info {p}", &[("p", &path("cut.spz"))]).fails(&path("cut.spz"), &["decompress"]);
    std::fs::create_dir(path("frames")).expect("folder");
    write_ply(&path("frames/frame1.ply"), &GaussianCloud::default()).expect("ply");
    convert(&path("frames"), &path("frames"), "").fails(&path("frames"), &["mix with the input"]);
    std::fs::write(path("frames/frame2.splat"), b"").expect("write");
    convert(&path("frames"), &path("out"), "").fails(&path("frames"), &["frames of one format"]);
    call("convert {p} {p} --format obj", &[("p", &path("frames"))]).is_bad_usage(&["obj", "spz"]);
    assert!(!path("out.ply").exists() && !path("out").exists());
}

/// The height above its start of something thrown up at a speed, metres.
fn risen(speed: f32, t: f32) -> f32 {
    speed * t - 0.5 * 9.81 * t * t
}

/// Corners of a cube of 0.2 m and a ball, both thrown, and four points of the floor, in millimetres at 100
/// per second; one more is out of sight for too long.
fn capture() -> Vec<Vec<Option<[f32; 3]>>> {
    let frame = |f: usize| {
        let t = 0.01 * f as f32;
        let thrown = [400.0 * t, 0.0, 1000.0 + 1000.0 * risen(1.5, t)];
        let corner = |i: usize| [i % 2, i / 2 % 2, i / 4].map(|c| 200.0 * c as f32);
        let corners = (0..8).map(corner).map(|c| std::array::from_fn(|axis| c[axis] + thrown[axis]));
        let ball = [-1000.0 - 800.0 * t, 500.0, 500.0 + 1000.0 * risen(2.5, t)];
        let floor = (0..4).map(|i| [(i % 2) as f32 * 900.0, (i / 2) as f32 * 900.0, 0.0]);
        let mut row: Vec<_> = corners.chain([ball]).chain(floor).chain([[5.0; 3]]).map(Some).collect();
        row[3] = row[3].filter(|_| f != 20);
        row[13] = row[13].filter(|_| !(10..30).contains(&f));
        row
    };
    (0..51).map(frame).collect()
}

#[test]
fn motion_capture_becomes_a_scene_that_falls_on() {
    let dir = folder();
    let (path, run) = (dir.path().join("toss.c3d"), dir.path().join("run"));
    let labels = ["a", "b", "c", "d", "e", "f", "g", "h", "ball", "i", "j", "k", "l", "hidden"];
    let (processor, form, frames) = (Processor::Intel, C3dForm::Float, &capture()[..]);
    let file = C3d { processor, form, rate: 100.0, unit: "mm", labels: &labels, analog: 0, frames };
    std::fs::write(&path, file.bytes()).expect("write");
    let facts = info(&path);
    for words in
        ["14", "51 from 0 to 0.500", "mm become metres", "13 of 14 points, 1 samples filled", "hidden"]
    {
        assert!(facts.contains(words), "should contain {words}: {facts}");
    }
    let paths: [(&str, &Path); 2] = [("file", &path), ("run", &run)];
    let done = call("train --source frames {file} --out {run}", &paths);
    assert!(done.stderr.contains("point tracks: 13 of 14 points"), "{}", done.stderr);
    done.ok();
    let out = dir.path().join("later.ply");
    call("export {run} --times 1 --out {out}", &[("run", &run), ("out", &out)]).ok();
    let found = read_ply(&out).expect("ply").means;
    for expected in [[0.6, 0.2, 1.2 + risen(1.5, 1.0)], [-1.8, 0.5, 0.5 + risen(2.5, 1.0)]] {
        let near = |p: &[f32; 3]| (0..3).all(|axis| (p[axis] - expected[axis]).abs() < 0.02);
        assert!(found.iter().any(near), "{expected:?} is not among {found:?}");
    }
}

#[test]
fn outputs_of_defgs_are_described_and_their_absent_parts_named() {
    let dir = folder();
    let (model, width) = (dir.path().join("model"), 16);
    let [gaussians, network] = ["point_cloud", "deform"].map(|part| model.join(part).join("iteration_40000"));
    std::fs::create_dir_all(&network).expect("folder");
    std::fs::write(model.join("input.ply"), "ply\n").expect("input");
    let settings = "Namespace(is_blender=False, source_path='/data/lemon', white_background=False)";
    std::fs::write(model.join("cfg_args"), settings).expect("settings");
    let heads = [("gaussian_warp", 3), ("gaussian_rotation", 4), ("gaussian_scaling", 3)];
    let mut layers: Vec<(String, usize, usize)> =
        heads.iter().map(|&(name, outputs)| (name.to_owned(), outputs, width)).collect();
    let inputs = |i| [84, width, width, width, width, 84 + width, width, width][i];
    layers.extend((0..8).map(|i| (format!("linear.{i}"), width, inputs(i))));
    let tensors: Vec<(String, Vec<usize>, Vec<f32>)> = layers
        .iter()
        .flat_map(|(name, outputs, inputs)| {
            let weight = (format!("{name}.weight"), vec![*outputs, *inputs], vec![0.01; outputs * inputs]);
            [weight, (format!("{name}.bias"), vec![*outputs], vec![0.0; *outputs])]
        })
        .collect();
    let entries: Vec<_> =
        tensors.iter().map(|(name, shape, v)| (name.as_str(), shape.as_slice(), v.as_slice())).collect();
    std::fs::write(network.join("deform.pth"), checkpoint_archive("deform", &entries)).expect("network");
    for command in ["info {model}", "train --import {model} --out {model}-run"] {
        call(command, &[("model", &model)]).fails(&model, &["the folder `point_cloud`"]);
    }
    std::fs::create_dir_all(&gaussians).expect("folder");
    let cloud = GaussianCloud::isotropic(vec![[0.0; 3]; 5], 0.1, [0.5; 3], 0.5);
    write_ply(&gaussians.join("point_cloud.ply"), &cloud).expect("ply");
    let facts = info(&model);
    for words in ["40000", "8 layers of 16", "63 of the position, 21 of the time", "/data/lemon", "black"] {
        assert!(facts.contains(words), "should contain {words}: {facts}");
    }
}
