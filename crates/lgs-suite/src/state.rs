//! The state of a cell, read from its folder.

use std::path::PathBuf;

use lgs_eval::Metrics;
use lgs_train::{Difference, RunFolder, TrainError};

use crate::error::SuiteError;
use crate::plan::{Cell, Plan};

/// The state of a cell's run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum CellState {
    /// Nothing is there.
    Missing,
    /// Training has begun.
    Begun,
    /// Training is over; it is not measured.
    Trained,
    /// Its metrics are there.
    Done,
}

impl CellState {
    /// Its name in lists.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Missing => "missing",
            Self::Begun => "begun",
            Self::Trained => "trained",
            Self::Done => "done",
        }
    }
}

impl Plan {
    /// The state of a cell's run.
    ///
    /// # Errors
    /// If its folder has a run of another configuration, or one that cannot be read.
    pub fn state(&self, cell: &Cell) -> Result<CellState, SuiteError> {
        let root = self.run_folder(cell);
        if !root.join("config.toml").exists() {
            return Ok(CellState::Missing);
        }
        let (run, config) = RunFolder::open(&root)?;
        let difference = config.first_difference(&cell.config).map_err(TrainError::from)?;
        if let Some(Difference { key, own, other: suite }) = difference {
            return Err(SuiteError::OtherSettings { path: root, key, own, suite });
        }
        Ok(match (run.scene_path().exists(), self.metrics(cell)) {
            (true, Some(_)) => CellState::Done,
            (true, None) => CellState::Trained,
            _ => CellState::Begun,
        })
    }

    /// The metrics of a cell; nothing if there are none of this version.
    #[must_use]
    pub fn metrics(&self, cell: &Cell) -> Option<Metrics> {
        let bytes = std::fs::read(self.run_folder(cell).join("metrics.json")).ok()?;
        serde_json::from_slice(&bytes).ok()
    }

    /// The run folder that a cell's source is taken from; nothing if the cell trains its own.
    ///
    /// # Errors
    /// If that source is not trained yet.
    pub fn source_folder(&self, cell: &Cell) -> Result<Option<PathBuf>, SuiteError> {
        let Some(leader) = cell.source_of else { return Ok(None) };
        let from = self.cell(leader)?;
        let absent = || SuiteError::NoSource { cell: cell.index, leader, name: from.name() };
        let root = self.run_folder(from);
        // The scene is written after the source: a run that has begun to tune may lend its source, too, but
        // it may also be training it.
        let trained = self.state(from)? > CellState::Begun
            || RunFolder::open(&root).is_ok_and(|(run, config)| run.source_path(config.source.kind).exists());
        if trained { Ok(Some(root)) } else { Err(absent()) }
    }
}
