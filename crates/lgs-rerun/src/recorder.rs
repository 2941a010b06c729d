//! A recording that stops at its first error and keeps it.

use std::path::Path;

use crate::Recording;
use crate::content::{Content, When};
use crate::error::RerunError;

/// A recording whose writer goes on when it fails.
///
/// What fails is removed at once: where the disk is full, there are checkpoints to write.
pub struct Recorder(Result<Recording, RerunError>);

impl Recorder {
    /// Begins a recording, see [`Recording::begin`].
    ///
    /// # Errors
    /// If it cannot be begun.
    pub fn begin(path: &Path, title: &str, about: &[u8]) -> Result<Self, RerunError> {
        Recording::begin(path, title, about).map(|recording| Self(Ok(recording)))
    }

    pub(crate) fn log(&mut self, entity: &str, when: When, content: &Content<'_>) {
        self.with(|recording| recording.log(entity, when, content));
    }

    pub(crate) fn flush(&mut self) {
        self.with(Recording::flush);
    }

    pub(crate) fn failure(&self) -> Option<&RerunError> {
        self.0.as_ref().err()
    }

    pub(crate) fn finish(self) -> Result<u64, RerunError> {
        self.0.and_then(Recording::finish)
    }

    fn with(&mut self, work: impl FnOnce(&mut Recording) -> Result<(), RerunError>) {
        if let Ok(recording) = &mut self.0
            && let Err(error) = work(recording)
        {
            self.0 = Err(error);
        }
    }
}
