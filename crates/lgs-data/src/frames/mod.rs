//! Trajectories from elsewhere: the same Gaussians, in the same order, at several times.
//!
//! Any system of moving splats can hand its result over in one of two forms. [`read_frames`] tells them
//! apart:
//!
//! - a folder of `.ply` frames ([`crate::ply`]) with their times. These come from the first of:
//!   `frames.json`, the list that `lagrangegs export` leaves (`{"frames": [{"file": …, "time": …}]}`);
//!   `times.json`, an array of numbers in the order of the file names or an object from file name to number;
//!   `times.txt`, a number per line in the order of the file names; the names themselves, which then end in
//!   `t` and a number (`0003_t+0.0300.ply`) or in a number with a decimal point (`ball_0.03.ply`). Numbers
//!   within names count as numbers in their order.
//! - a `.safetensors` file of 32-bit floats: `times [T]`, `positions [T, n, 3]`, `rotations [T, n, 4]` or
//!   `[n, 4]` (w x y z), and the Gaussians' raw `log_scales [n, 3]`, `raw_opacities [n]` and `sh [n, K, 3]`.
//!
//! Gaussians move and turn; their scales, opacities and colours are those of the frame nearest to t = 0.

mod error;
mod folder;
mod sequence;
mod tensors;
mod times;

pub use error::{FramesError, FramesProblem};
pub use sequence::FrameSequence;

use std::path::Path;

use crate::files::FileError;

/// Reads a folder of splat files, or a file of tensors.
///
/// # Errors
/// If something is absent or malformed, times are missing or repeated, frames differ in their number of
/// Gaussians, a value is not finite or a quaternion is zero. The error names the file, and the frame or
/// field.
pub fn read_frames(path: &Path) -> Result<FrameSequence, FramesError> {
    let sequence = if path.is_dir() { folder::read(path)? } else { tensors::read(path)? };
    sequence.check().map_err(|problem| FramesError::new(path, problem))?;
    Ok(sequence)
}

impl FrameSequence {
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
