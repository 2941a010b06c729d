//! Errors of reading and writing source models.

use std::path::{Path, PathBuf};

use lgs_core::CloudError;
use lgs_data::files::FileError;
use lgs_data::frames::FramesError;
use lgs_data::ply::PlyError;
use lgs_data::pth::PthError;

use crate::tensor_file::TensorFileError;

/// Why a source model could not be written or read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SourceError {
    /// The file itself.
    #[error(transparent)]
    File(#[from] TensorFileError),
    /// The Gaussians do not fit together.
    #[error("canonical Gaussians: {source}: {path}")]
    Cloud {
        /// File.
        path: PathBuf,
        /// Defect.
        source: CloudError,
    },
    /// Frames to import.
    #[error(transparent)]
    Frames(#[from] FramesError),
    /// A PyTorch checkpoint to import.
    #[error(transparent)]
    Checkpoint(#[from] PthError),
    /// A splat file to import.
    #[error(transparent)]
    Splats(#[from] PlyError),
    /// A folder that can't be read.
    #[error(transparent)]
    Folder(#[from] FileError),
    /// The output of another program without a whole model.
    #[error("expected `point_cloud/iteration_N` and `deform/iteration_N` of the same N, found none: {path}")]
    NoIteration {
        /// The folder.
        path: PathBuf,
    },
}

impl SourceError {
    /// The file or folder that the error is about.
    #[must_use]
    pub fn path(&self) -> &Path {
        match self {
            Self::File(error) => error.path(),
            Self::Frames(error) => error.path(),
            Self::Checkpoint(error) => error.path(),
            Self::Splats(error) => error.path(),
            Self::Folder(error) => error.path(),
            Self::Cloud { path, .. } | Self::NoIteration { path } => path,
        }
    }
}
