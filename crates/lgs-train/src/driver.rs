//! The interface of everything that trains step by step, and of whoever watches it.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use lgs_model::source::SourceModel;
use lgs_model::{LagrangianScene, TensorFile, TensorFileError};

use crate::checkpoint::Stage;
use crate::clock::Clock;
use crate::figures::StepReport;
use crate::thresholds::EVENT_INTERVAL;

/// How far a trainer has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Status {
    /// The stage that is trained.
    pub stage: Stage,
    /// Steps done.
    pub step: usize,
    /// Number of all steps; 0 where there is nothing to train or nothing to train on.
    pub steps: usize,
    /// Number of Gaussians now.
    pub gaussians: usize,
}

impl Status {
    /// That of a stage whose steps follow a clock.
    #[must_use]
    pub fn of(stage: Stage, clock: &Clock, gaussians: usize) -> Self {
        Self { stage, step: clock.taken(), steps: clock.steps(), gaussians }
    }
}

/// Something that trains step by step on images, and can be stopped and resumed at any step.
pub trait Trainer {
    /// How far it has come.
    fn status(&self) -> Status;

    /// The place on the schedule, where steps can cover more or less of it; nothing where they are counted.
    fn clock(&mut self) -> Option<&mut Clock> {
        None
    }

    /// One optimiser step.
    fn step(&mut self) -> StepReport;

    /// All that a resumed run needs: what [`Self::restore`] reads and, for a stage that trains a scene, the
    /// scene that the stage is made from.
    fn checkpoint(&self) -> TensorFile;

    /// What has been learned so far, for whoever looks at it.
    fn glance(&self) -> Glance;

    /// Continues from a checkpoint of `step` steps of the same stage of the same run.
    ///
    /// # Errors
    /// If a tensor is absent or does not fit.
    fn restore(&mut self, file: &TensorFile, step: usize) -> Result<(), TensorFileError>;

    /// The stage that is trained.
    fn stage(&self) -> Stage {
        self.status().stage
    }

    /// Number of all steps.
    fn steps(&self) -> usize {
        self.status().steps
    }

    /// Steps done.
    fn step_index(&self) -> usize {
        self.status().step
    }

    /// Number of Gaussians now.
    fn gaussians(&self) -> usize {
        self.status().gaussians
    }

    /// Whether all steps are done.
    fn is_finished(&self) -> bool {
        self.step_index() >= self.steps()
    }
}

/// A stage that trains a Lagrangian scene.
pub trait SceneTrainer: Trainer {
    /// The scene with what has been learned so far.
    fn scene(&self) -> LagrangianScene;
}

/// What a stage has learned so far.
#[derive(Clone)]
pub enum Glance {
    /// The source model, while it is trained.
    Source(Arc<dyn SourceModel>),
    /// The scene, in the stages after it.
    Scene(Arc<LagrangianScene>),
}

/// Someone who looks at training now and then. Snapshots are copies: looking changes nothing in the result.
pub trait Onlooker {
    /// Whether a snapshot is wanted now. It is asked after every step, so the answer should be quick.
    fn wants(&mut self) -> bool;

    /// Takes a snapshot.
    fn show(&mut self, snapshot: Glance);
}

/// The state that a progress bar shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// Stage that runs.
    pub stage: Stage,
    /// Steps done of the stage.
    pub step: usize,
    /// Steps in all.
    pub steps: usize,
    /// Loss of the last step whose figures have been read: every step on the processor, those of the curve on
    /// other devices.
    pub loss: f32,
    /// PSNR of that step's images, dB, where the stage renders.
    pub psnr: Option<f32>,
    /// Number of Gaussians.
    pub gaussians: usize,
    /// Seconds to the end of all training, where a time budget says so.
    pub left_secs: Option<f64>,
}

impl Progress {
    /// Whether the step is a line of `events.jsonl`.
    #[must_use]
    pub fn is_on_curve(&self) -> bool {
        self.stage != Stage::Distill && self.step.is_multiple_of(EVENT_INTERVAL)
    }
}

/// The caller's side of a training run.
pub struct Control<'a> {
    /// Set from a signal handler: the stage writes a checkpoint and returns
    /// [`crate::TrainError::Interrupted`].
    pub stop: &'a AtomicBool,
    /// Called after every step.
    pub progress: &'a mut dyn FnMut(Progress),
    /// Who looks at the models while they are trained.
    pub onlookers: Vec<&'a mut dyn Onlooker>,
}

impl<'a> Control<'a> {
    /// Control without onlookers.
    pub fn new(stop: &'a AtomicBool, progress: &'a mut dyn FnMut(Progress)) -> Self {
        Self { stop, progress, onlookers: Vec::new() }
    }
}
