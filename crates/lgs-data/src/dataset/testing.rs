//! Helpers of the tests of image sets.

use super::{Dataset, DatasetError, LoadOptions};

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
