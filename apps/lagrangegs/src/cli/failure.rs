//! Errors as one readable line that ends with the path they are about.
//!
//! The message of a library error that knows its file ends with that path, which [`Located`] exposes; where
//! an error knows none, [`At::at`] adds the path that the command knows.

use std::path::Path;

use lgs_data::{cameras, dataset, files, frames, ply, splats, synth, tracks};

/// An error that may know the file or folder it is about; if it does, its message ends with that path.
pub(crate) trait Located: std::error::Error + Send + Sync + 'static {
    /// The file or folder.
    fn location(&self) -> Option<&Path>;
}

macro_rules! located {
    ($($error:ty),* $(,)?) => {
        $(impl Located for $error {
            fn location(&self) -> Option<&Path> {
                self.path().into()
            }
        })*
    };
}

located!(
    files::FileError,
    ply::PlyError,
    frames::FramesError,
    splats::SplatError,
    tracks::TracksError,
    cameras::CamerasError,
    dataset::DatasetError,
    synth::SynthError,
    lgs_model::SceneError,
    lgs_model::source::SourceError,
    lgs_train::TrainError,
    lgs_eval::lpips::store::WeightsError,
    lgs_report::ReportError,
    lgs_suite::SuiteError,
    lgs_rerun::RerunError,
);

impl Located for tracks::TracksProblem {
    fn location(&self) -> Option<&Path> {
        None
    }
}

impl Located for std::io::Error {
    fn location(&self) -> Option<&Path> {
        None
    }
}

impl Located for lgs_video::VideoError {
    fn location(&self) -> Option<&Path> {
        None
    }
}

impl Located for image::ImageError {
    fn location(&self) -> Option<&Path> {
        None
    }
}

/// A wrong flag that only its use shows; the program ends as where the parser of flags refuses one.
#[derive(Debug)]
pub(crate) struct BadUsage(pub(crate) String);

impl std::fmt::Display for BadUsage {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for BadUsage {}

/// Says which file or folder an error is about.
pub(crate) trait At<T> {
    /// The error with a path at its end: its own, or else `path`.
    fn at(self, path: &Path) -> anyhow::Result<T>;
}

impl<T, E: Located> At<T> for Result<T, E> {
    fn at(self, path: &Path) -> anyhow::Result<T> {
        self.map_err(|error| {
            let is_located = error.location().is_some();
            let error = anyhow::Error::new(error);
            let path = files::destination_of(path);
            if is_located { error } else { anyhow::anyhow!("{}: {}", chain(&error), path.display()) }
        })
    }
}

/// An error and its causes, joined by colons; causes that the text before already quotes are left out.
pub(crate) fn chain(error: &anyhow::Error) -> String {
    let mut text = String::new();
    for cause in error.chain() {
        let cause = cause.to_string();
        if text.is_empty() {
            text = cause;
        } else if !text.contains(&cause) {
            text = format!("{text}: {cause}");
        }
    }
    text.replace('\n', " ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_path_comes_last_once() {
        let denied = || std::io::Error::other("denied");
        let own: Result<(), _> = Err(files::FileError::new("read file", Path::new("run/a.ply"), denied()));
        assert_eq!(chain(&own.at(Path::new("run")).expect_err("own")), "can't read file: denied: run/a.ply");
        let none: Result<(), _> = Err(denied());
        assert_eq!(chain(&none.at(Path::new("run")).expect_err("none")), "denied: run");
    }

    #[test]
    fn a_cause_that_is_quoted_is_not_repeated() {
        let io = std::io::Error::other("disk on fire");
        let error = anyhow::Error::new(io).context("cannot write x: disk on fire");
        assert_eq!(chain(&error), "cannot write x: disk on fire");
    }
}
