//! Written videos are read back: container, number of frames, size, duration.
#![allow(clippy::unwrap_used, reason = "tests")]

use lgs_core::Image;
use lgs_video::{Encoder, VideoError, VideoFormat, VideoSpec, begin};

const FRAMES: usize = 13;

/// A bright block that moves over a grey ground.
fn frame(index: usize, width: u32, height: u32) -> Image {
    let mut image = Image::filled(width, height, [0.3, 0.4, 0.5]);
    for y in 4..12 {
        for x in 0..8 {
            image.pixels[y * width as usize + x + 2 * index] = [0.9, 0.6, 0.1];
        }
    }
    image
}

fn video(format: VideoFormat, [width, height]: [u32; 2], frames: usize) -> Result<Vec<u8>, VideoError> {
    let spec = VideoSpec { format, width, height, frames_per_second: 25 };
    let mut video = begin(spec, Encoder::BuiltIn)?;
    for index in 0..frames {
        video.push(&frame(index, width, height))?;
    }
    video.finish()
}

#[cfg(feature = "av1")]
#[test]
fn an_mp4_has_its_frames_its_size_and_its_duration() {
    use mp4_atom::{Codec, DecodeMaybe, Moov, StszSamples};
    let bytes = video(VideoFormat::Mp4, [48, 33], FRAMES).unwrap();
    let mut rest = bytes.as_slice();
    let mut moov = None;
    let mut end_of_index = 0;
    while let Some(atom) = mp4_atom::Any::decode_maybe(&mut rest).unwrap() {
        if let mp4_atom::Any::Moov(found) = atom {
            moov = Some(found);
            end_of_index = bytes.len() - rest.len();
        }
    }
    assert!(rest.is_empty());
    let Moov { mvhd, trak, .. } = moov.unwrap();
    assert_eq!(mvhd.duration * 25, FRAMES as u64 * u64::from(mvhd.timescale));
    assert_eq!(trak[0].mdia.minf.dinf.dref.entries.len(), 1, "players look for the samples here");
    let samples = &trak[0].mdia.minf.stbl;
    let Codec::Av01(codec) = &samples.stsd.codecs[0] else { panic!("no AV1") };
    assert_eq!((codec.visual.width, codec.visual.height), (48, 33));
    let StszSamples::Different { sizes } = &samples.stsz.samples else { panic!("sizes") };
    assert_eq!(sizes.len(), FRAMES);
    let first = samples.stco.as_ref().unwrap().entries[0] as usize;
    assert_eq!(first, end_of_index + 8, "samples begin behind the index");
    assert_eq!(first + sizes.iter().sum::<u32>() as usize, bytes.len());
    assert_eq!(samples.stss.as_ref().unwrap().entries[0], 1, "the first frame is a key");
}

#[cfg(feature = "av1")]
/// Elements of a WebM by identifier, in order; masters are opened.
fn elements(mut bytes: &[u8], found: &mut Vec<(u32, Vec<u8>)>) {
    const MASTERS: [u32; 9] =
        [0x1A45_DFA3, 0x1853_8067, 0x1549_A966, 0x1654_AE6B, 0xAE, 0xE0, 0x1C53_BB6B, 0xBB, 0x1F43_B675];
    while let Some(&head) = bytes.first() {
        let (name, rest) = bytes.split_at(head.leading_zeros() as usize + 1);
        let id = name.iter().fold(0, |id, &byte| id << 8 | u32::from(byte));
        let width = rest[0].leading_zeros() as usize + 1;
        let (length, rest) = rest.split_at(width);
        let length = length.iter().fold(0_u64, |sum, &byte| sum << 8 | u64::from(byte));
        let (content, rest) = rest.split_at((length & !(1 << (7 * width))) as usize);
        found.push((id, content.to_vec()));
        if MASTERS.contains(&id) {
            elements(content, found);
        }
        bytes = rest;
    }
}

#[cfg(feature = "av1")]
#[test]
fn a_webm_has_its_frames_its_size_and_its_duration() {
    let bytes = video(VideoFormat::WebM, [48, 33], FRAMES).unwrap();
    let mut found = Vec::new();
    elements(&bytes, &mut found);
    let all = |id: u32| found.iter().filter(move |(own, _)| *own == id).map(|(_, content)| content);
    let number = |id: u32| u64::from_be_bytes(all(id).next().unwrap().as_slice().try_into().unwrap());
    assert_eq!(all(0x4282).next().unwrap(), b"webm");
    assert_eq!(all(0x86).next().unwrap(), b"V_AV1");
    assert_eq!((number(0xB0), number(0xBA)), (48, 33));
    let duration = f64::from_be_bytes(all(0x4489).next().unwrap().as_slice().try_into().unwrap());
    assert!((duration - 1e3 * FRAMES as f64 / 25.0).abs() < 1e-9, "{duration} ms");
    let times: Vec<u16> = all(0xA3).map(|block| u16::from_be_bytes([block[1], block[2]])).collect();
    assert_eq!(times, (0..FRAMES as u16).map(|frame| 40 * frame).collect::<Vec<_>>());
    // The index says where the first cluster begins, from the segment's content on.
    let segment = all(0x1853_8067).next().unwrap();
    let positions = all(0xB7).next().unwrap();
    let position = u64::from_be_bytes(positions[positions.len() - 8..].try_into().unwrap()) as usize;
    assert_eq!(segment[position..position + 4], [0x1F, 0x43, 0xB6, 0x75]);
}

#[test]
fn a_gif_shows_its_frames_in_their_colours() {
    let bytes = video(VideoFormat::Gif, [48, 33], FRAMES).unwrap();
    let mut options = gif::DecodeOptions::new();
    options.set_color_output(gif::ColorOutput::RGBA);
    let mut decoder = options.read_info(bytes.as_slice()).unwrap();
    assert_eq!((decoder.width(), decoder.height()), (48, 33));
    let mut count = 0;
    while let Some(read) = decoder.read_next_frame().unwrap() {
        assert_eq!(read.delay, 4, "hundredths of a second");
        let expected = frame(count, 48, 33).to_rgb8();
        let apart = |(a, b): (&[u8], &[u8])| (0..3).map(|c| a[c].abs_diff(b[c])).max().unwrap();
        let worst = read.buffer.chunks(4).zip(expected.chunks(3)).map(apart).max().unwrap();
        assert!(worst <= 8, "frame {count} is off by {worst} of 255");
        count += 1;
    }
    assert_eq!(count, FRAMES);
}

#[cfg(feature = "av1")]
#[test]
fn the_same_frames_give_the_same_bytes() {
    for format in VideoFormat::ALL {
        let twice = [0; 2].map(|_| video(format, [64, 48], 5).unwrap());
        assert!(twice[0] == twice[1], "{format:?}");
    }
}

#[test]
fn what_cannot_be_a_video_is_refused_before_its_first_frame() {
    let refused = |format, width, height, frames_per_second| {
        let spec = VideoSpec { format, width, height, frames_per_second };
        begin(spec, Encoder::BuiltIn).map(drop).unwrap_err().to_string()
    };
    assert!(refused(VideoFormat::Mp4, 8, 64, 25).contains("8 × 64"));
    assert!(refused(VideoFormat::WebM, 64, 9000, 25).contains("16 to 8192"));
    assert!(refused(VideoFormat::Gif, 64, 64, 60).contains("a .gif has 1 to 50"));
    assert!(refused(VideoFormat::Mp4, 64, 64, 0).contains("0 frames per second"));
    assert!(matches!(video(VideoFormat::Gif, [64, 64], 0), Err(VideoError::Empty)));
    let spec = VideoSpec { format: VideoFormat::Gif, width: 64, height: 64, frames_per_second: 25 };
    let mut video = begin(spec, Encoder::BuiltIn).unwrap();
    assert!(matches!(video.push(&frame(0, 32, 64)), Err(VideoError::FrameSize { .. })));
}

#[cfg(not(feature = "av1"))]
#[test]
fn a_build_without_the_encoder_says_so() {
    let error = video(VideoFormat::Mp4, [64, 64], 1).unwrap_err().to_string();
    assert!(error.contains("feature `av1`"), "{error}");
}
