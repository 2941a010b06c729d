//! MP4 files of H.264 for tests of what reads them; the tests bring an encoder.

use mp4_atom::{Avc1, Avcc, Matrix};

use crate::error::VideoError;
use crate::mp4::{Movie, mp4, visual};
use crate::spec::{VideoFormat, VideoSpec};
use crate::track::Sample;

/// Kinds of units (H.264, table 7-1).
const IDR: u8 = 5;
const SPS: u8 = 7;
const PPS: u8 = 8;

/// An MP4 file of `size` pixels of coded frames as encoders give them: each a stream of units behind start
/// codes, with parameter sets before the first. Players turn them by a matrix [a, b, c, d] of whole numbers.
///
/// # Errors
/// If there is no frame, or one has no parameter sets before it.
pub fn h264_in_mp4(size: [u32; 2], frames: &[Vec<u8>], turn: [i32; 4]) -> Result<Vec<u8>, VideoError> {
    let [width, height] = size;
    let spec = VideoSpec { format: VideoFormat::Mp4, width, height, frames_per_second: 25 };
    let first = units(frames.first().ok_or(VideoError::Empty)?);
    let of_kind = |kind| first.iter().copied().find(|unit| kind_of(unit) == kind).ok_or(VideoError::Empty);
    let mut configuration = Avcc::new(of_kind(SPS)?, of_kind(PPS)?)?;
    // What profiles beyond Main add is optional to readers.
    configuration.ext = None;
    let sample_entry = Avc1 { visual: visual(&spec), avcc: configuration, ..Avc1::default() };
    let [a, b, c, d] = turn.map(|entry| entry << 16);
    let matrix = Matrix { a, b, c, d, ..Matrix::default() };
    let samples: Vec<Sample> = frames.iter().map(|frame| sample(frame)).collect();
    mp4(&Movie { spec, samples: &samples, codec: sample_entry.into(), matrix })
}

/// A frame as MP4 has it: lengths before its units, and no parameter sets.
fn sample(frame: &[u8]) -> Sample {
    let mut data = Vec::new();
    let units = units(frame);
    for unit in units.iter().filter(|unit| ![SPS, PPS].contains(&kind_of(unit))) {
        data.extend((unit.len() as u32).to_be_bytes());
        data.extend(*unit);
    }
    Sample { data, is_key: units.iter().any(|unit| kind_of(unit) == IDR) }
}

fn kind_of(unit: &[u8]) -> u8 {
    unit.first().map_or(0, |head| head & 0x1f)
}

/// The units between start codes (H.264, Annex B).
fn units(mut stream: &[u8]) -> Vec<&[u8]> {
    const START: [u8; 3] = [0, 0, 1];
    let mut found = Vec::new();
    while let Some(at) = stream.windows(START.len()).position(|bytes| bytes == START) {
        found.push(&stream[..at]);
        stream = &stream[at + START.len()..];
    }
    found.push(stream);
    found.into_iter().skip(1).map(without_zeros).collect()
}

/// Zeros before a start code belong to no unit.
fn without_zeros(unit: &[u8]) -> &[u8] {
    let end = unit.iter().rposition(|&byte| byte != 0).map_or(0, |last| last + 1);
    &unit[..end]
}
