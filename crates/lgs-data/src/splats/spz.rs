//! `.spz` files (Niantic, versions 2 and 3): a header of 16 bytes, then columns of all centres, opacities,
//! colours, scales, rotations and harmonics, all within one gzip stream.
//!
//! Centres are 24-bit integers over a power of two; scales have sixteenths of a logarithm; rotations are
//! three bytes (version 2) or the three smallest components with ten bits each (version 3, which is written).
//! Axes in the file are right, up, back; Gaussians elsewhere in the ecosystem, and here, have right, down,
//! front.

use std::io::{Read, Write};
use std::path::Path;

use flate2::Compression;
use flate2::read::GzDecoder;
use flate2::write::GzEncoder;
use lgs_core::{GaussianCloud, sh_coefficients};

use super::error::{SplatError, SplatProblem};
use super::quantise::{complete, largest_positive, opacity_byte, raw_opacity};
use crate::files::{read_bytes, write_atomically};
use crate::thresholds::{FINEST_SPZ_BITS, MOST_GZIP_GAIN};

/// The first word of the header.
const MAGIC: &[u8; 4] = b"NGSP";
/// Bytes of the header.
const HEADER: usize = 16;
/// Contrast of colours: a byte of 0 or 255 is a zeroth coefficient of ∓ 0.5 / 0.15.
const COLOR_SCALE: f32 = 0.15;
/// Largest size of a component that is not the largest of a unit quaternion.
const LARGEST_SMALL: f32 = std::f32::consts::FRAC_1_SQRT_2;
/// Flag of records between header and columns.
const EXTENSIONS: u8 = 2;
/// Factors of x, y, z between both systems of axes.
const FLIP: [f32; 3] = [1.0, -1.0, -1.0];
/// Factors of the harmonics above the zeroth between both systems: −1 where they change sign with y and z.
const FLIP_SH: [f32; 15] =
    [-1.0, -1.0, 1.0, -1.0, 1.0, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0, -1.0, 1.0, -1.0, 1.0];

/// Reads Gaussians of degree 0 to 3.
///
/// # Errors
/// If the file can't be read, is damaged, of another version, or holds more or less than its header says.
pub fn read_spz(path: &Path) -> Result<GaussianCloud, SplatError> {
    parse(&read_bytes(path)?).map_err(|problem| SplatError::new(path, problem))
}

/// Writes version 3. Harmonics above the zeroth are held between −1 and 1.
///
/// # Errors
/// If the cloud is invalid, a centre is farther than 2²³ from the origin, or the file can't be written.
pub fn write_spz(path: &Path, cloud: &GaussianCloud) -> Result<(), SplatError> {
    cloud.validate().map_err(|e| SplatError::new(path, e.into()))?;
    let bits = fraction_bits(cloud).map_err(|problem| SplatError::new(path, problem))?;
    let columns = columns(cloud, bits);
    let compress = |w: &mut dyn Write| {
        let mut gzip = GzEncoder::new(w, Compression::default());
        gzip.write_all(&columns)?;
        gzip.finish().map(|_| ())
    };
    Ok(write_atomically(path, compress)?)
}

/// Bits behind the point with which every coordinate fits into 24.
fn fraction_bits(cloud: &GaussianCloud) -> Result<u8, SplatProblem> {
    let sizes =
        cloud.means.iter().enumerate().map(|(i, p)| (i, p.iter().fold(0.0_f32, |a, v| a.max(v.abs()))));
    let (index, found) = sizes.max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0, 0.0));
    let fits = |bits: &u8| f64::from(found) * f64::from(1_u32 << bits) < f64::from(1_u32 << 23) - 1.0;
    let expected = "coordinates between −2²³ and 2²³";
    let far = SplatProblem::Value { field: "position", index, expected, found };
    (0..=FINEST_SPZ_BITS).rev().find(fits).ok_or(far)
}

fn columns(cloud: &GaussianCloud, bits: u8) -> Vec<u8> {
    let mut bytes = [MAGIC.as_slice(), &3_u32.to_le_bytes(), &(cloud.len() as u32).to_le_bytes()].concat();
    bytes.extend([cloud.sh_degree as u8, bits, 0, 0]);
    let step = f64::from(1_u32 << bits);
    for mean in &cloud.means {
        for (value, flip) in mean.iter().zip(FLIP) {
            let fixed = (f64::from(flip * value) * step).round() as i32;
            bytes.extend(&fixed.to_le_bytes()[..3]);
        }
    }
    bytes.extend(cloud.raw_opacities.iter().map(|&raw| opacity_byte(raw)));
    let stride = cloud.sh_stride();
    for sh in cloud.sh.chunks_exact(stride) {
        bytes.extend(sh[..3].iter().map(|dc| byte(255.0 * (0.5 + COLOR_SCALE * dc))));
    }
    bytes.extend(cloud.log_scales.as_flattened().iter().map(|s| byte(16.0 * (s + 10.0))));
    bytes.extend(cloud.rotations.iter().flat_map(|&q| packed_rotation(q).to_le_bytes()));
    for sh in cloud.sh.chunks_exact(stride) {
        let flipped =
            sh[3..].chunks_exact(3).zip(FLIP_SH).flat_map(|(c, flip)| c.iter().map(move |v| flip * v));
        bytes.extend(flipped.map(|v| byte(128.0 + 128.0 * v)));
    }
    bytes
}

fn byte(value: f32) -> u8 {
    value.round().clamp(0.0, 255.0) as u8
}

/// Index of the largest component of x y z w, and sign and size of the three others.
fn packed_rotation(rotation: [f32; 4]) -> u32 {
    let [w, x, y, z] = rotation;
    let (unit, largest) = largest_positive([x, -y, -z, w]);
    let others = (0..4).filter(|&i| i != largest).map(|i| {
        let size = (511.0 * unit[i].abs() / LARGEST_SMALL).round().min(511.0) as u32;
        (u32::from(unit[i] < 0.0) << 9) | size
    });
    others.fold(largest as u32, |word, component| (word << 10) | component)
}

fn unpacked_rotation(word: u32) -> [f32; 4] {
    let component = |shift: u32| {
        let size = LARGEST_SMALL * ((word >> shift) & 511) as f32 / 511.0;
        if (word >> (shift + 9)) & 1 == 1 { -size } else { size }
    };
    let [x, y, z, w] = complete((word >> 30) as usize, [20, 10, 0].map(component));
    [w, x, -y, -z]
}

/// What the header says.
struct Header {
    version: u32,
    count: u32,
    sh_degree: usize,
    fraction_bits: u8,
}

impl Header {
    fn parse(bytes: &[u8; HEADER]) -> Result<Self, SplatProblem> {
        let wrong = |field, expected, found: String| SplatProblem::Header { field, expected, found };
        let word = |at: usize| u32::from_le_bytes(std::array::from_fn(|byte| bytes[at + byte]));
        let [sh_degree, fraction_bits, flags] = [bytes[12], bytes[13], bytes[14]];
        if bytes[..4] != MAGIC[..] {
            return Err(wrong("magic", "NGSP", String::from_utf8_lossy(&bytes[..4]).into_owned()));
        }
        if !(2..=3).contains(&word(4)) {
            return Err(wrong("version", "2 or 3", word(4).to_string()));
        }
        if sh_degree > 3 {
            return Err(wrong("degree of the harmonics", "0 to 3", sh_degree.to_string()));
        }
        if fraction_bits > 23 {
            return Err(wrong("fractional bits", "0 to 23", fraction_bits.to_string()));
        }
        if flags & EXTENSIONS != 0 {
            return Err(wrong("flags", "no extensions, which are not read", flags.to_string()));
        }
        Ok(Self { version: word(4), count: word(8), sh_degree: sh_degree.into(), fraction_bits })
    }

    /// Bytes of each column for a Gaussian.
    fn widths(&self) -> [usize; 6] {
        let rotation = if self.version == 2 { 3 } else { 4 };
        [9, 1, 3, 3, rotation, 3 * (sh_coefficients(self.sh_degree) - 1)]
    }
}

fn parse(bytes: &[u8]) -> Result<GaussianCloud, SplatProblem> {
    if bytes.starts_with(MAGIC) {
        let (field, expected) = ("version", "2 or 3, which are compressed as a whole");
        return Err(SplatProblem::Header { field, expected, found: "a header that is not".to_owned() });
    }
    let damaged = |e: std::io::Error| SplatProblem::Damaged(e.to_string());
    let mut gzip = GzDecoder::new(bytes);
    let mut header = [0; HEADER];
    gzip.read_exact(&mut header).map_err(damaged)?;
    let header = Header::parse(&header)?;
    let count = u64::from(header.count);
    let expected = count * header.widths().iter().sum::<usize>() as u64;
    let most = bytes.len() as u64 * MOST_GZIP_GAIN;
    if expected > most {
        return Err(SplatProblem::Count { count, expected, found: most });
    }
    let mut columns = Vec::with_capacity(expected as usize);
    gzip.take(expected + 1).read_to_end(&mut columns).map_err(damaged)?;
    if columns.len() as u64 != expected {
        return Err(SplatProblem::Count { count, expected, found: columns.len() as u64 });
    }
    Ok(cloud(&header, &columns))
}

fn cloud(header: &Header, bytes: &[u8]) -> GaussianCloud {
    let n = header.count as usize;
    let mut rest = bytes;
    let columns = header.widths().map(|width| {
        let (column, after) = rest.split_at(width * n);
        rest = after;
        column
    });
    let [means, opacities, colors, scales, rotations, harmonics] = columns;
    let step = 1.0 / f64::from(1_u32 << header.fraction_bits);
    let coordinate = |bytes: &[u8], flip: f32| {
        // Three bytes at the top of a word keep their sign.
        let fixed = i32::from_le_bytes([0, bytes[0], bytes[1], bytes[2]]) >> 8;
        flip * (f64::from(fixed) * step) as f32
    };
    let mean = |b: &[u8]| [0, 1, 2].map(|axis: usize| coordinate(&b[3 * axis..], FLIP[axis]));
    let higher = 3 * (sh_coefficients(header.sh_degree) - 1);
    let mut sh = Vec::with_capacity(n * (3 + higher));
    for (index, dc) in colors.as_chunks::<3>().0.iter().enumerate() {
        sh.extend(dc.map(|byte| (f32::from(byte) / 255.0 - 0.5) / COLOR_SCALE));
        let own = harmonics[index * higher..(index + 1) * higher].iter().enumerate();
        sh.extend(own.map(|(at, &byte)| FLIP_SH[at / 3] * (f32::from(byte) - 128.0) / 128.0));
    }
    GaussianCloud {
        means: means.chunks_exact(9).map(mean).collect(),
        rotations: match header.version {
            2 => rotations.as_chunks::<3>().0.iter().map(|bytes| first_three(*bytes)).collect(),
            _ => rotations.as_chunks().0.iter().map(|b| unpacked_rotation(u32::from_le_bytes(*b))).collect(),
        },
        log_scales: scales.as_chunks::<3>().0.iter().map(|s| s.map(|b| f32::from(b) / 16.0 - 10.0)).collect(),
        raw_opacities: opacities.iter().map(|&byte| raw_opacity(byte)).collect(),
        sh,
        sh_degree: header.sh_degree,
    }
}

/// A rotation of version 2: x, y and z; w is positive.
fn first_three(bytes: [u8; 3]) -> [f32; 4] {
    let [x, y, z] = bytes.map(|byte| f32::from(byte) / 127.5 - 1.0);
    let [x, y, z, w] = complete(3, [x, y, z]);
    lgs_core::linear::quat_normalize([w, x, -y, -z])
}
