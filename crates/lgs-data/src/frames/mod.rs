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
mod tensors;
mod times;

pub use error::{FramesError, FramesProblem};

use std::path::Path;

use crate::files::FileError;
use lgs_core::GaussianCloud;

/// Gaussians at several times.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameSequence {
    /// The Gaussians at the frame nearest to t = 0.
    pub gaussians: GaussianCloud,
    /// Times of the frames, strictly ascending, at least two.
    pub times: Vec<f32>,
    /// Centres, `[T][n]`, world units.
    pub positions: Vec<Vec<[f32; 3]>>,
    /// Quaternions w x y z, `[T][n]`, or `[1][n]` where nothing turns; of any length but zero.
    pub rotations: Vec<Vec<[f32; 4]>>,
}

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

    /// Checks that folders and files share; lengths agree already.
    fn check(&self) -> Result<(), FramesProblem> {
        if self.times.len() < 2 {
            return Err(FramesProblem::TooFew(self.times.len()));
        }
        if let Some(pair) =
            self.times.windows(2).find(|pair| pair[0].partial_cmp(&pair[1]) != Some(std::cmp::Ordering::Less))
        {
            return Err(FramesProblem::NotAscending { before: pair[0], after: pair[1] });
        }
        let zero = |q: &[f32; 4]| q.iter().all(|v| v.abs() < f32::MIN_POSITIVE);
        for (frame, row) in self.rotations.iter().enumerate() {
            if let Some(index) = row.iter().position(zero) {
                return Err(FramesProblem::ZeroRotation { frame, index });
            }
        }
        Ok(())
    }
}

/// Which of several ascending times is nearest to 0.
fn nearest_to_start(times: &[f32]) -> usize {
    let distance = |i: &usize| times[*i].abs();
    (0..times.len()).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(0)
}

#[cfg(test)]
mod tests;
