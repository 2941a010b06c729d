//! Compressed polygon files of PlayCanvas and SuperSplat: chunks of 256 Gaussians with bounds of their
//! centres, logarithms of scales and colours, and for each Gaussian four words of packed fractions of these.
//!
//! | word | bits, from the highest |
//! |---|---|
//! | `packed_position`, `packed_scale` | 11 x, 10 y, 11 z, between the bounds of the chunk |
//! | `packed_rotation` | 2 index of the largest of w x y z, then 10 each of the others, between ∓ 1/√2 |
//! | `packed_color` | 8 red, 8 green, 8 blue, between the bounds of the chunk, 8 opacity |
//!
//! The element `sh` holds harmonics above the zeroth as bytes between −4 and 4.

use std::path::Path;

use lgs_core::{GaussianCloud, sh_coefficients};

use super::quantise::{
    color, complete, dc, largest_positive, opacity_byte, raw_opacity, unit_of_bits, unit_to_bits,
};
use crate::files::{destination_of, read_bytes, write_atomically};
use crate::ply::{PlyError, PlyProblem, Scalar, Table, finite_scales};

/// Gaussians of a chunk.
const CHUNK: usize = 256;
/// Bounds of a chunk, in file order.
const BOUNDS: [&str; 18] = [
    "min_x",
    "min_y",
    "min_z",
    "max_x",
    "max_y",
    "max_z",
    "min_scale_x",
    "min_scale_y",
    "min_scale_z",
    "max_scale_x",
    "max_scale_y",
    "max_scale_z",
    "min_r",
    "min_g",
    "min_b",
    "max_r",
    "max_g",
    "max_b",
];
/// Words of a Gaussian, in file order.
const WORDS: [&str; 4] = ["packed_position", "packed_rotation", "packed_scale", "packed_color"];
/// Harmonics above the zeroth lie between minus and plus half of this.
const SH_RANGE: f32 = 8.0;

/// Reads Gaussians of degree 0 to 3.
///
/// # Errors
/// If the file can't be read or its contents are not those of such a file.
pub fn read_compressed_ply(path: &Path) -> Result<GaussianCloud, PlyError> {
    let bytes = read_bytes(path)?;
    parse(&bytes).map_err(|problem| PlyError::Content { path: path.to_path_buf(), problem })
}

/// Writes Gaussians in their order; chunks are tight where neighbours in the file are neighbours in space.
///
/// # Errors
/// If the cloud is invalid or the file can't be written.
pub fn write_compressed_ply(path: &Path, cloud: &GaussianCloud) -> Result<(), PlyError> {
    cloud.validate().map_err(|e| PlyError::Content { path: destination_of(path), problem: e.into() })?;
    let chunks: Vec<Chunk> =
        (0..cloud.len()).step_by(CHUNK).map(|start| Chunk::around(cloud, start)).collect();
    write_atomically(path, |w| {
        w.write_all(header(cloud).as_bytes())?;
        for chunk in &chunks {
            chunk.bounds().iter().try_for_each(|v| w.write_all(&v.to_le_bytes()))?;
        }
        for index in 0..cloud.len() {
            let words = chunks[index / CHUNK].pack(cloud, index);
            words.iter().try_for_each(|word| w.write_all(&word.to_le_bytes()))?;
        }
        for sh in cloud.sh.chunks_exact(cloud.sh_stride()) {
            let channel = |c: usize| sh[3..].iter().skip(c).step_by(3).map(|&v| harmonic_byte(v));
            w.write_all(&(0..3).flat_map(channel).collect::<Vec<u8>>())?;
        }
        Ok(())
    })?;
    Ok(())
}

fn header(cloud: &GaussianCloud) -> String {
    let chunks = cloud.len().div_ceil(CHUNK);
    let mut text = format!("ply\nformat binary_little_endian 1.0\nelement chunk {chunks}\n");
    text.extend(BOUNDS.map(|name| format!("property float {name}\n")));
    text.push_str(&format!("element vertex {}\n", cloud.len()));
    text.extend(WORDS.map(|name| format!("property uint {name}\n")));
    if cloud.sh_degree > 0 {
        text.push_str(&format!("element sh {}\n", cloud.len()));
        text.extend((0..cloud.sh_stride() - 3).map(|i| format!("property uchar f_rest_{i}\n")));
    }
    text.push_str("end_header\n");
    text
}

/// Lowest and highest of three values.
#[derive(Clone, Copy)]
struct Bounds {
    low: [f32; 3],
    high: [f32; 3],
}

impl Bounds {
    fn around(values: impl Iterator<Item = [f32; 3]>) -> Self {
        let start = Self { low: [f32::INFINITY; 3], high: [f32::NEG_INFINITY; 3] };
        values.fold(start, |b, v| Self {
            low: std::array::from_fn(|i| b.low[i].min(v[i])),
            high: std::array::from_fn(|i| b.high[i].max(v[i])),
        })
    }

    /// Fractions of the way from the lowest to the highest.
    fn fractions(&self, values: [f32; 3]) -> [f32; 3] {
        std::array::from_fn(|i| {
            let extent = self.high[i] - self.low[i];
            if extent > 0.0 { (values[i] - self.low[i]) / extent } else { 0.0 }
        })
    }

    fn values(&self, fractions: [f32; 3]) -> [f32; 3] {
        std::array::from_fn(|i| self.low[i] * (1.0 - fractions[i]) + self.high[i] * fractions[i])
    }
}

/// Bounds of a chunk's centres, logarithms of scales and colours.
struct Chunk {
    means: Bounds,
    log_scales: Bounds,
    colors: Bounds,
}

impl Chunk {
    fn around(cloud: &GaussianCloud, start: usize) -> Self {
        let members = start..cloud.len().min(start + CHUNK);
        Self {
            means: Bounds::around(members.clone().map(|i| cloud.means[i])),
            log_scales: Bounds::around(members.clone().map(|i| cloud.log_scales[i])),
            colors: Bounds::around(members.map(|i| color_of(cloud, i))),
        }
    }

    fn bounds(&self) -> Vec<f32> {
        [&self.means, &self.log_scales, &self.colors].iter().flat_map(|b| [b.low, b.high].concat()).collect()
    }

    /// A chunk of a file's bounds; without those of colours, these are 0 and 1.
    fn of(bounds: &[f32]) -> Self {
        let three = |at: usize| std::array::from_fn(|i| bounds[at + i]);
        let pair = |at: usize| Bounds { low: three(at), high: three(at + 3) };
        let whole = Bounds { low: [0.0; 3], high: [1.0; 3] };
        Self {
            means: pair(0),
            log_scales: pair(6),
            colors: if bounds.len() == BOUNDS.len() { pair(12) } else { whole },
        }
    }

    fn pack(&self, cloud: &GaussianCloud, index: usize) -> [u32; 4] {
        let coarse =
            |[x, y, z]: [f32; 3]| unit_to_bits(x, 11) << 21 | unit_to_bits(y, 10) << 11 | unit_to_bits(z, 11);
        let [r, g, b] = self.colors.fractions(color_of(cloud, index)).map(|v| unit_to_bits(v, 8));
        [
            coarse(self.means.fractions(cloud.means[index])),
            packed_rotation(cloud.rotations[index]),
            coarse(self.log_scales.fractions(cloud.log_scales[index])),
            r << 24 | g << 16 | b << 8 | u32::from(opacity_byte(cloud.raw_opacities[index])),
        ]
    }
}

fn color_of(cloud: &GaussianCloud, index: usize) -> [f32; 3] {
    let sh = &cloud.sh[index * cloud.sh_stride()..];
    [sh[0], sh[1], sh[2]].map(color)
}

fn packed_rotation(rotation: [f32; 4]) -> u32 {
    let (unit, largest) = largest_positive(rotation);
    let others = (0..4).filter(|&i| i != largest);
    let bits = |i: usize| unit_to_bits(unit[i] * std::f32::consts::FRAC_1_SQRT_2 + 0.5, 10);
    others.fold(largest as u32, |word, i| word << 10 | bits(i))
}

fn unpacked_rotation(word: u32) -> [f32; 4] {
    let component = |shift: u32| (unit_of_bits(word >> shift, 10) - 0.5) * std::f32::consts::SQRT_2;
    complete((word >> 30) as usize, [20, 10, 0].map(component))
}

fn harmonic_byte(value: f32) -> u8 {
    (256.0 * (value / SH_RANGE + 0.5)).floor().clamp(0.0, 255.0) as u8
}

/// The middle of a byte's interval; the first and last stand for the ends of the range.
fn harmonic(byte: u8) -> f32 {
    let fraction = match byte {
        0 => 0.0,
        255 => 1.0,
        byte => (f32::from(byte) + 0.5) / 256.0,
    };
    SH_RANGE * (fraction - 0.5)
}

fn parse(bytes: &[u8]) -> Result<GaussianCloud, PlyProblem> {
    let (chunks, vertices) = (Table::of(bytes, "chunk")?, Table::of(bytes, "vertex")?);
    let has_colors = chunks.names().any(|name| name == "min_r");
    let bounds = &BOUNDS[..if has_colors { 18 } else { 12 }];
    let bounds: Vec<f32> = chunks.float_rows(bounds)?;
    let words = vertices.words(&WORDS, Scalar::U32)?;
    let words = words.as_chunks::<4>().0;
    let expected = words.len().div_ceil(CHUNK);
    if chunks.len() != expected {
        return Err(PlyProblem::Rows { element: "chunk", expected, found: chunks.len() });
    }
    let (sh_degree, harmonics) = harmonics(bytes, words.len())?;
    let width = bounds.len() / expected.max(1);
    let mut cloud = GaussianCloud { sh_degree, ..GaussianCloud::default() };
    for (chunk, members) in words.chunks(CHUNK).enumerate() {
        let chunk = Chunk::of(&bounds[chunk * width..(chunk + 1) * width]);
        for &[mean, rotation, scale, rgba] in members {
            let coarse = |word: u32| {
                [unit_of_bits(word >> 21, 11), unit_of_bits(word >> 11, 10), unit_of_bits(word, 11)]
            };
            let dcs = chunk.colors.values([24, 16, 8].map(|shift| unit_of_bits(rgba >> shift, 8))).map(dc);
            cloud.means.push(chunk.means.values(coarse(mean)));
            cloud.rotations.push(unpacked_rotation(rotation));
            cloud.log_scales.push(chunk.log_scales.values(coarse(scale)));
            cloud.raw_opacities.push(raw_opacity(rgba as u8));
            cloud.sh.extend(dcs);
            let higher = 3 * (sh_coefficients(sh_degree) - 1);
            let own = &harmonics[(cloud.means.len() - 1) * higher..][..higher];
            cloud.sh.extend((0..higher).map(|at| harmonic(own[at % 3 * (higher / 3) + at / 3] as u8)));
        }
    }
    cloud.validate()?;
    cloud.log_scales = finite_scales(cloud.log_scales)?;
    Ok(cloud)
}

/// Degree and bytes of the harmonics above the zeroth, channel by channel for each Gaussian.
fn harmonics(bytes: &[u8], count: usize) -> Result<(usize, Vec<u32>), PlyProblem> {
    let table = match Table::of(bytes, "sh") {
        Err(PlyProblem::NoElement(_)) => return Ok((0, Vec::new())),
        table => table?,
    };
    let width = table.names().count();
    let degree = (1..=3).find(|&degree| 3 * (sh_coefficients(degree) - 1) == width);
    let sh_degree = degree.ok_or(PlyProblem::Harmonics(width))?;
    if table.len() != count {
        return Err(PlyProblem::Rows { element: "sh", expected: count, found: table.len() });
    }
    let names: Vec<String> = (0..width).map(|i| format!("f_rest_{i}")).collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    Ok((sh_degree, table.words(&names, Scalar::U8)?))
}
