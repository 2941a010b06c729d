//! Errors of training.

use std::path::{Path, PathBuf};

use lgs_data::files::FileError;
use lgs_model::TensorFileError;
use lgs_model::source::SourceKind;

/// The reason why a training run stopped.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TrainError {
    /// The configuration was refused.
    #[error(transparent)]
    Config(#[from] crate::layers::ConfigError),
    /// A checkpoint or model file cannot be read or written.
    #[error(transparent)]
    Tensors(#[from] TensorFileError),
    /// The file of a Lagrangian scene cannot be read or written.
    #[error(transparent)]
    Scene(#[from] lgs_model::SceneError),
    /// Stage 1 could not make sense of the source model's trajectories.
    #[error("distillation: {0}")]
    Distill(#[from] lgs_distill::DistillError),
    /// The file of a source model cannot be read or written.
    #[error(transparent)]
    Source(#[from] lgs_model::source::SourceError),
    /// A source model from elsewhere does not fit the run.
    #[error("the imported source: expected {expected}, found {found}: {}", path.display())]
    Import {
        /// The file or folder.
        path: PathBuf,
        /// The expectation.
        expected: String,
        /// The finding.
        found: String,
    },
    /// A file operation failed.
    #[error(transparent)]
    File(#[from] FileError),
    /// A splat file cannot be read or written.
    #[error(transparent)]
    Splats(#[from] lgs_data::ply::PlyError),
    /// A camera list cannot be read or written.
    #[error(transparent)]
    Cameras(#[from] lgs_data::cameras::CamerasError),
    /// The dataset has no training images.
    #[error("the split `train` is empty: {0}")]
    NoFrames(PathBuf),
    /// The training images end too early for stage 1 to tell a law from its samples.
    #[error(
        "the training images end at time {last}, a law needs them to reach {least}; times span [0, 1): {}",
        path.display()
    )]
    ShortWindow {
        /// The dataset.
        path: PathBuf,
        /// The last time of a training image.
        last: f32,
        /// The earliest end that is long enough.
        least: f32,
    },
    /// The kind of source model can only be imported.
    #[error("a source `{}` is not trained from images", .0.name())]
    NotTrained(SourceKind),
    /// A value became NaN or infinite.
    #[error("step {step} of stage `{stage}`: the loss is not finite; a smaller learning rate may help")]
    NonFinite {
        /// Name of the stage.
        stage: &'static str,
        /// Steps done.
        step: usize,
    },
    /// A checkpoint was made under another configuration or from another dataset.
    #[error("made with another {what} ({found}) than this run's ({expected}): {path}")]
    Mismatch {
        /// The checkpoint.
        path: PathBuf,
        /// Configuration or dataset.
        what: &'static str,
        /// The hash of this run.
        expected: String,
        /// The hash in the file.
        found: String,
    },
    /// The `config.toml` of a run is not that of a run.
    #[error("the run's configuration is wrong: {error}: {}", path.display())]
    RunConfig {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        error: crate::layers::ConfigError,
    },
    /// A line of a training curve is malformed.
    #[error("line {line}: {reason}: {}", path.display())]
    Events {
        /// The file.
        path: PathBuf,
        /// Number of the line, from 1.
        line: usize,
        /// The defect.
        reason: String,
    },
    /// The folder for a run holds something that a run would mix with.
    #[error("the folder is no run and a run would mix with what it holds ({found}): {}", path.display())]
    Foreign {
        /// The folder.
        path: PathBuf,
        /// What it holds.
        found: &'static str,
    },
    /// The run folder already holds a run.
    #[error("the folder already holds a run; resume it or choose another: {0}")]
    Occupied(PathBuf),
    /// A stop was asked for; a checkpoint has been written.
    #[error("interrupted at step {step} of stage `{stage}`; the run can be resumed")]
    Interrupted {
        /// Name of the stage.
        stage: &'static str,
        /// Steps done.
        step: usize,
    },
}

impl TrainError {
    /// The file or folder that the error is about, unless it is about values or settings.
    #[must_use]
    pub fn path(&self) -> Option<&Path> {
        match self {
            Self::Config(error) => error.path(),
            Self::Tensors(error) => Some(error.path()),
            Self::Scene(error) => Some(error.path()),
            Self::Source(error) => Some(error.path()),
            Self::File(error) => Some(error.path()),
            Self::Splats(error) => Some(error.path()),
            Self::Cameras(error) => Some(error.path()),
            Self::Import { path, .. }
            | Self::NoFrames(path)
            | Self::ShortWindow { path, .. }
            | Self::Mismatch { path, .. }
            | Self::RunConfig { path, .. }
            | Self::Events { path, .. }
            | Self::Foreign { path, .. }
            | Self::Occupied(path) => Some(path),
            Self::Distill(_) | Self::NotTrained(_) | Self::NonFinite { .. } | Self::Interrupted { .. } => {
                None
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_end_with_the_path_that_they_expose() {
        let path = || PathBuf::from("run/file");
        let denied = || FileError::new("read file", Path::new("run/file"), std::io::Error::other("denied"));
        let mismatch = TrainError::Mismatch {
            path: path(),
            what: "dataset",
            expected: "a".to_owned(),
            found: "b".to_owned(),
        };
        let import = TrainError::Import { path: path(), expected: "a".to_owned(), found: "b".to_owned() };
        let missing = TensorFileError::Missing { path: path(), field: "means".to_owned() };
        let syntax = crate::layers::ConfigError::Syntax { path: path(), reason: "no value".to_owned() };
        let all = [
            mismatch,
            import,
            TrainError::NoFrames(path()),
            TrainError::ShortWindow { path: path(), last: 0.01, least: 0.1 },
            TrainError::Occupied(path()),
            TrainError::Foreign { path: path(), found: "source" },
            TrainError::Events { path: path(), line: 3, reason: "cut".to_owned() },
            TrainError::RunConfig {
                path: path(),
                error: crate::layers::ConfigError::Override("a".to_owned()),
            },
            denied().into(),
            missing.into(),
            TensorFileError::from(denied()).into(),
            syntax.into(),
        ];
        for error in all {
            assert_eq!(error.path(), Some(Path::new("run/file")), "{error}");
            assert!(error.to_string().ends_with(": run/file"), "{error}");
        }
        assert_eq!(TrainError::NonFinite { stage: "source", step: 3 }.path(), None);
    }
}
