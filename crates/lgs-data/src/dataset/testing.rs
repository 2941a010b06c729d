//! Helpers of the tests of image sets.

use std::path::PathBuf;

use super::{Dataset, DatasetError, LoadOptions};
use crate::synth::{self, SynthOptions};

/// A synthetic scene in small images from some views, at four moments per unit of time in training, with its
/// truth.
pub(in crate::dataset) fn synthetic(scene: &str, size: u32, views: usize) -> (tempfile::TempDir, PathBuf) {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("set");
    let options = SynthOptions { size, views, train_fps: 4, ..SynthOptions::default() };
    synth::generate(scene, &options, &out, &|_, _| {}).unwrap();
    (dir, out)
}

/// The set in a folder, read as it is.
pub(in crate::dataset) fn load(dir: &tempfile::TempDir) -> Result<Dataset, DatasetError> {
    Dataset::load(dir.path(), &LoadOptions::default(), &|_, _| {})
}

/// The message with which a folder is refused, which has to end with the name of a file.
pub(in crate::dataset) fn refusal(dir: &tempfile::TempDir, file: &str) -> String {
    let message = load(dir).unwrap_err().to_string();
    assert!(message.ends_with(file), "{message}");
    message
}
