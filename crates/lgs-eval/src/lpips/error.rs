//! Errors of importing and loading LPIPS weights.

use std::path::{Path, PathBuf};

use lgs_data::files::FileError;
use lgs_data::pth::PthError;
use lgs_model::TensorFileError;

/// Why weights could not be imported or loaded.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum WeightsError {
    /// The file to import can't be read.
    #[error(transparent)]
    Checkpoint(#[from] PthError),
    /// A stored file can't be read.
    #[error(transparent)]
    Stored(#[from] TensorFileError),
    /// A file or folder can't be read or written.
    #[error(transparent)]
    File(#[from] FileError),
    /// The file holds the weights of none of the networks.
    #[error(
        "expected torchvision's VGG-16 or AlexNet (`features.0.weight`) or LPIPS linear weights \
            (`lin0.model.1.weight`), \
         found {found}: {}",
        path.display()
    )]
    Unknown {
        /// The file.
        path: PathBuf,
        /// Names of the first tensors in it.
        found: String,
    },
    /// The contents do not match the hash in the file's own name.
    #[error("the name says that the SHA-256 hash starts with {expected}, found {found}: the download is \
        damaged: {}", path.display())]
    Hash {
        /// The file.
        path: PathBuf,
        /// First digits of the hash, from the file's name.
        expected: String,
        /// The same digits of the hash of the contents.
        found: String,
    },
    /// The weights are those of LPIPS 0.0.
    #[error("expected the linear weights of LPIPS 0.1, found those of 0.0, which give other figures: \
        {}", path.display())]
    Superseded {
        /// The file.
        path: PathBuf,
    },
}

impl WeightsError {
    /// The file or folder that the error is about.
    #[must_use]
    pub fn path(&self) -> &Path {
        match self {
            Self::Checkpoint(error) => error.path(),
            Self::Stored(error) => error.path(),
            Self::File(error) => error.path(),
            Self::Unknown { path, .. } | Self::Hash { path, .. } | Self::Superseded { path } => path,
        }
    }
}
