//! Why there is no recording.

use std::path::{Path, PathBuf};

use lgs_data::files::FileError;

/// Why there is no recording.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RerunError {
    /// The program was built without recordings.
    #[error(
        "this build writes no recordings; get one that does with `cargo install --path apps/lagrangegs \
         --features rerun`: {}",
        path.display()
    )]
    NotBuilt {
        /// The recording asked for.
        path: PathBuf,
    },
    /// A name that rerun's viewer would not open.
    #[error("a recording's name ends with .rrd: {}", path.display())]
    Name {
        /// The recording asked for.
        path: PathBuf,
    },
    /// The file cannot be written.
    #[error(transparent)]
    File(#[from] FileError),
    /// What is recorded cannot be encoded.
    #[error("the recording cannot be written: {reason}: {}", path.display())]
    Encode {
        /// The recording.
        path: PathBuf,
        /// The encoder's reason.
        reason: String,
    },
}

impl RerunError {
    /// The recording.
    #[must_use]
    pub fn path(&self) -> &Path {
        match self {
            Self::NotBuilt { path } | Self::Name { path } | Self::Encode { path, .. } => path,
            Self::File(error) => error.path(),
        }
    }
}
