//! Runs of a suite as its page compares them.

use std::path::PathBuf;

use lgs_eval::Metrics;

/// Splits that are compared, in the order of time.
pub(crate) const SPLITS: [&str; 4] = ["val", "test", "long", "past"];

/// A run in a suite.
#[derive(Clone, Debug)]
pub(crate) struct Cell {
    pub(crate) name: String,
    pub(crate) folder: PathBuf,
    /// Nothing for a run that has not been evaluated.
    pub(crate) metrics: Option<Metrics>,
}
