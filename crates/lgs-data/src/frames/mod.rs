//! Trajectories from elsewhere: the same Gaussians, in the same order, at several times.
//!
//! Any system of moving splats can hand its result over in one of four forms. [`read_frames`] tells them
//! apart:
//!
//! - a folder of splat files of one format ([`crate::splats`]) with their times. These come from the first
//!   of: `frames.json`, the list that `lagrangegs export` leaves (`{"frames": [{"file": …, "time": …}]}`);
//!   `times.json`, an array of numbers in the order of the file names or an object from file name to number;
//!   `times.txt`, a number per line in the order of the file names; the names themselves, which then end in
//!   `t` and a number (`0003_t+0.0300.ply`) or in a number with a decimal point (`ball_0.03.ply`), or else
//!   differ by a number alone (`frame0001.ply`, `point_cloud_12.ply`) and span [0, 1). Numbers within names
//!   count as numbers in their order.
//! - a `.safetensors` file of 32-bit floats: `times [T]`, `positions [T, n, 3]`, and where there are splats
//!   `rotations [T, n, 4]` or `[n, 4]` (w x y z), and the Gaussians' raw `log_scales [n, 3]`,
//!   `raw_opacities [n]` and `sh [n, K, 3]`;
//! - moving Gaussians of splaTV ([`crate::splats::splatv`]): `.splatv`;
//! - point tracks of motion capture ([`crate::tracks`]): `.c3d`, `.csv`, `.tsv`.
//!
//! Gaussians move and turn; their scales, opacities and colours are those of the frame nearest to t = 0. Bare
//! points become round grey Gaussians that do not turn.

mod error;
mod folder;
mod points;
mod sequence;
mod tensors;
mod times;
mod video;

pub use error::{FramesError, FramesProblem};
pub use sequence::FrameSequence;

use std::path::Path;

use lgs_core::GaussianCloud;

use crate::files::FileError;
use crate::tracks::is_track_file;

/// Reads a folder of splat files, a file of tensors or one of point tracks.
///
/// # Errors
/// If something is absent or malformed, times are missing or repeated, frames differ in their number of
/// Gaussians, a value is not finite or a quaternion is zero. The error names the file, and the frame or
/// field.
pub fn read_frames(path: &Path) -> Result<FrameSequence, FramesError> {
    let sequence = match path {
        folder if folder.is_dir() => folder::read(folder)?,
        file if is_track_file(file) => points::read(file)?,
        file if file.extension().is_some_and(|e| e.eq_ignore_ascii_case("splatv")) => video::read(file)?,
        file => tensors::read(file)?,
    };
    sequence.check().map_err(|problem| FramesError::new(path, problem))?;
    Ok(sequence)
}

/// A frame in a folder.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameFile {
    /// Name of the file.
    pub name: String,
    /// Its time, if the folder tells the times of its frames.
    pub time: Option<f32>,
}

/// The frames of a folder in the order of their times, or else of their names; none are read.
///
/// # Errors
/// If the folder can't be read, has frames of several formats, or a list of times that is malformed.
pub fn list_frames(folder: &Path) -> Result<Vec<FrameFile>, FramesError> {
    let names = folder::names(folder)?;
    let timed = match times::of_folder(folder, names.clone()) {
        Ok(mut timed) => {
            timed.sort_by(|a, b| a.1.total_cmp(&b.1));
            timed.into_iter().map(|(name, time)| (name, Some(time))).collect()
        }
        Err(FramesError::Content { problem: FramesProblem::NoTime(_) | FramesProblem::NoFrames, .. }) => {
            names.into_iter().map(|name| (name, None)).collect::<Vec<_>>()
        }
        Err(error) => return Err(error),
    };
    Ok(timed.into_iter().map(|(name, time)| FrameFile { name, time }).collect())
}

impl FrameSequence {
    /// All Gaussians at a frame, counted from 0.
    #[must_use]
    pub fn cloud(&self, frame: usize) -> GaussianCloud {
        GaussianCloud {
            means: self.positions[frame].clone(),
            rotations: self.rotations[if self.rotations.len() == 1 { 0 } else { frame }].clone(),
            ..self.gaussians.clone()
        }
    }

    /// Writes a `.safetensors` file that [`read_frames`] reads.
    ///
    /// # Errors
    /// If the file can't be written.
    pub fn save(&self, path: &Path) -> Result<(), FileError> {
        tensors::write(self, path)
    }
}

#[cfg(test)]
mod tests;
