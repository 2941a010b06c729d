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
    /// The output of the DefGS program without one of its folders.
    #[error("expected the folder `{part}` ({holds}) in an output of the DefGS program, found none: {path}")]
    NoPart {
        /// The folder.
        path: PathBuf,
        /// Name of the folder that is absent.
        part: &'static str,
        /// The contents of that folder.
        holds: &'static str,
    },
    /// The output of the DefGS program without a whole model.
    #[error(
        "expected `point_cloud/iteration_N` and `deform/iteration_N` of the same N, found N of {gaussians} \
         and of {networks}: {path}"
    )]
    NoIteration {
        /// The folder.
        path: PathBuf,
        /// Iterations with Gaussians.
        gaussians: String,
        /// Iterations with networks.
        networks: String,
    },
    /// Settings of the DefGS program that are none.
    #[error("expected `Namespace(…)`, found `{found}`: {path}")]
    Settings {
        /// The file.
        path: PathBuf,
        /// Its first words.
        found: String,
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
            Self::Cloud { path, .. }
            | Self::NoPart { path, .. }
            | Self::NoIteration { path, .. }
            | Self::Settings { path, .. } => path,
        }
    }
}
