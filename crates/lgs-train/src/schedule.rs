//! The record of a run under a time budget: what its stages took, at which paces they went, and which were
//! left out.

use std::collections::BTreeMap;
use std::path::Path;

use lgs_data::files::FileError;
use serde::{Deserialize, Serialize};

use crate::checkpoint::Stage;
use crate::error::TrainError;

/// A pace that holds from a step of a stage on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pace {
    /// Name of the stage.
    pub stage: String,
    /// Steps of the stage taken before.
    pub step: usize,
    /// Steps of the schedule that a step covers.
    pub pace: f64,
}

/// The contents of `schedule.json`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Schedule {
    /// Seconds that training has used.
    pub used_secs: f64,
    /// Seconds that stage 1 has taken.
    #[serde(default)]
    pub distill_secs: f64,
    /// Seconds that the fit of the dynamics has taken.
    #[serde(default)]
    pub fit_secs: f64,
    /// Whether there was time for a stage that can be left out or cut short, by its name, for a round of
    /// stage 1, by its name and the number, and for a search for laws in its tracks or by images, by what was
    /// sought.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub has_time_for: BTreeMap<String, bool>,
    /// Paces in the order in which they were set.
    pub paces: Vec<Pace>,
}

impl Pace {
    /// Stage and step in the order of training; an unknown stage is before all.
    pub(crate) fn place(&self) -> (usize, usize) {
        let stage = Stage::ALL.into_iter().find(|stage| stage.name() == self.stage);
        (stage.map_or(0, Stage::index), self.step)
    }
}

/// Reads `schedule.json`.
///
/// # Errors
/// If it cannot be read, or holds something else.
pub fn read_schedule(path: &Path) -> Result<Schedule, TrainError> {
    let text = std::fs::read(path).map_err(|e| FileError::new("read file", path, e))?;
    let schedule: Schedule =
        serde_json::from_slice(&text).map_err(|e| FileError::new("read file", path, e.into()))?;
    let is_sound = [schedule.used_secs, schedule.distill_secs, schedule.fit_secs].iter().all(|s| *s >= 0.0)
        && schedule.paces.iter().all(|p| p.pace > 0.0);
    if is_sound {
        return Ok(schedule);
    }
    let reason = std::io::Error::other("paces have to be positive, and times not negative");
    Err(FileError::new("read file", path, reason).into())
}
