//! Which kinds of source models there are, and reading one whose kind only its file knows.

use std::path::{Path, PathBuf};

use lgs_core::CloudError;
use lgs_data::files::FileError;
use lgs_data::frames::{FramesError, read_frames};
use lgs_data::ply::PlyError;
use lgs_data::pth::PthError;
use serde::{Deserialize, Serialize};

use super::{DefGs, FreeGave, ImportedFrames, SourceModel, is_official_defgs, read_official_defgs};
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
    /// Trajectories from files ([`ImportedFrames`]).
    Frames,
}

impl SourceKind {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Defgs, Self::Freegave, Self::Frames];

    /// Its name in configurations, messages and file names.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Defgs => "defgs",
            Self::Freegave => "freegave",
            Self::Frames => "frames",
        }
    }

    /// Format name and version of its file.
    #[must_use]
    pub fn format(self) -> &'static str {
        match self {
            Self::Defgs => "lagrangegs-defgs/1",
            Self::Freegave => "lagrangegs-freegave/1",
            Self::Frames => "lagrangegs-frames/1",
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

/// The kind of source model that [`import_source`] makes of a file or folder.
#[must_use]
pub fn imported_kind(path: &Path) -> SourceKind {
    if is_official_defgs(path) { SourceKind::Defgs } else { SourceKind::Frames }
}

/// Reads a source model that another program wrote: frames ([`lgs_data::frames`]), or an output folder of the
/// authors' DefGS program.
///
/// # Errors
/// If something is absent, malformed, not finite or does not fit together.
pub fn import_source(path: &Path) -> Result<Box<dyn SourceModel>, SourceError> {
    match imported_kind(path) {
        SourceKind::Defgs => Ok(Box::new(read_official_defgs(path)?)),
        _ => Ok(Box::new(ImportedFrames::new(read_frames(path)?))),
    }
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
        SourceKind::Frames => Ok(Box::new(ImportedFrames::from_tensors(&file, path)?)),
    }
}
