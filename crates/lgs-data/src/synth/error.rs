//! Errors of synthetic scenes.

use super::scenes::scenes;
use crate::files::FileError;
use std::path::{Path, PathBuf};

/// A synthetic scene that can't be made or read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SynthError {
    /// There is no scene of that name.
    #[error("there is no scene `{0}`; expected one of {names}", names = scene_names())]
    UnknownScene(String),
    /// An option is out of range.
    #[error("`{option}` should be {expected}, found {found}")]
    Option {
        /// The option.
        option: &'static str,
        /// The expectation.
        expected: &'static str,
        /// The value given.
        found: u64,
    },
    /// The destination is not empty.
    #[error("the output folder should be new or empty: {}", .0.display())]
    Occupied(PathBuf),
    /// A file can't be written or read.
    #[error(transparent)]
    File(#[from] FileError),
    /// A ground-truth file is wrong.
    #[error("bad ground truth: {reason}: {}", path.display())]
    Truth {
        /// The file.
        path: PathBuf,
        /// The defect.
        reason: String,
    },
}

impl SynthError {
    /// The file or folder that the error is about, unless it is about the call.
    #[must_use]
    pub fn path(&self) -> Option<&Path> {
        match self {
            Self::UnknownScene(_) | Self::Option { .. } => None,
            Self::Occupied(path) | Self::Truth { path, .. } => Some(path),
            Self::File(error) => Some(error.path()),
        }
    }
}

fn scene_names() -> String {
    scenes().iter().map(|info| info.name).collect::<Vec<_>>().join(", ")
}
