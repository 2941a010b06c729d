//! The whole of training: source model, distillation, tuning of the dynamics, refinement of the Gaussians,
//! each from where a checkpoint left it.

use std::sync::atomic::Ordering;

use lgs_data::dataset::Dataset;
use lgs_data::files::{FileError, write_atomically};
use lgs_distill::LinearPart;
use lgs_model::source::{SourceModel, load_source};
use lgs_model::{LagrangianScene, save_scene, scene_from_tensors};

use crate::TrainError;
use crate::checkpoint::{Checkpoint, Checkpoints, Stage};
use crate::config::TrainConfig;
use crate::events::{Event, EventLog};
use crate::import::imported_source;
use crate::run::{CheckpointTimer, Control, Progress, RunFolder, train_source};
use crate::stages::{
    FitDynamics, InitialSceneRequest, TuneDynamics, TuneGaussians, Tuning, initialise_scene,
};

/// Iterations between lines of `events.jsonl`.
const EVENT_INTERVAL: usize = 10;

/// What a finished run leaves.
pub struct Trained {
    /// The source model.
    pub source: Box<dyn SourceModel>,
    /// The deliverable.
    pub scene: LagrangianScene,
}

/// Trains all stages of a run (without images, an imported source and stage 1), continuing from its latest
/// checkpoint if it has one, and writes `source/` and `lagrangian.safetensors`.
///
/// # Errors
/// If a file cannot be read or written, a value stops being finite, or a stop was asked for (after a
/// checkpoint).
pub fn train(
    run: &RunFolder,
    dataset: &Dataset,
    config: &TrainConfig,
    control: &mut Control<'_>,
) -> Result<Trained, TrainError> {
    let pipeline = Pipeline { run, dataset, config, checkpoints: run.checkpoints(config, dataset) };
    let latest = pipeline.checkpoints.latest()?;
    let source = match &latest {
        Some(checkpoint) if checkpoint.stage > Stage::Source => {
            load_source(&run.source_path(config.source.kind))?
        }
        // Taken over from another run.
        None if run.source_path(config.source.kind).exists() => {
            load_source(&run.source_path(config.source.kind))?
        }
        from => pipeline.source(from.as_ref(), control)?,
    };
    let latest = latest.filter(|c| c.stage > Stage::Source);
    if !pipeline.has_images() {
        let scene = pipeline.distill(&*source, control)?;
        save_scene(&scene, &run.scene_path())?;
        return Ok(Trained { source, scene });
    }
    let reached = latest.as_ref().map_or(Stage::Distill, |checkpoint| checkpoint.stage);
    let mut scene = match &latest {
        Some(checkpoint) => pipeline.scene_of(checkpoint)?,
        None => pipeline.distill(&*source, control)?,
    };
    for stage in [Stage::RefineGaussians, Stage::FitDynamics, Stage::TuneDynamics, Stage::TuneGaussians] {
        if reached <= stage {
            scene = pipeline.tune(
                stage,
                scene,
                latest.as_ref().filter(|checkpoint| checkpoint.stage == stage),
                control,
            )?;
        }
    }
    save_scene(&scene, &run.scene_path())?;
    Ok(Trained { source, scene })
}

struct Pipeline<'a> {
    run: &'a RunFolder,
    dataset: &'a Dataset,
    config: &'a TrainConfig,
    checkpoints: Checkpoints,
}

impl Pipeline<'_> {
    /// The source model of the configured kind, from where a checkpoint left it; it is in the run's folder
    /// afterwards.
    fn source(
        &self,
        from: Option<&Checkpoint>,
        control: &mut Control<'_>,
    ) -> Result<Box<dyn SourceModel>, TrainError> {
        match self.config.source.import.as_str() {
            "" => train_source(self.run, self.dataset, self.config, from, control),
            _ => {
                let source = imported_source(self.config, self.has_images())?;
                self.run.write_source(&*source, 0, self.dataset)?;
                Ok(source)
            }
        }
    }

    /// Whether there is anything to tune on; without, training ends with stage 1.
    fn has_images(&self) -> bool {
        !self.dataset.split("train").is_empty()
    }

    fn scene_of(&self, checkpoint: &Checkpoint) -> Result<LagrangianScene, TrainError> {
        Ok(scene_from_tensors(&checkpoint.file, &checkpoint.path)?)
    }

    /// Stage 1. It takes seconds and is not interrupted; its report is `distillation.json`.
    fn distill(
        &self,
        source: &dyn SourceModel,
        control: &mut Control<'_>,
    ) -> Result<LagrangianScene, TrainError> {
        let _span = tracing::trace_span!("distill").entered();
        let request = InitialSceneRequest {
            partition: &self.config.partition,
            distill: &self.config.distill,
            motion: &self.config.motion,
            time_window: self.time_window(source),
            pixel_size: self.dataset.pixel_size(),
            background: self.dataset.background,
            frames: self.dataset.split("train"),
            seed: self.config.seed,
        };
        let gaussians = source.len();
        let initial = initialise_scene(source, &request, &mut |object, objects, p| {
            let (step, steps) = (object * p.steps + p.step, objects * p.steps);
            (control.progress)(Progress {
                stage: Stage::Distill,
                step,
                steps,
                loss: p.loss.unwrap_or(0.0),
                psnr: None,
                gaussians,
            });
        })?;
        let path = self.run.root().join("distillation.json");
        let json = serde_json::to_vec_pretty(&initial.reports)
            .map_err(|e| FileError::new("write file", &path, e.into()))?;
        write_atomically(&path, |w| w.write_all(&json))?;
        Ok(initial.scene)
    }

    /// End of the captured window: the last training time, or the end of what the source knows if that is
    /// earlier.
    fn time_window(&self, source: &dyn SourceModel) -> f32 {
        let images = self.dataset.split("train").iter().map(|f| f.time).reduce(f32::max);
        let known = source.time_range().map(|[_, last]| last);
        let window = images.into_iter().chain(known).fold(f32::INFINITY, f32::min);
        if window.is_finite() { window.max(self.config.motion.dt) } else { self.config.motion.dt }
    }

    /// One of the stages that descend a loss on the images; none of its steps where the configuration leaves
    /// it out.
    fn tune(
        &self,
        stage: Stage,
        scene: LagrangianScene,
        from: Option<&Checkpoint>,
        control: &mut Control<'_>,
    ) -> Result<LagrangianScene, TrainError> {
        let (frames, seed, last_stage) =
            (self.dataset.split("train"), self.config.seed, self.config.last_stage);
        let fits = last_stage >= 2 && self.config.fit_dynamics.steps > 0;
        if stage == Stage::FitDynamics {
            let mut config = self.config.fit_dynamics.clone();
            config.steps *= usize::from(fits);
            return self.drive(FitDynamics::new(scene, frames, &config, seed), from, control);
        }
        if stage == Stage::TuneDynamics {
            let mut config = self.config.tune_dynamics.clone();
            let is_fitted = fits && scene.objects.iter().all(|object| LinearPart::is_all_of(&object.system));
            config.iterations *= usize::from(last_stage >= 2 && !is_fitted);
            return self.drive(TuneDynamics::new(scene, frames, &config, seed), from, control);
        }
        let settling = stage == Stage::RefineGaussians;
        let mut config =
            if settling { &self.config.refine_gaussians } else { &self.config.tune_gaussians }.clone();
        config.iterations *= usize::from(last_stage >= 3);
        self.drive(TuneGaussians::new(stage, scene, frames, &config, seed), from, control)
    }

    /// Runs a stage to its end, from a checkpoint if there is one, with events, progress and checkpoints; a
    /// checkpoint also marks its start and its end.
    fn drive(
        &self,
        mut stage: impl Tuning,
        from: Option<&Checkpoint>,
        control: &mut Control<'_>,
    ) -> Result<LagrangianScene, TrainError> {
        if let Some(checkpoint) = from {
            stage.restore(&checkpoint.file, checkpoint.step)?;
        }
        let (steps, gaussians) = (stage.steps(), stage.scene().len());
        let name = stage.stage();
        let _span = match name {
            Stage::RefineGaussians => tracing::trace_span!("refine-gaussians"),
            Stage::FitDynamics => tracing::trace_span!("fit-dynamics"),
            Stage::TuneDynamics => tracing::trace_span!("tune-dynamics"),
            _ => tracing::trace_span!("tune-gaussians"),
        }
        .entered();
        let mut events = EventLog::resume(&self.run.events_path(), name, stage.step_index())?;
        let mut timer = CheckpointTimer::new(self.config);
        if stage.step_index() == 0 {
            self.checkpoints.save(name, 0, stage.checkpoint())?;
        }
        while !stage.is_finished() {
            if control.stop.load(Ordering::Relaxed) {
                self.checkpoints.save(name, stage.step_index(), stage.checkpoint())?;
                return Err(TrainError::Interrupted { stage: name.name(), iteration: stage.step_index() });
            }
            let report = stage.step();
            let step = stage.step_index();
            if !report.loss.is_finite() {
                return Err(TrainError::NonFinite { name: "loss", iteration: step });
            }
            let (loss, psnr) = (report.loss, Some(report.psnr));
            if step.is_multiple_of(EVENT_INTERVAL) {
                events.append(&Event { stage: name.name().to_owned(), step, loss, psnr, gaussians })?;
            }
            (control.progress)(Progress { stage: name, step, steps, loss, psnr, gaussians });
            if timer.is_due() {
                self.checkpoints.save(name, step, stage.checkpoint())?;
            }
        }
        self.checkpoints.save(name, stage.step_index(), stage.checkpoint())?;
        Ok(stage.scene())
    }
}
