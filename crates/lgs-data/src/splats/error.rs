//! Defects of splat files.

use std::path::{Path, PathBuf};

use lgs_core::CloudError;

use crate::files::FileError;
use crate::ply::PlyError;

/// A splat file that cannot be read or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SplatError {
    /// The file can't be read or written.
    #[error(transparent)]
    File(#[from] FileError),
    /// A polygon file is malformed.
    #[error(transparent)]
    Ply(#[from] PlyError),
    /// The contents are not what they should be.
    #[error("{problem}: {}", path.display())]
    Content {
        /// The file.
        path: PathBuf,
        /// The defect.
        problem: SplatProblem,
    },
}

impl SplatError {
    pub(super) fn new(path: &Path, problem: SplatProblem) -> Self {
        Self::Content { path: path.to_path_buf(), problem }
    }

    /// The file that the error is about.
    #[must_use]
    pub fn path(&self) -> &Path {
        match self {
            Self::File(error) => error.path(),
            Self::Ply(error) => error.path(),
            Self::Content { path, .. } => path,
        }
    }
}

/// A defect of a `.splat` or `.spz` file.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SplatProblem {
    /// Of no known format.
    #[error("expected a splat file: .ply, .compressed.ply, .splat or .spz")]
    Format,
    /// A `.splat` file that does not consist of whole Gaussians.
    #[error("expected 32 bytes for each Gaussian, found {0} bytes")]
    Length(usize),
    /// The header promises more or fewer bytes than there are.
    #[error("expected {expected} bytes for {count} Gaussians, found {found}")]
    Count {
        /// Gaussians announced.
        count: u64,
        /// Bytes that they take.
        expected: u64,
        /// Bytes present; a lower bound where there are too many.
        found: u64,
    },
    /// The file ends before its contents do.
    #[error("expected {expected} bytes, found {found}")]
    Ends {
        /// Bytes that the contents take.
        expected: u64,
        /// Bytes present.
        found: u64,
    },
    /// A field of the header has a value that is not read.
    #[error("`{field}`: expected {expected}, found {found}")]
    Header {
        /// The field.
        field: &'static str,
        /// The expectation.
        expected: &'static str,
        /// The value.
        found: String,
    },
    /// A value of a Gaussian is impossible.
    #[error("`{field}` of Gaussian {index}: expected {expected}, found {found}")]
    Value {
        /// The field.
        field: &'static str,
        /// The Gaussian.
        index: usize,
        /// The expectation.
        expected: &'static str,
        /// The value.
        found: f32,
    },
    /// The compressed data are damaged.
    #[error("can't decompress: {0}")]
    Damaged(String),
    /// The cloud to be written is invalid.
    #[error("the Gaussians can't be written: {0}")]
    Cloud(#[from] CloudError),
}
