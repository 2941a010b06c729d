//! H.264 that is encoded here comes back from MP4 files, and damaged files are errors.
#![allow(clippy::unwrap_used, reason = "tests")]

use std::io::Cursor;

use lgs_video::read::{DecodeError, Picture, frames};
use lgs_video::testing::h264_in_mp4;
use rusty_h264_common::YuvFrame;
use rusty_h264_encoder::{Encoder, EncoderConfig};

const SIZE: [u32; 2] = [64, 48];
const UPRIGHT: [i32; 4] = [1, 0, 0, 1];
/// Levels of 255 by which a frame may be off: the quantizer's, on both luma and chroma.
const TOLERANCE: u8 = 8;

/// A slope of grey that brightens with time, with a bright block that moves over it.
fn scene(number: usize) -> YuvFrame {
    let [width, height] = SIZE.map(|side| side as usize);
    let mut frame = YuvFrame::black(width, height);
    for (place, luma) in frame.y.iter_mut().enumerate() {
        let [x, y] = [place % width, place / width];
        let is_block = (8..24).contains(&y) && (2 * number..2 * number + 16).contains(&x);
        *luma = if is_block { 210 } else { (40 + x + y / 2 + 2 * number) as u8 };
    }
    frame.u.fill(120);
    frame.v.fill(140);
    frame
}

/// The scene's frames as an encoder codes them, one after the other as they are decoded.
fn coded(count: usize, between: u32) -> Vec<Vec<u8>> {
    let [width, height] = SIZE.map(|side| side as usize);
    let config = EncoderConfig {
        qp: 14,
        gop_size: 8,
        min_keyint: 8,
        scenecut: 0,
        bframes: between,
        ..EncoderConfig::new(width, height)
    };
    let scenes: Vec<YuvFrame> = (0..count).map(scene).collect();
    Encoder::new(config).unwrap().encode_all(&scenes).unwrap()
}

fn video(count: usize) -> Vec<u8> {
    h264_in_mp4(SIZE, &coded(count, 0), UPRIGHT).unwrap()
}

/// The pictures of a file up to its first error.
fn read(file: &[u8]) -> (Vec<Picture>, Option<DecodeError>) {
    let mut pictures = Vec::new();
    match frames(Cursor::new(file)) {
        Err(error) => return (pictures, Some(error)),
        Ok(frames) => {
            for picture in frames {
                match picture {
                    Ok(picture) => pictures.push(picture),
                    Err(error) => return (pictures, Some(error)),
                }
            }
        }
    }
    (pictures, None)
}

/// Whether pixels are those of the scene: BT.601, limited range.
fn assert_is_scene(number: usize, rgb: &[u8]) {
    let frame = scene(number);
    for (place, pixel) in rgb.as_chunks::<3>().0.iter().enumerate() {
        let luma = 1.1644 * (f32::from(frame.y[place]) - 16.0);
        let [u, v] = [-8.0, 12.0];
        let expected = [luma + 1.596 * v, luma - 0.3917 * u - 0.8129 * v, luma + 2.0172 * u];
        let off = (0..3).map(|c| pixel[c].abs_diff(expected[c].round() as u8)).max().unwrap();
        assert!(off <= TOLERANCE, "frame {number}, pixel {place}: {pixel:?} for {expected:?}");
    }
}

#[test]
fn frames_come_back_in_their_order() {
    for between in [0, 2] {
        let file = h264_in_mp4(SIZE, &coded(21, between), UPRIGHT).unwrap();
        assert_eq!(frames(Cursor::new(&file)).unwrap().listed(), 21);
        let (pictures, error) = read(&file);
        assert!(error.is_none(), "{error:?}");
        assert_eq!(pictures.len(), 21);
        for (number, picture) in pictures.iter().enumerate() {
            assert_eq!(picture.size(), SIZE);
            assert_is_scene(number, &picture.to_rgb8());
        }
    }
}

#[test]
fn frames_are_turned_upright() {
    let stored = coded(2, 0);
    let upright = read(&h264_in_mp4(SIZE, &stored, UPRIGHT).unwrap()).0[1].to_rgb8();
    let turned = read(&h264_in_mp4(SIZE, &stored, [0, 1, -1, 0]).unwrap()).0.remove(1);
    let [width, height] = SIZE.map(|side| side as usize);
    assert_eq!(turned.size(), [SIZE[1], SIZE[0]]);
    let turned = turned.to_rgb8();
    for (x, y) in [(0, 0), (5, 0), (63, 47), (20, 11)] {
        let [from, to] = [y * width + x, x * height + height - 1 - y].map(|place| 3 * place);
        assert_eq!(turned[to..to + 3], upright[from..from + 3], "a quarter clockwise");
    }
}

#[test]
fn a_video_that_ends_early_says_after_how_many_frames() {
    let file = video(20);
    let (pictures, error) = read(&file[..file.len() * 3 / 4]);
    let Some(DecodeError::EndsEarly { expected, decoded, .. }) = error else { panic!("{error:?}") };
    assert_eq!((expected, decoded), (20, pictures.len()));
    assert!((1..20).contains(&decoded), "{decoded}");
    assert_is_scene(decoded - 1, &pictures[decoded - 1].to_rgb8());
    let message = error_of(&file[..file.len() - 1]).to_string();
    assert!(message.contains("of 20 frames 19 could be decoded") && message.contains("cut off"), "{message}");
    // The last frame's head, behind the length and the kind of its unit, is none.
    let mut broken = file.clone();
    let start = file.len() - coded(20, 0)[19].len();
    broken[start + 5..start + 17].fill(0);
    let message = error_of(&broken).to_string();
    assert!(message.contains("of 20 frames 18") && message.contains("frame 19"), "{message}");
    broken[start] = 1;
    assert!(error_of(&broken).to_string().contains("frame 19 has parts that are longer"));
}

fn error_of(file: &[u8]) -> DecodeError {
    read(file).1.unwrap()
}

#[test]
fn other_files_are_told_from_damaged_ones() {
    let mut file = video(2);
    let at = file.windows(4).position(|bytes| bytes == b"avc1").unwrap();
    let at = at + 4 + file[at + 4..].windows(4).position(|bytes| bytes == b"avc1").unwrap();
    file[at..at + 4].copy_from_slice(b"hvc1");
    let error = error_of(&file);
    assert!(error.is_of_another_kind() && error.to_string().contains("`hvc1`"), "{error}");
    let error = error_of(b"RIFF....AVI LIST");
    assert!(error.is_of_another_kind() && error.to_string().contains("no MP4"), "{error}");
    assert!(!error_of(&video(2)[..200]).is_of_another_kind());
}

#[test]
fn changed_bytes_are_no_panic() {
    let file = video(6);
    let mut state = 7_u64;
    let mut draw = |below: usize| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % below
    };
    for _ in 0..2000 {
        let mut changed = file.clone();
        for _ in 0..=draw(4) {
            let place = draw(changed.len());
            changed[place] = draw(256) as u8;
        }
        let (pictures, _) = read(&changed);
        pictures.iter().for_each(|picture| drop(picture.to_rgb8()));
    }
}
