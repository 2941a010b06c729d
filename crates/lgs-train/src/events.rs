//! `events.jsonl`: the training curve, one JSON object per line, in order of stage and step.

use std::fs::OpenOptions;
use std::io::Write;
use std::path::{Path, PathBuf};

use lgs_data::files::{FileError, write_atomically};
use serde::{Deserialize, Serialize};

use crate::checkpoint::Stage;
use crate::driver::Progress;
use crate::error::TrainError;

/// One line of the training curve.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Event {
    /// Name of the stage.
    pub stage: String,
    /// Steps of the stage done.
    pub step: usize,
    /// Loss of the step.
    pub loss: f32,
    /// PSNR of the step's image, dB, where one was rendered.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub psnr: Option<f32>,
    /// Number of Gaussians.
    pub gaussians: usize,
}

impl Event {
    /// The line about a step.
    #[must_use]
    pub fn of(progress: &Progress) -> Self {
        let &Progress { stage, step, loss, psnr, gaussians, .. } = progress;
        Self { stage: stage.name().to_owned(), step, loss, psnr, gaussians }
    }
}

/// The lines of a training curve; a last one that a crash cut short is left out, and an absent file has none.
///
/// # Errors
/// If the file cannot be read or another line is malformed.
pub fn read_events(path: &Path) -> Result<Vec<Event>, TrainError> {
    let bytes = match std::fs::read(path) {
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(Vec::new()),
        read => read.map_err(|e| FileError::new("read file", path, e))?,
    };
    let text = String::from_utf8_lossy(&bytes);
    let whole = text.rfind('\n').map_or("", |end| &text[..end]);
    let event = |(index, line): (usize, &str)| {
        serde_json::from_str(line).map_err(|e| TrainError::Events {
            path: path.to_owned(),
            line: index + 1,
            reason: e.to_string(),
        })
    };
    whole.lines().enumerate().map(event).collect()
}

/// The file, open for appending.
pub struct EventLog {
    path: PathBuf,
    file: std::fs::File,
}

impl EventLog {
    /// Continues a log after a restored step: later lines, and a line that a crash cut short, are dropped.
    ///
    /// # Errors
    /// If it cannot be read or written.
    pub fn resume(path: &Path, stage: Stage, step: usize) -> Result<Self, TrainError> {
        let text = match std::fs::read(path) {
            Ok(bytes) => String::from_utf8_lossy(&bytes).into_owned(),
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => String::new(),
            Err(e) => return Err(FileError::new("read file", path, e).into()),
        };
        let before = |line: &str| {
            let Ok(event) = serde_json::from_str::<Event>(line) else { return false };
            let index = Stage::ALL.iter().position(|s| s.name() == event.stage);
            index.is_some_and(|i| (i, event.step) <= (stage.index(), step))
        };
        let kept: Vec<&str> = text.lines().filter(|line| before(line)).collect();
        write_atomically(path, |w| kept.iter().try_for_each(|line| writeln!(w, "{line}")))?;
        Self::open(path)
    }

    /// Begins a log with the lines of another one about the source.
    ///
    /// # Errors
    /// If one cannot be read or the other not be written.
    pub fn adopt_source(from: &Path, to: &Path) -> Result<(), TrainError> {
        let text = std::fs::read_to_string(from).map_err(|e| FileError::new("read file", from, e))?;
        write_atomically(to, |w| w.write_all(text.as_bytes()))?;
        Self::resume(to, Stage::Source, usize::MAX).map(drop)
    }

    fn open(path: &Path) -> Result<Self, TrainError> {
        let file =
            OpenOptions::new().append(true).open(path).map_err(|e| FileError::new("open file", path, e))?;
        Ok(Self { path: path.to_owned(), file })
    }

    /// Adds a line.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn append(&mut self, event: &Event) -> Result<(), TrainError> {
        let mut line =
            serde_json::to_string(event).map_err(|e| FileError::new("write file", &self.path, e.into()))?;
        line.push('\n');
        Ok(self.file.write_all(line.as_bytes()).map_err(|e| FileError::new("write file", &self.path, e))?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn event(stage: Stage, step: usize) -> Event {
        Event { stage: stage.name().into(), step, loss: 0.5, psnr: None, gaussians: 3 }
    }

    #[test]
    fn a_line_that_is_cut_is_left_out_and_a_malformed_one_named() {
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join("events.jsonl");
        assert_eq!(read_events(&path).expect("no file"), []);
        let line = serde_json::to_string(&event(Stage::Source, 10)).expect("a line");
        std::fs::write(&path, format!("{line}\n{}", &line[..9])).expect("written");
        assert_eq!(read_events(&path).expect("cut short"), [event(Stage::Source, 10)]);
        std::fs::write(&path, format!("{line}\nnothing\n{line}\n")).expect("written");
        let error = read_events(&path).expect_err("malformed").to_string();
        assert!(error.contains("line 2") && error.ends_with("events.jsonl"), "{error}");
    }

    #[test]
    fn resuming_drops_what_came_after_the_checkpoint() {
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join("events.jsonl");
        let mut log = EventLog::resume(&path, Stage::Source, 0).expect("an empty log");
        for (stage, step) in [(Stage::Source, 900), (Stage::Distill, 10), (Stage::Distill, 20)] {
            log.append(&event(stage, step)).expect("append");
        }
        std::fs::write(&path, format!("{}{{\"stage\":\"dis", std::fs::read_to_string(&path).expect("text")))
            .expect("crash");
        EventLog::resume(&path, Stage::Distill, 10)
            .expect("resume")
            .append(&event(Stage::Distill, 11))
            .expect("append");
        let steps: Vec<usize> = std::fs::read_to_string(&path)
            .expect("text")
            .lines()
            .map(|l| serde_json::from_str::<Event>(l).expect("line").step)
            .collect();
        assert_eq!(steps, [900, 10, 11]);
    }
}
