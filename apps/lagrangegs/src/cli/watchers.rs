//! Who watches training: the page of `--view` and the recording of `--rerun`.

use std::cell::Cell;
use std::path::Path;
use std::sync::atomic::AtomicBool;

use anyhow::Result;
use lgs_data::dataset::Dataset;
use lgs_rerun::{Recorder, RerunError, Training};
use lgs_train::{Onlooker, Progress, RunFolder, TrainConfig};
use lgs_view::Server;

use super::live::{self, Gallery};
use super::output::refuse_inside_dataset;
use super::progress::say;
use super::run::name_of;

/// What watchers need before anything else is done.
pub(super) struct Seats {
    server: Option<Server>,
    recorder: Option<Recorder>,
}

impl Seats {
    /// Takes the page's port and begins the recording.
    pub(super) fn take(
        view: Option<u16>,
        rerun: Option<&Path>,
        (out, config): (&Path, &TrainConfig),
    ) -> Result<Self> {
        let server = view.map(live::bind).transpose()?;
        if let Some(path) = rerun {
            refuse_inside_dataset(path)?;
        }
        let title = format!("{}, training", name_of(out));
        let begin = |path| Recorder::begin(path, &title, config.hash().as_bytes());
        Ok(Self { server, recorder: rerun.map(begin).transpose()? })
    }

    /// The watchers of a run.
    pub(super) fn watchers<'a>(
        self,
        folder: &'a RunFolder,
        config: &'a TrainConfig,
        dataset: &Dataset,
    ) -> Watchers<'a> {
        Watchers {
            gallery: self.server.map(|server| Gallery::new(server, folder, config, dataset)),
            recording: self.recorder.map(|recorder| Training::new(recorder, folder, dataset)),
            is_failure_said: Cell::new(false),
        }
    }
}

/// Who watches a run that is trained.
pub(super) struct Watchers<'a> {
    gallery: Option<Gallery<'a>>,
    recording: Option<Training>,
    is_failure_said: Cell<bool>,
}

impl Watchers<'_> {
    /// Tells all of a step, and waits where the page has paused training.
    pub(super) fn report(&self, progress: &Progress, stop: &AtomicBool) {
        if let Some(recording) = &self.recording {
            recording.report(progress);
            if let Some(failure) = recording.failure().filter(|_| !self.is_failure_said.replace(true)) {
                say(&format!("warning: training goes on without its recording: {failure}"));
            }
        }
        if let Some(gallery) = &self.gallery {
            gallery.report(progress, stop);
        }
    }

    /// Those who look at the models.
    pub(super) fn onlookers(&self) -> Vec<Box<dyn Onlooker + '_>> {
        let gallery = self.gallery.as_ref().map(|gallery| Box::new(gallery) as Box<dyn Onlooker>);
        let recording = self.recording.as_ref().map(|recording| Box::new(recording) as Box<dyn Onlooker>);
        gallery.into_iter().chain(recording).collect()
    }

    /// Ends the page and the recording, however training ended.
    ///
    /// # Errors
    /// If the recording could not be written.
    pub(super) fn finish(self) -> Result<(), RerunError> {
        self.recording.map_or(Ok(()), |recording| recording.finish().map(drop))
    }
}
