//! `.splatv` files as antimatter15's splaTV reads them: Gaussians that move along cubics in time and are
//! visible for a while.
//!
//! Two words, the number 0x674b and the length of a list in JSON; that list of chunks with types and sizes;
//! the chunks. The chunk `splat` has 16 words for each Gaussian: three floats of the centre, a word of red,
//! green, blue and opacity as bytes, and for the rest pairs of half floats: the quaternion w x y z, the
//! scales, the coefficients of the first three powers of τ, the change of the quaternion with τ, the
//! Gaussian's own time, and how long it is visible. τ is the time since the Gaussian's own, and its opacity
//! is multiplied by exp(−τ²/σ²) with that duration σ.
//!
//! A source of frames has opacities that stay: Gaussians that are at least half visible at every time in
//! [0, 1] are taken; others, which come and go, are left out.

use std::path::Path;

use lgs_core::GaussianCloud;
use lgs_core::linear::quat_normalize;
use serde::Deserialize;

use super::error::{SplatError, SplatProblem};
use super::quantise::{dc, raw_of_opacity, unit_of_bits};
use crate::files::read_bytes;

/// The first word.
const MAGIC: u32 = 0x674b;
/// Words of a Gaussian.
const WORDS: usize = 16;
/// Least factor of the opacity within [0, 1] of a Gaussian that stays.
const STAYS: f32 = 0.5;

/// A Gaussian that moves.
struct Mover {
    mean: [f32; 3],
    rotation: [f32; 4],
    scales: [f32; 3],
    rgba: [u8; 4],
    /// Coefficients of the first three powers of the time since `center`.
    motion: [[f32; 3]; 3],
    turn: [f32; 4],
    center: f32,
    duration: f32,
}

/// The Gaussians of a file that are there at every time in [0, 1].
pub struct SplatVideo {
    movers: Vec<Mover>,
    /// Number of Gaussians that come and go.
    pub left_out: usize,
}

/// Reads a file's Gaussians.
///
/// # Errors
/// If the file can't be read, is no such file, ends early or has a value that is impossible.
pub fn read_splat_video(path: &Path) -> Result<SplatVideo, SplatError> {
    parse(&read_bytes(path)?).map_err(|problem| SplatError::new(path, problem))
}

impl SplatVideo {
    /// Whether no Gaussian stays.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.movers.is_empty()
    }

    /// The Gaussians at a time in [0, 1], of degree 0.
    #[must_use]
    pub fn cloud_at(&self, time: f32) -> GaussianCloud {
        let movers = || self.movers.iter();
        GaussianCloud {
            means: movers().map(|mover| mover.mean_at(time)).collect(),
            rotations: movers().map(|mover| mover.rotation_at(time)).collect(),
            log_scales: movers().map(|mover| mover.scales.map(|s| s.max(f32::MIN_POSITIVE).ln())).collect(),
            raw_opacities: movers().map(|mover| mover.raw_opacity_at(time)).collect(),
            sh: movers().flat_map(|mover| [0, 1, 2].map(|c: usize| dc(level(mover.rgba[c])))).collect(),
            sh_degree: 0,
        }
    }
}

impl Mover {
    fn mean_at(&self, time: f32) -> [f32; 3] {
        let t = time - self.center;
        std::array::from_fn(|axis| {
            let [first, second, third] = self.motion.map(|power| power[axis]);
            self.mean[axis] + t * (first + t * (second + t * third))
        })
    }

    fn rotation_at(&self, time: f32) -> [f32; 4] {
        let t = time - self.center;
        quat_normalize(std::array::from_fn(|i| self.rotation[i] + t * self.turn[i]))
    }

    fn visibility(&self, time: f32) -> f32 {
        (-((time - self.center) / self.duration).powi(2)).exp()
    }

    fn raw_opacity_at(&self, time: f32) -> f32 {
        raw_of_opacity(level(self.rgba[3]) * self.visibility(time))
    }

    /// Whether it is visible at both ends of [0, 1], and so in between.
    fn stays(&self) -> bool {
        self.duration > 0.0 && [0.0, 1.0].iter().all(|&end| self.visibility(end) >= STAYS)
    }

    fn of(words: &[u32; WORDS], index: usize) -> Result<Self, SplatProblem> {
        let pair = |at: usize| [half(words[at] as u16), half((words[at] >> 16) as u16)];
        let [rotation, scales, turn] = [3, 5, 13].map(|at| [pair(at), pair(at + 1)].concat());
        let motion = [8, 9, 10, 11, 12].map(pair).concat();
        let [center, duration] = pair(15);
        let mean = [0, 1, 2].map(|at: usize| f32::from_bits(words[at]));
        let floats = [&mean[..], &rotation, &scales, &motion, &turn, &[center, duration]].concat();
        let value = |field, expected, found| SplatProblem::Value { field, index, expected, found };
        if let Some(&found) = floats.iter().find(|v| !v.is_finite()) {
            return Err(value("words", "finite numbers", found));
        }
        if let Some(&found) = scales.iter().find(|scale| **scale < 0.0) {
            return Err(value("scale", "numbers of 0 or more", found));
        }
        Ok(Self {
            mean,
            rotation: std::array::from_fn(|i| rotation[i]),
            scales: std::array::from_fn(|i| scales[i]),
            rgba: words[7].to_le_bytes(),
            motion: std::array::from_fn(|power| std::array::from_fn(|axis| motion[3 * power + axis])),
            turn: std::array::from_fn(|i| turn[i]),
            center,
            duration,
        })
    }
}

fn level(byte: u8) -> f32 {
    unit_of_bits(byte.into(), 8)
}

/// The value of a half float.
fn half(bits: u16) -> f32 {
    let sign = if bits >> 15 == 1 { -1.0 } else { 1.0 };
    let (exponent, fraction) = (i32::from(bits >> 10) & 31, f32::from(bits & 1023));
    sign * match exponent {
        0 => fraction * 2.0_f32.powi(-24),
        31 if fraction == 0.0 => f32::INFINITY,
        31 => f32::NAN,
        _ => (1024.0 + fraction) * 2.0_f32.powi(exponent - 25),
    }
}

#[derive(Deserialize)]
struct Part {
    #[serde(rename = "type")]
    kind: String,
    size: u64,
}

fn parse(bytes: &[u8]) -> Result<SplatVideo, SplatProblem> {
    let wrong = |field, expected, found: String| SplatProblem::Header { field, expected, found };
    let ends = |expected: u64| SplatProblem::Ends { expected, found: bytes.len() as u64 };
    let word = |at: usize| bytes.get(at..at + 4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    let (magic, length) = word(0).zip(word(4)).ok_or_else(|| ends(8))?;
    if magic != MAGIC {
        return Err(wrong("magic", "0x674b", format!("{magic:#x}")));
    }
    let list = bytes.get(8..).and_then(|rest| rest.get(..length as usize));
    let list = list.ok_or_else(|| ends(8 + u64::from(length)))?;
    let parts: Vec<Part> = serde_json::from_slice(list)
        .map_err(|e| wrong("list of chunks", "JSON with types and sizes", e.to_string()))?;
    let mut start = 8 + u64::from(length);
    for part in parts {
        let end = start.saturating_add(part.size);
        if part.kind == "splat" {
            let chunk = usize::try_from(start).ok().zip(usize::try_from(end).ok());
            let chunk = chunk.and_then(|(start, end)| bytes.get(start..end)).ok_or_else(|| ends(end))?;
            return movers(chunk);
        }
        start = end;
    }
    Err(wrong("list of chunks", "a chunk `splat`", "none".to_owned()))
}

fn movers(chunk: &[u8]) -> Result<SplatVideo, SplatProblem> {
    let (rows, rest) = chunk.as_chunks::<{ 4 * WORDS }>();
    if !rest.is_empty() {
        let expected = "a multiple of 64 bytes";
        let found = chunk.len().to_string();
        return Err(SplatProblem::Header { field: "size of `splat`", expected, found });
    }
    let mut video = SplatVideo { movers: Vec::new(), left_out: 0 };
    for (index, row) in rows.iter().enumerate() {
        let words = std::array::from_fn(|i| u32::from_le_bytes(std::array::from_fn(|b| row[4 * i + b])));
        // Rows of zeros fill the last line of a texture.
        if words == [0; WORDS] {
            continue;
        }
        let mover = Mover::of(&words, index)?;
        if mover.stays() {
            video.movers.push(mover);
        } else {
            video.left_out += 1;
        }
    }
    Ok(video)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The bits of a number that a half float holds exactly.
    fn bits(value: f32) -> u32 {
        let bits = value.to_bits();
        if value == 0.0 {
            0
        } else {
            (bits >> 16 & 0x8000) | ((bits >> 23 & 0xff) - 112) << 10 | (bits >> 13 & 0x3ff)
        }
    }

    /// A file of Gaussians with their own times and durations, and a line of zeros.
    fn file(visible: &[[f32; 2]]) -> Vec<u8> {
        let pair = |a: f32, b: f32| bits(a) | bits(b) << 16;
        let mut chunk = Vec::new();
        for [center, duration] in visible {
            let mean = [1.0_f32, 2.0, 3.0].map(f32::to_bits);
            let color = u32::from_le_bytes([255, 0, 51, 204]);
            let still = [pair(1.0, 0.0), pair(0.0, 0.0), pair(0.5, 0.25), pair(2.0, 0.0), color];
            let motion = [pair(1.0, 0.0), pair(0.0, 0.0), pair(0.0, -4.0), pair(0.0, 0.5), pair(0.0, 0.0)];
            let turn = [pair(0.0, 0.0), pair(0.0, 1.0), pair(*center, *duration)];
            chunk.extend([&mean[..], &still, &motion, &turn].concat());
        }
        chunk.extend([0; WORDS]);
        let size = 4 * chunk.len();
        let list = format!(
            "[{{\"type\":\"notes\",\"size\":3}},{{\"type\":\"splat\",\"size\":{size},\"cameras\":[]}}]"
        );
        let mut bytes = [MAGIC.to_le_bytes(), (list.len() as u32).to_le_bytes()].concat();
        bytes.extend(list.bytes());
        bytes.extend(b"abc");
        bytes.extend(chunk.iter().flat_map(|word| word.to_le_bytes()));
        bytes
    }

    #[test]
    fn gaussians_that_stay_move_along_their_cubics() {
        let video = parse(&file(&[[0.5, 16.0], [0.5, 0.125], [0.5, 16.0]])).unwrap();
        assert_eq!((video.movers.len(), video.left_out), (2, 1));
        let cloud = video.cloud_at(1.0);
        assert_eq!(cloud.validate(), Ok(()));
        // τ = 0.5: x + τ, y + 0.5 τ³, z − 4 τ².
        assert_eq!(cloud.means[1], [1.5, 2.0625, 2.0]);
        assert!((cloud.rotations[1][3] / cloud.rotations[1][0] - 0.5).abs() < 1e-6);
        assert!((cloud.log_scales[1][2] - 2.0_f32.ln()).abs() < 1e-6);
        assert!((cloud.opacity(1) - 0.8 * (-(0.5_f32 / 16.0).powi(2)).exp()).abs() < 1e-5);
        assert!((lgs_core::SH_C0 * cloud.sh[5] + 0.5 - 0.2).abs() < 1e-5);
    }

    #[test]
    fn damaged_files_are_errors() {
        let whole = file(&[[0.5, 16.0]]);
        for length in 0..whole.len() {
            assert!(parse(&whole[..length]).is_err(), "cut at {length}");
        }
        let with = |at: usize, bytes: &[u8]| [&whole[..at], bytes, &whole[at + bytes.len()..]].concat();
        let start = whole.len() - 128;
        for (bytes, words) in [
            (with(0, &[0x4c]), "`magic`"),
            (with(8, b"{"), "`list of chunks`"),
            (with(start, &f32::NAN.to_le_bytes()), "`words` of Gaussian 0"),
            (with(start + 20, &[0, 0xbc]), "`scale` of Gaussian 0"),
        ] {
            let text = parse(&bytes).err().unwrap().to_string();
            assert!(text.contains(words), "{text}");
        }
    }

    #[test]
    fn half_floats_of_every_kind() {
        for (bits, value) in [(0x3c00, 1.0), (0xc000, -2.0), (0x0001, 2.0_f32.powi(-24)), (0x7bff, 65504.0)] {
            assert_eq!(half(bits), value);
        }
        assert!(half(0x7c00).is_infinite() && half(0x7e00).is_nan());
    }
}
