//! The loop that drives everything that trains step by step: checkpoints, the training curve, progress, and
//! stopping on request.

use std::cell::RefCell;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use crate::budget::Budget;
use crate::checkpoint::{Checkpoint, Checkpoints, Stage};
use crate::config::TrainConfig;
use crate::driver::{Control, Progress, Status, Trainer};
use crate::error::TrainError;
use crate::events::{Event, EventLog};
use crate::figures::{FigureReader, Figures};
use crate::run_folder::RunFolder;

/// The files of a run that a training loop writes.
pub(crate) struct TrainingLoop<'a> {
    pub(crate) run: &'a RunFolder,
    pub(crate) config: &'a TrainConfig,
    pub(crate) checkpoints: &'a Checkpoints,
    /// The time that is left, where the run has a budget.
    pub(crate) budget: Option<&'a RefCell<Budget>>,
}

impl TrainingLoop<'_> {
    /// Runs a trainer to its end, from a checkpoint of its stage if there is one; a checkpoint also marks the
    /// end.
    ///
    /// # Errors
    /// If a file cannot be read or written, the loss is not finite, or a stop was asked for (after a
    /// checkpoint).
    pub(crate) fn drive(
        &self,
        trainer: &mut dyn Trainer,
        from: Option<&Checkpoint>,
        control: &mut Control<'_>,
    ) -> Result<(), TrainError> {
        let stage = trainer.stage();
        let _span = span_of(stage).entered();
        if let Some(checkpoint) = from {
            trainer.restore(&checkpoint.file, checkpoint.step)?;
        }
        let mut events = EventLog::resume(&self.run.events_path(), stage, trainer.step_index())?;
        let mut timer = CheckpointTimer::new(self.config);
        let mut reader = FigureReader::new(stage);
        self.with_budget(|budget| budget.begin(stage, self.config.last_stage));
        while !trainer.is_finished() {
            if control.stop.load(Ordering::Relaxed) {
                self.save(trainer, &mut reader)?;
                return Err(TrainError::Interrupted { stage: stage.name(), step: trainer.step_index() });
            }
            if let (Some(budget), Some(clock)) = (self.budget, trainer.clock()) {
                budget.borrow_mut().pace(clock);
            }
            let left_secs = self.budget.map(|budget| budget.borrow().left());
            let progress = Progress { left_secs, ..advance(trainer, &mut reader)? };
            if progress.is_on_curve() {
                events.append(&Event::of(&progress))?;
            }
            (control.progress)(progress);
            show(trainer, control);
            if timer.is_due() {
                self.save(trainer, &mut reader)?;
            }
        }
        self.with_budget(Budget::end);
        self.save(trainer, &mut reader)
    }

    pub(crate) fn with_budget(&self, act: impl FnOnce(&mut Budget)) {
        if let Some(budget) = self.budget {
            act(&mut budget.borrow_mut());
        }
    }

    /// A checkpoint of steps whose losses are finite, and before it the schedule that led to it.
    fn save(&self, trainer: &dyn Trainer, reader: &mut FigureReader) -> Result<(), TrainError> {
        reader.read()?;
        if let Some(budget) = self.budget {
            budget.borrow().save()?;
        }
        self.checkpoints.save(trainer.stage(), trainer.step_index(), trainer.checkpoint()).map(drop)
    }
}

/// One step, whose loss has to be finite.
fn advance(trainer: &mut dyn Trainer, reader: &mut FigureReader) -> Result<Progress, TrainError> {
    let report = trainer.step();
    let Status { stage, step, steps, gaussians } = trainer.status();
    let Figures { loss, psnr } = reader.take(step, report)?;
    Ok(Progress { stage, step, steps, loss, psnr: Some(psnr), gaussians, left_secs: None })
}

/// Shows the models to the onlookers who want to see them.
fn show(trainer: &dyn Trainer, control: &mut Control<'_>) {
    let mut glance = None;
    for onlooker in &mut control.onlookers {
        if onlooker.wants() {
            onlooker.show(glance.get_or_insert_with(|| trainer.glance()).clone());
        }
    }
}

/// The span of a stage, for profiles.
fn span_of(stage: Stage) -> tracing::Span {
    match stage {
        Stage::Source => tracing::trace_span!("source"),
        Stage::Distill => tracing::trace_span!("distill"),
        Stage::RefineGaussians => tracing::trace_span!("refine-gaussians"),
        Stage::FitDynamics => tracing::trace_span!("fit-dynamics"),
        Stage::TuneDynamics => tracing::trace_span!("tune-dynamics"),
        Stage::TuneGaussians => tracing::trace_span!("tune-gaussians"),
        Stage::RetuneGaussians => tracing::trace_span!("retune-gaussians"),
    }
}

/// Calls for a checkpoint every so many seconds.
struct CheckpointTimer {
    interval: Duration,
    last: Instant,
}

impl CheckpointTimer {
    fn new(config: &TrainConfig) -> Self {
        Self { interval: Duration::from_secs(config.checkpoint_secs), last: Instant::now() }
    }

    /// Whether one is due; starts anew if so.
    fn is_due(&mut self) -> bool {
        let due = self.last.elapsed() >= self.interval;
        if due {
            self.last = Instant::now();
        }
        due
    }
}
