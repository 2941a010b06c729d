//! The recording of a build without rerun: there is none.

use std::path::Path;

use crate::content::{Content, When};
use crate::error::RerunError;

/// A recording under way. This build has none.
#[derive(Debug)]
pub enum Recording {}

impl Recording {
    /// Refuses to begin a recording.
    ///
    /// # Errors
    /// Always.
    pub fn begin(path: &Path, _title: &str, _about: &[u8]) -> Result<Self, RerunError> {
        Err(RerunError::NotBuilt { path: path.to_owned() })
    }

    pub(crate) fn log(&mut self, _: &str, _: When, _: &Content<'_>) -> Result<(), RerunError> {
        match *self {}
    }

    pub(crate) fn flush(&mut self) -> Result<(), RerunError> {
        match *self {}
    }

    pub(crate) fn finish(self) -> Result<u64, RerunError> {
        match self {}
    }
}
