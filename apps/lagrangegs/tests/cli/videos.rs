//! Sets of synchronised videos, on a machine without ffmpeg.

use std::path::{Path, PathBuf};
use std::process::Command;

use lgs_video::testing::h264_in_mp4;
use rusty_h264_common::YuvFrame;
use rusty_h264_encoder::{Encoder, EncoderConfig};

use crate::program::{Done, folder, json_file};

const SIDE: usize = 32;
const FRAMES: usize = 5;

/// The luma of a frame: cameras and moments differ.
fn luma(camera: usize, moment: usize) -> u8 {
    (60 + 50 * camera + 15 * moment) as u8
}

/// A video of grey frames.
fn video(camera: usize) -> Vec<u8> {
    let grey = |moment| {
        let mut frame = YuvFrame::black(SIDE, SIDE);
        frame.y.fill(luma(camera, moment));
        frame
    };
    let config = EncoderConfig { qp: 12, ..EncoderConfig::new(SIDE, SIDE) };
    let frames: Vec<YuvFrame> = (0..FRAMES).map(grey).collect();
    let coded = Encoder::new(config).expect("an encoder").encode_all(&frames).expect("coded frames");
    h264_in_mp4([SIDE as u32; 2], &coded, [1, 0, 0, 1]).expect("a file")
}

/// A calibration and a video for each of its two cameras.
fn rig(root: &Path) -> PathBuf {
    let data = root.join("data");
    std::fs::create_dir(&data).expect("a folder");
    let camera = |name: &str, x: f64| {
        format!(
            "[{name}]\nname = \"{name}\"\nsize = [32.0, 32.0]\n\
                matrix = [[40.0, 0.0, 15.5], [0.0, 40.0, 15.5], [0.0, 0.0, 1.0]]\n\
                distortions = [0.0, 0.0, 0.0, 0.0]\nrotation = [1.5707963267948966, 0.0, 0.0]\n\
                translation = [{x:?}, 0.0, 4.0]\n"
        )
    };
    let calibration = camera("left", 0.5) + &camera("right", -0.5);
    std::fs::write(data.join("Calib.toml"), calibration).expect("a calibration");
    for (number, name) in ["left.mp4", "right.MOV"].iter().enumerate() {
        std::fs::write(data.join(name), video(number)).expect("a video");
    }
    data
}

/// Runs the program where no other one is found.
fn alone(root: &Path, words: &[&str], named: Option<&str>) -> Done {
    let mut command = Command::new(env!("CARGO_BIN_EXE_lagrangegs"));
    command.args(words).env("LAGRANGEGS_CACHE", root.join("cache")).env("PATH", root.join("nothing"));
    match named {
        Some(program) => command.env("LAGRANGEGS_FFMPEG", program),
        None => command.env_remove("LAGRANGEGS_FFMPEG"),
    };
    let out = command.output().expect("the program starts");
    let text = |bytes| String::from_utf8(bytes).expect("text");
    Done { code: out.status.code().expect("a code"), stdout: text(out.stdout), stderr: text(out.stderr) }
}

#[test]
fn a_rig_of_videos_is_imported_without_another_program() {
    let dir = folder();
    let data = rig(dir.path());
    let out = dir.path().join("out");
    let [from, to] = [&data, &out].map(|path| path.display().to_string());
    alone(dir.path(), &["import", &from, &to], None).ok();
    let train = json_file(&out.join("transforms_train.json"));
    let frames = train["frames"].as_array().expect("frames");
    assert_eq!(frames.len(), 2 * FRAMES);
    for (number, frame) in frames.iter().enumerate() {
        let (moment, camera) = (number / 2, number % 2);
        assert!((frame["time"].as_f64().expect("a time") - moment as f64 / FRAMES as f64).abs() < 1e-6);
        let path = out.join(frame["file_path"].as_str().expect("a path"));
        let image = image::open(path.with_extension("png")).expect("an image").to_rgb8();
        let expected = 1.1644 * (f32::from(luma(camera, moment)) - 16.0);
        let off = |pixel: &image::Rgb<u8>| pixel.0.map(|value| (f32::from(value) - expected).abs());
        let worst = image.pixels().flat_map(off).fold(0.0, f32::max);
        assert!(worst < 4.0, "camera {camera}, moment {moment}: {worst} of 255 levels off");
    }
}

#[test]
fn videos_that_cannot_be_decoded_say_why() {
    let dir = folder();
    let data = rig(dir.path());
    let (shown, left) = (data.display().to_string(), data.join("left.mp4"));
    let info = |named| alone(dir.path(), &["info", &shown], named);
    info(Some("no-such-program")).fails(&left, &["`no-such-program` is not there", "install ffmpeg"]);
    let whole = std::fs::read(&left).expect("a video");
    std::fs::write(&left, &whole[..whole.len() - 1]).expect("a video");
    info(None).fails(&left, &["ends early", "of 5 frames 4 could be decoded", "cut off"]);
    let mut other = whole.clone();
    let place = other.windows(4).rposition(|bytes| bytes == b"avc1").expect("a codec");
    other[place..place + 4].copy_from_slice(b"hev1");
    std::fs::write(&left, &other).expect("a video");
    info(None).fails(&left, &["`hev1`", "H.264 in MP4 and MOV", "install ffmpeg", "images into a folder"]);
    std::fs::write(&left, &whole).expect("a video");
    info(None).ok();
}
