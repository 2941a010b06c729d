//! Why a report could not be made.

use std::path::{Path, PathBuf};

use lgs_data::files::FileError;
use lgs_data::ply::PlyError;

/// Why a report could not be made.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReportError {
    /// A file could not be read or written.
    #[error(transparent)]
    File(#[from] FileError),
    /// The colour-coded splat file could not be written.
    #[error(transparent)]
    Splats(#[from] PlyError),
    /// A figure could not be drawn.
    #[error("figure `{figure}`: {reason}")]
    Drawing {
        /// Name of the figure.
        figure: String,
        /// The message of plotters.
        reason: String,
    },
    /// The metrics of a run are damaged.
    #[error("the metrics are damaged: {reason}: {}", path.display())]
    Metrics {
        /// The file.
        path: PathBuf,
        /// The parser's message.
        reason: String,
    },
}

impl ReportError {
    /// The file or folder that the error is about; none where a figure cannot be drawn.
    #[must_use]
    pub fn path(&self) -> Option<&Path> {
        match self {
            Self::File(error) => Some(error.path()),
            Self::Splats(error) => Some(error.path()),
            Self::Metrics { path, .. } => Some(path),
            Self::Drawing { .. } => None,
        }
    }
}
