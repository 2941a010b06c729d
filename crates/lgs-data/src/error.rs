//! The shape of every error about the contents of a file.

use crate::files::{FileError, destination_of};
use crate::ply::PlyError;
use std::path::{Path, PathBuf};

/// A file or folder that cannot be read, with the problem of its contents as `P`.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReadError<P> {
    /// A file or folder is out of reach.
    #[error(transparent)]
    File(#[from] FileError),
    /// A file of points is malformed.
    #[error(transparent)]
    Ply(#[from] PlyError),
    /// The contents of a file are wrong, or those of several files do not fit together.
    #[error("{problem}: {}", path.display())]
    Content {
        /// The file or folder.
        path: PathBuf,
        /// The defect.
        problem: P,
    },
}

impl<P> ReadError<P> {
    pub(crate) fn new(path: &Path, problem: P) -> Self {
        Self::Content { path: destination_of(path), problem }
    }

    /// The same error with another problem for its problem.
    pub(crate) fn map<Q>(self, problem_of: impl FnOnce(P) -> Q) -> ReadError<Q> {
        match self {
            Self::File(error) => ReadError::File(error),
            Self::Ply(error) => ReadError::Ply(error),
            Self::Content { path, problem } => ReadError::Content { path, problem: problem_of(problem) },
        }
    }

    /// The file or folder that the error is about.
    #[must_use]
    pub fn path(&self) -> &Path {
        match self {
            Self::File(error) => error.path(),
            Self::Ply(error) => error.path(),
            Self::Content { path, .. } => path,
        }
    }
}
