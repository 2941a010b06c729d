//! Errors of reading and writing tensor files.

use std::path::{Path, PathBuf};

/// Why a tensor file could not be written or read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TensorFileError {
    /// The file could not be read.
    #[error("cannot read: {source}: {path}")]
    Read {
        /// File.
        path: PathBuf,
        /// Cause.
        source: std::io::Error,
    },
    /// The file could not be written.
    #[error("cannot write the file: {0}")]
    Write(#[from] lgs_data::files::FileError),
    /// The bytes are not a whole safetensors file (truncated, or something else).
    #[error("the file is damaged or not a tensor file: {reason}: {path}")]
    Damaged {
        /// File.
        path: PathBuf,
        /// Finding of the parser.
        reason: String,
    },
    /// Another kind of file, or another version of this one.
    #[error("expected `{expected}`, found `{found}`: {path}")]
    Format {
        /// File.
        path: PathBuf,
        /// Format name and version asked for.
        expected: String,
        /// Format name and version found.
        found: String,
    },
    /// A tensor or a metadata entry is absent.
    #[error("`{field}` is missing: {path}")]
    Missing {
        /// File.
        path: PathBuf,
        /// Name asked for.
        field: String,
    },
    /// A tensor or a metadata entry has another type, shape or value than expected.
    #[error("`{field}`: expected {expected}, found {found}: {path}")]
    Field {
        /// File.
        path: PathBuf,
        /// Name of the tensor or entry.
        field: String,
        /// The expectation.
        expected: String,
        /// The finding.
        found: String,
    },
}

impl TensorFileError {
    /// The file that the error is about.
    #[must_use]
    pub fn path(&self) -> &Path {
        match self {
            Self::Write(error) => error.path(),
            Self::Read { path, .. }
            | Self::Damaged { path, .. }
            | Self::Format { path, .. }
            | Self::Missing { path, .. }
            | Self::Field { path, .. } => path,
        }
    }
}
