//! `.splat` files as antimatter15's viewer reads them: 32 bytes for each Gaussian, without a header.
//!
//! Centre and scales (standard deviations) are six 32-bit floats, little endian; then come red, green, blue
//! and opacity as bytes, and the unit quaternion w x y z with each component c as the byte 128 + 128 c.

use std::path::Path;

use lgs_core::GaussianCloud;
use lgs_core::linear::quat_normalize;

use super::error::{SplatError, SplatProblem};
use super::quantise::{color, dc, opacity_byte, raw_opacity, unit_of_bits, unit_to_bits};
use crate::files::{read_bytes, write_atomically};

/// Bytes of a Gaussian.
const ROW: usize = 32;

/// Reads Gaussians of degree 0. A scale of 0 becomes the smallest that has a logarithm.
///
/// # Errors
/// If the file can't be read, does not consist of whole Gaussians, or a value is impossible.
pub fn read_splat(path: &Path) -> Result<GaussianCloud, SplatError> {
    parse(&read_bytes(path)?).map_err(|problem| SplatError::new(path, problem))
}

/// Writes the Gaussians' zeroth harmonics; higher ones have no place in the format.
///
/// # Errors
/// If the cloud is invalid or the file can't be written.
pub fn write_splat(path: &Path, cloud: &GaussianCloud) -> Result<(), SplatError> {
    cloud.validate().map_err(|e| SplatError::new(path, e.into()))?;
    Ok(write_atomically(path, |w| (0..cloud.len()).try_for_each(|index| w.write_all(&row(cloud, index))))?)
}

fn row(cloud: &GaussianCloud, index: usize) -> [u8; ROW] {
    let scales = cloud.log_scales[index].map(|s| s.exp().min(f32::MAX));
    let sh = &cloud.sh[index * cloud.sh_stride()..];
    let mut row = [0; ROW];
    for (word, value) in row.chunks_exact_mut(4).zip(cloud.means[index].into_iter().chain(scales)) {
        word.copy_from_slice(&value.to_le_bytes());
    }
    for (byte, dc) in row[24..27].iter_mut().zip(sh) {
        *byte = unit_to_bits(color(*dc), 8) as u8;
    }
    row[27] = opacity_byte(cloud.raw_opacities[index]);
    for (byte, component) in row[28..].iter_mut().zip(quat_normalize(cloud.rotations[index])) {
        *byte = (128.0 + 128.0 * component).round().clamp(0.0, 255.0) as u8;
    }
    row
}

fn parse(bytes: &[u8]) -> Result<GaussianCloud, SplatProblem> {
    let (rows, rest) = bytes.as_chunks::<ROW>();
    // Nothing tells an empty cloud from a file that lost its contents.
    if rows.is_empty() || !rest.is_empty() {
        return Err(SplatProblem::Length(bytes.len()));
    }
    let mut cloud = GaussianCloud::default();
    for (index, row) in rows.iter().enumerate() {
        let value = |field, expected, found| SplatProblem::Value { field, index, expected, found };
        let float = |word: usize| f32::from_le_bytes(std::array::from_fn(|byte| row[4 * word + byte]));
        let (mean, scales) = ([0, 1, 2].map(float), [3, 4, 5].map(float));
        if let Some(&found) = mean.iter().find(|v| !v.is_finite()) {
            return Err(value("position", "finite numbers", found));
        }
        if let Some(&found) = scales.iter().find(|v| !(v.is_finite() && **v >= 0.0)) {
            return Err(value("scale", "finite numbers of 0 or more", found));
        }
        let rotation = [28, 29, 30, 31].map(|byte| (f32::from(row[byte]) - 128.0) / 128.0);
        if rotation == [0.0; 4] {
            return Err(value("rotation", "a quaternion of some length", 0.0));
        }
        cloud.means.push(mean);
        cloud.log_scales.push(scales.map(|s| s.max(f32::MIN_POSITIVE).ln()));
        cloud.rotations.push(quat_normalize(rotation));
        cloud.raw_opacities.push(raw_opacity(row[27]));
        cloud.sh.extend([24, 25, 26].map(|byte: usize| dc(unit_of_bits(row[byte].into(), 8))));
    }
    Ok(cloud)
}
