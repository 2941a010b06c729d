//! Defects of a sequence of frames.

use crate::ReadError;
use crate::splats::{SplatError, SplatProblem};
use crate::tracks::{TracksError, TracksProblem};

/// Frames that cannot be read.
pub type FramesError = ReadError<FramesProblem>;

impl From<TracksError> for FramesError {
    fn from(error: TracksError) -> Self {
        error.map(Into::into)
    }
}

impl From<SplatError> for FramesError {
    fn from(error: SplatError) -> Self {
        error.map(Into::into)
    }
}

/// A defect of a sequence of frames, which are counted from 0.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FramesProblem {
    /// The folder holds no frame.
    #[error("expected frames of splats (.ply, .compressed.ply, .splat, .spz), found none")]
    NoFrames,
    /// The folder holds frames of several formats.
    #[error("expected frames of one format, found `{0}` beside `{1}`")]
    Formats(String, String),
    /// There are fewer than two frames.
    #[error("expected at least 2 frames, found {0}")]
    TooFew(usize),
    /// A frame has no time.
    #[error(
        "the frame `{0}` has no time; expected it in `frames.json`, `times.json` or `times.txt`, at the end \
         of the name, as in `0003_t+0.0300.ply`, or names that differ by a number alone, as `frame0001.ply`"
    )]
    NoTime(String),
    /// A list of times has another length than the list of frames.
    #[error("expected a time for each of {expected} frames, found {found}")]
    Times {
        /// Number of frames.
        expected: usize,
        /// Number of times.
        found: usize,
    },
    /// A list of times that is not one.
    #[error("malformed times: {0}")]
    Malformed(String),
    /// Two frames of one time, or tensors out of order.
    #[error("`times`: expected finite and strictly ascending numbers, found {before} before {after}")]
    NotAscending {
        /// A time.
        before: f32,
        /// The next one.
        after: f32,
    },
    /// A frame has more or fewer Gaussians than the first.
    #[error("expected {expected} Gaussians as in the first frame, found {found}")]
    Count {
        /// Gaussians of the first frame.
        expected: usize,
        /// Gaussians of this frame.
        found: usize,
    },
    /// A quaternion that stands for no rotation.
    #[error("`rotations`: the quaternion of Gaussian {index} in frame {frame} is zero")]
    ZeroRotation {
        /// Number of the frame.
        frame: usize,
        /// Number of the Gaussian.
        index: usize,
    },
    /// No Gaussian of a `.splatv` file is there throughout.
    #[error("expected Gaussians that are visible from t = 0 to t = 1, found none of {0}")]
    ComeAndGo(usize),
    /// A file of point tracks.
    #[error(transparent)]
    Tracks(#[from] TracksProblem),
    /// A splat file.
    #[error(transparent)]
    Splats(#[from] SplatProblem),
    /// The file is not a safetensors file.
    #[error("no folder of frames, no point tracks (.c3d, .csv, .tsv) and no whole safetensors file: {0}")]
    Tensors(String),
    /// A tensor is absent or not as it should be.
    #[error("`{field}`: expected {expected}, found {found}")]
    Tensor {
        /// Name of the tensor.
        field: &'static str,
        /// The expectation.
        expected: String,
        /// The value in the file.
        found: String,
    },
}
