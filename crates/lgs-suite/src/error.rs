//! Errors of reading, planning and running a suite.

use std::path::{Path, PathBuf};

use lgs_data::files::FileError;
use lgs_train::TrainError;
use lgs_train::config::ConfigError;

/// Why a suite cannot be read, planned or run.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SuiteError {
    /// The file cannot be read.
    #[error("there is no suite file, and no bundled suite of that name ({known}): {reason}: \
        {}", path.display())]
    Read {
        /// The name or path that was asked for.
        path: PathBuf,
        /// The reason why it is no file.
        reason: std::io::Error,
        /// Names of the bundled suites.
        known: String,
    },
    /// The file is not TOML, or has a key that does not exist.
    #[error("{reason}: {origin}")]
    Syntax {
        /// The file.
        origin: String,
        /// The parser's message; an unknown key comes with the known ones.
        reason: String,
    },
    /// A name does not exist.
    #[error("unknown {what} `{name}`; known: {known}: {origin}")]
    Unknown {
        /// The kind of name: scene, method or variant.
        what: &'static str,
        /// The name.
        name: String,
        /// All names that exist.
        known: String,
        /// The file.
        origin: String,
    },
    /// A key has a value that it cannot have.
    #[error("`{key}`: {reason}: {origin}")]
    Invalid {
        /// The key.
        key: &'static str,
        /// The reason.
        reason: String,
        /// The file.
        origin: String,
    },
    /// The settings of a cell are no configuration.
    #[error("settings of {cell}: {reason}: {origin}")]
    Settings {
        /// The cell.
        cell: String,
        /// The error of the configuration.
        reason: ConfigError,
        /// The file.
        origin: String,
    },
    /// No cell has this number.
    #[error("there is no cell {index}; the suite has the cells 0 to {last}: {origin}")]
    NoCell {
        /// The number asked for.
        index: usize,
        /// The largest one.
        last: usize,
        /// The file.
        origin: String,
    },
    /// The folder of a cell has a run of other settings.
    #[error(
        "the folder holds a run with other settings than the suite's: `{key}` is {own} in the run, {suite} \
         in the suite; remove it or choose another output folder: {}",
        path.display()
    )]
    OtherSettings {
        /// The folder.
        path: PathBuf,
        /// The first key that differs.
        key: String,
        /// Its value in the run.
        own: String,
        /// Its value in the suite.
        suite: String,
    },
    /// The cell continues from the source of another one that has not been run.
    #[error(
        "cell {cell} continues from the source of cell {leader} ({name}), which is not trained; run that \
            one first"
    )]
    NoSource {
        /// The cell.
        cell: usize,
        /// The cell with the source.
        leader: usize,
        /// Name of that cell.
        name: String,
    },
    /// A run folder can't be read or written.
    #[error(transparent)]
    Train(#[from] TrainError),
    /// A file can't be read or written.
    #[error(transparent)]
    File(#[from] FileError),
}

impl SuiteError {
    /// The file or folder that the error is about: the suite's file or name, or a file of a run.
    #[must_use]
    pub fn path(&self) -> Option<&Path> {
        match self {
            Self::Read { path, .. } | Self::OtherSettings { path, .. } => Some(path),
            Self::Syntax { origin, .. }
            | Self::Unknown { origin, .. }
            | Self::Invalid { origin, .. }
            | Self::Settings { origin, .. }
            | Self::NoCell { origin, .. } => Some(Path::new(origin)),
            Self::NoSource { .. } => None,
            Self::Train(error) => error.path(),
            Self::File(error) => Some(error.path()),
        }
    }
}

/// Names, in backticks, joined by commas.
pub(crate) fn listed<'a>(names: impl IntoIterator<Item = &'a str>) -> String {
    names.into_iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")
}
