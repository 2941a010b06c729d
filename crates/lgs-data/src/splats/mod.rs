//! Splat files: Gaussians of one moment in any of the formats that other programs exchange.
//!
//! | format | Gaussians as |
//! |---|---|
//! | `ply` | all values in single precision ([`crate::ply`]) |
//! | `compressed-ply` | PlayCanvas: chunks of 256 with bounds, four packed words each ([`compressed`]) |
//! | `splat` | antimatter15: 32 bytes each, no view-dependent colour ([`splat`]) |
//! | `spz` | Niantic: columns of bytes, compressed ([`spz`]) |
//!
//! [`splatv`] is antimatter15's format of moving Gaussians, which is read alone.
//!
//! Readers and writers keep the order of the Gaussians; what is lost is quantisation alone, and in `splat`
//! the harmonics above degree 0.

pub mod compressed;
mod error;
mod format;
mod quantise;
pub mod splat;
pub mod splatv;
pub mod spz;

pub use error::{SplatError, SplatProblem};
pub use format::SplatFormat;

use std::path::Path;

use lgs_core::GaussianCloud;

use crate::ply::{read_ply, write_ply};

/// Reads a splat file of any format, by its contents and the end of its name.
///
/// # Errors
/// If it can't be read, is of no known format, or its contents are not those of a valid cloud.
pub fn read_splats(path: &Path) -> Result<GaussianCloud, SplatError> {
    match SplatFormat::of_file(path)? {
        SplatFormat::Ply => Ok(read_ply(path)?),
        SplatFormat::CompressedPly => Ok(compressed::read_compressed_ply(path)?),
        SplatFormat::Splat => splat::read_splat(path),
        SplatFormat::Spz => spz::read_spz(path),
    }
}

/// Writes a splat file, whole or not at all.
///
/// # Errors
/// If the cloud is invalid, a value is outside of what the format holds, or the file can't be written.
pub fn write_splats(path: &Path, cloud: &GaussianCloud, format: SplatFormat) -> Result<(), SplatError> {
    match format {
        SplatFormat::Ply => Ok(write_ply(path, cloud)?),
        SplatFormat::CompressedPly => Ok(compressed::write_compressed_ply(path, cloud)?),
        SplatFormat::Splat => splat::write_splat(path, cloud),
        SplatFormat::Spz => spz::write_spz(path, cloud),
    }
}

#[cfg(test)]
mod tests;
