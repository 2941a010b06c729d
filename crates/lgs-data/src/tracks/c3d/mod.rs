//! C3D files: blocks of 512 bytes, the first of them a header; a section of parameters; then frames of points
//! and analog samples (the C3D file format, www.c3d.org).
//!
//! Integers and floats are those of the processor that the parameter section names: Intel, DEC (VAX floats)
//! or SGI (big endian). Coordinates are 16-bit integers times a scale, or floats where the scale is negative.
//! The fourth word of a point holds cameras and residual; a negative one marks a point that is not seen.

mod parameters;
mod words;

use super::error::TracksProblem;
use super::recording::{LengthUnit, PointTracks};
use parameters::Parameters;
use words::{Processor, Words};

/// Bytes of a block.
const BLOCK: usize = 512;
/// The byte by which headers of file and parameters are known.
const KEY: u8 = 0x50;
/// The number in `POINT:FRAMES` of a file with more frames than fit there; they are counted elsewhere.
const TOO_MANY_FRAMES: u64 = 65535;

/// Reads the points of a file.
pub(super) fn parse(bytes: &[u8]) -> Result<PointTracks, TracksProblem> {
    let key = bytes.get(1).copied().unwrap_or_default();
    if key != KEY {
        let found = format!("{key:#04x}");
        return Err(wrong("second byte", "0x50 of a C3D file", found));
    }
    let section = BLOCK * usize::from(bytes[0]).saturating_sub(1);
    let processor = Words::new(bytes, Processor::Intel).byte(section + 3, "parameters")?;
    let processor = Processor::of(processor)
        .ok_or_else(|| wrong("processor", "84 (Intel), 85 (DEC) or 86 (SGI)", processor.to_string()))?;
    let words = Words::new(bytes, processor);
    let parameters = Parameters::parse(&words, section)?;
    let shape = Shape::of(&words, &parameters)?;
    let points = shape.frames(&words)?;
    Ok(PointTracks {
        labels: labels(&parameters, shape.points),
        unit: LengthUnit::named(
            parameters.texts("POINT", "UNITS").first().map_or("", |unit| unit.trim_end_matches('\0')),
        ),
        times: (0..points.len()).map(|frame| frame as f64 / shape.rate).collect(),
        points,
    })
}

fn wrong(field: &str, expected: &'static str, found: String) -> TracksProblem {
    TracksProblem::Field { field: field.to_owned(), expected, found }
}

/// Where the frames lie, and what they are made of.
struct Shape {
    points: usize,
    /// Analog values per frame.
    analog: usize,
    frames: u64,
    /// Factor of integers; negative: floats, in the file's unit.
    scale: f64,
    /// Frames per second.
    rate: f64,
    start: usize,
}

impl Shape {
    /// Parameters, where they are there, and else the header; words of the header are counted from 1 in the
    /// format's description.
    fn of(words: &Words<'_>, parameters: &Parameters<'_>) -> Result<Self, TracksProblem> {
        let header = |word: usize| words.integer(2 * (word - 1), "header").map(u64::from);
        let (first, last) = (header(4)?, header(5)?);
        let number = |name| parameters.number("POINT", name);
        let field = |bits: Option<f64>| bits.filter(|value| *value >= 0.0).map(|value| value as u64);
        let trial = match [parameters.long("ACTUAL_START_FIELD"), parameters.long("ACTUAL_END_FIELD")] {
            [Some(first), Some(last)] if last >= first => Some(last - first + 1),
            _ => None,
        };
        let counted = field(number("FRAMES")).filter(|&frames| frames > 0 && frames != TOO_MANY_FRAMES);
        let counted = field(number("LONG_FRAMES")).or(counted);
        let of_header = (last + 1).saturating_sub(first);
        let rate = number("RATE").map_or_else(|| words.float(20, "header").map(f64::from), Ok)?;
        let scale = number("SCALE").map_or_else(|| words.float(12, "header").map(f64::from), Ok)?;
        for (name, value) in [("POINT:RATE", rate), ("POINT:SCALE", scale.abs())] {
            if !(value.is_finite() && value > 0.0) {
                return Err(wrong(name, "a finite number other than 0", value.to_string()));
            }
        }
        let block = field(number("DATA_START")).map_or_else(|| header(9), Ok)?;
        Ok(Self {
            points: field(number("USED")).map_or_else(|| header(2), Ok)? as usize,
            analog: header(3)? as usize,
            frames: trial.or(counted).unwrap_or(of_header),
            scale,
            rate,
            start: BLOCK * (block as usize).saturating_sub(1),
        })
    }

    /// All frames.
    fn frames(&self, words: &Words<'_>) -> Result<Vec<Vec<Option<[f32; 3]>>>, TracksProblem> {
        if self.points == 0 {
            return Err(TracksProblem::Empty("points"));
        }
        let width = if self.scale < 0.0 { 4 } else { 2 };
        let stride = width * (4 * self.points + self.analog);
        let expected = stride as u64 * self.frames;
        let found = words.len().saturating_sub(self.start) as u64;
        if found < expected {
            let part = format!("frames ({} of {} points)", self.frames, self.points);
            return Err(TracksProblem::Ends { part, expected, found });
        }
        let point = |at: usize| self.point(words, at, width);
        let frame = |frame: u64| {
            let start = self.start + stride * frame as usize;
            (0..self.points).map(|index| point(start + 4 * width * index)).collect()
        };
        (0..self.frames).map(frame).collect()
    }

    /// A point, if it is seen; a coordinate that is not finite is one more way to say that it is not.
    fn point(&self, words: &Words<'_>, at: usize, width: usize) -> Result<Option<[f32; 3]>, TracksProblem> {
        let word = |index: usize| match width {
            4 => words.float(at + 4 * index, "frames"),
            _ => words.integer(at + 2 * index, "frames").map(|value| f32::from(value as i16)),
        };
        let factor = if width == 4 { 1.0 } else { self.scale };
        let position = [word(0)?, word(1)?, word(2)?].map(|value| (factor * f64::from(value)) as f32);
        let is_seen = word(3)? >= 0.0 && position.iter().all(|value| value.is_finite());
        Ok(is_seen.then_some(position))
    }
}

/// A name for each point; those that the file does not name are numbered.
fn labels(parameters: &Parameters<'_>, points: usize) -> Vec<String> {
    let further = (2..).map(|part| parameters.texts("POINT", &format!("LABELS{part}")));
    let mut names = parameters.texts("POINT", "LABELS");
    names.extend(further.take_while(|part| !part.is_empty()).flatten());
    let named = |index: usize| names.get(index).filter(|name| !name.is_empty()).cloned();
    (0..points).map(|index| named(index).unwrap_or_else(|| format!("point {}", index + 1))).collect()
}
