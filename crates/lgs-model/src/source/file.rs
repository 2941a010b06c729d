//! Which kinds of source models there are, and reading one whose kind only its file knows.

use std::path::{Path, PathBuf};

use lgs_core::CloudError;
use serde::{Deserialize, Serialize};

use super::{DefGs, FreeGave, SourceModel};
use crate::tensor_file::{TensorFile, TensorFileError};

/// A kind of source model.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SourceKind {
    /// A deformation network ([`DefGs`]).
    #[default]
    Defgs,
    /// A deformation network that a velocity field carries on ([`FreeGave`]).
    Freegave,
}

impl SourceKind {
    /// All of them.
    pub const ALL: [Self; 2] = [Self::Defgs, Self::Freegave];

    /// Its name in configurations, messages and file names.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Defgs => "defgs",
            Self::Freegave => "freegave",
        }
    }

    /// Format name and version of its file.
    #[must_use]
    pub fn format(self) -> &'static str {
        match self {
            Self::Defgs => "lagrangegs-defgs/1",
            Self::Freegave => "lagrangegs-freegave/1",
        }
    }
}

/// Why a source model could not be written or read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SourceError {
    /// The file itself.
    #[error(transparent)]
    File(#[from] TensorFileError),
    /// The Gaussians do not fit together.
    #[error("{path}: canonical Gaussians: {source}")]
    Cloud {
        /// File.
        path: PathBuf,
        /// Defect.
        source: CloudError,
    },
}

/// Reads a source model of any kind.
///
/// # Errors
/// If the file cannot be read, is damaged, of no known kind or version, or its arrays do not fit together.
pub fn load_source(path: &Path) -> Result<Box<dyn SourceModel>, SourceError> {
    let file = TensorFile::load_one_of(path, &SourceKind::ALL.map(SourceKind::format))?;
    let kind = SourceKind::ALL.into_iter().find(|kind| kind.format() == file.format()).unwrap_or_default();
    match kind {
        SourceKind::Defgs => Ok(Box::new(DefGs::from_tensors(&file, path)?)),
        SourceKind::Freegave => Ok(Box::new(FreeGave::from_tensors(&file, path)?)),
    }
}
