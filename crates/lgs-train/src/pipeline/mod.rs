//! The whole of training, stage by stage, each from where a checkpoint left it.

mod observer;
mod settled;

use std::cell::RefCell;

use burn::tensor::Device;
use lgs_core::spatial_order;
use lgs_data::dataset::Dataset;
use lgs_data::files::{FileError, write_atomically};
use lgs_model::source::{SourceModel, load_source};
use lgs_model::{
    LagrangianScene, MotionConfig, ObjectModel, save_scene, scene_from_tensors, scene_to_tensors,
};

use crate::budget::Budget;
use crate::checkpoint::{CHECKPOINT_FORMAT, Checkpoint, Checkpoints, Stage};
use crate::config::TrainConfig;
use crate::contact::with_contact;
use crate::driver::{Control, SceneTrainer, Trainer};
use crate::error::TrainError;
use crate::import::imported_source;
use crate::lighting::with_light;
use crate::run_folder::RunFolder;
use crate::shadows::with_shadows;
use crate::source::SourceTrainer;
use crate::stages::{
    FitDynamics, InitialScene, InitialSceneRequest, TrainingData, TuneDynamics, TuneGaussians,
    initialise_scene, save_rows,
};
use crate::training_loop::TrainingLoop;
use crate::window::{check_window, end_of_window, learns_no_motion};
use observer::Observer;

/// Name, in the record of a budget, of the search that is left out where there is no time for it.
const PARTS_BY_IMAGES: &str = "laws of parts by images";

/// The models of a finished run.
pub struct Trained {
    /// The source model.
    pub source: Box<dyn SourceModel>,
    /// The Lagrangian scene.
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
    device: &Device,
    control: &mut Control<'_>,
) -> Result<Trained, TrainError> {
    check_window(dataset, config)?;
    let checkpoints = run.checkpoints(config, dataset);
    let pipeline = Pipeline { run, dataset, config, device, checkpoints, budget: run.budget(config)? };
    let latest = pipeline.checkpoints.latest()?;
    let source = pipeline.source(latest.as_ref(), control)?;
    // Later stages see the images through the cameras that the source has refined.
    let corrected = run.refined_cameras()?.map(|cameras| cameras.applied_to(dataset));
    let dataset = corrected.as_ref().unwrap_or(dataset);
    let pipeline = Pipeline { dataset, ..pipeline };
    let scene = if learns_no_motion(dataset, config) {
        still_scene(&*source, config.motion.dt, dataset.background)
    } else {
        pipeline.scene(&*source, latest.as_ref().filter(|c| c.stage > Stage::Source), control)?
    };
    let scene = with_light(with_shadows(with_contact(scene, dataset.split("train"))));
    save_scene(&scene, &run.scene_path())?;
    Ok(Trained { source, scene })
}

/// The scene of Gaussians that do not move. Its window is all of time, so that it is drawn at any.
fn still_scene(source: &dyn SourceModel, dt: f32, background: [f32; 3]) -> LagrangianScene {
    let cloud = source.cloud_at(0.0);
    let order: Vec<usize> = spatial_order(&cloud.means).into_iter().map(|i| i as usize).collect();
    LagrangianScene::still(cloud.select(&order), MotionConfig { dt, time_window: 1.0 }, background)
}

/// Whether an object follows a law without networks, or a recording.
fn is_a_law(object: &ObjectModel) -> bool {
    object.recording.is_some()
        || object.dynamics.particles().is_none_or(|particles| !particles.system.has_networks())
}

struct Pipeline<'a> {
    run: &'a RunFolder,
    dataset: &'a Dataset,
    config: &'a TrainConfig,
    device: &'a Device,
    checkpoints: Checkpoints,
    budget: Option<RefCell<Budget>>,
}

impl Pipeline<'_> {
    /// The source model: from the run's folder once it is finished there or was taken over from another run,
    /// else imported or trained.
    fn source(
        &self,
        latest: Option<&Checkpoint>,
        control: &mut Control<'_>,
    ) -> Result<Box<dyn SourceModel>, TrainError> {
        let path = self.run.source_path(self.config.source.kind);
        let is_training = latest.is_some_and(|checkpoint| checkpoint.stage == Stage::Source);
        if !is_training && (latest.is_some() || path.exists()) {
            return Ok(load_source(&path)?);
        }
        if !self.config.source.import.is_empty() {
            let source = imported_source(self.config, self.dataset)?;
            self.run.write_source(&*source, 0, self.dataset)?;
            return Ok(source);
        }
        let mut trainer =
            SourceTrainer::new(self.dataset, &self.config.source, self.config.seed, self.device)?;
        self.training_loop().drive(&mut trainer, latest, control)?;
        let (source, step) = (trainer.model(), trainer.step_index());
        match trainer.refined_cameras() {
            Some(cameras) => {
                self.run.write_refined_cameras(&cameras)?;
                self.run.write_source(&*source, step, &cameras.applied_to(self.dataset))?;
            }
            None => self.run.write_source(&*source, step, self.dataset)?,
        }
        Ok(source)
    }

    /// The scene after stages 1 to 3.
    fn scene(
        &self,
        source: &dyn SourceModel,
        latest: Option<&Checkpoint>,
        control: &mut Control<'_>,
    ) -> Result<LagrangianScene, TrainError> {
        let mut scene = match latest {
            Some(checkpoint) => scene_from_tensors(&checkpoint.file, &checkpoint.path)?,
            None => self.distill(source, control)?,
        };
        let reached = latest.map_or(Stage::Distill, |checkpoint| checkpoint.stage);
        for stage in Stage::ALL.into_iter().filter(|&stage| stage > Stage::Distill && stage >= reached) {
            if self.is_left_out(stage, &scene) {
                continue;
            }
            if stage == Stage::RetuneGaussians {
                scene = self.retuned(scene, source, latest.filter(|c| c.stage == stage), control)?;
                continue;
            }
            let tunes = matches!(stage, Stage::RefineGaussians | Stage::TuneGaussians);
            let has_time = !tunes || self.has_time_for(stage)?;
            // Without time stage 3 is short, and no choice of laws comes after it.
            if stage == Stage::RefineGaussians && !has_time {
                continue;
            }
            let mut trainer = self.trainer(stage, scene)?;
            self.training_loop().drive(&mut *trainer, latest.filter(|c| c.stage == stage), control)?;
            scene = trainer.scene();
        }
        Ok(scene)
    }

    /// Whether the budget, if there is one, leaves time for a stage.
    fn has_time_for(&self, stage: Stage) -> Result<bool, TrainError> {
        self.budget.as_ref().map_or(Ok(true), |budget| budget.borrow_mut().has_time_for(stage))
    }

    fn fit_dynamics(&self, scene: LagrangianScene) -> Result<FitDynamics<'_>, TrainError> {
        let fit = FitDynamics::new(scene, self.training_data(), &self.config.fit_dynamics);
        let fit = fit.choosing_laws(self.config.distill.resolving(self.dataset.pixel_size()));
        let fit = fit.while_there_is_time(|| {
            self.budget.as_ref().is_none_or(|budget| budget.borrow_mut().has_time_for_search(PARTS_BY_IMAGES))
        });
        Ok(if self.has_time_for(Stage::FitDynamics)? { fit } else { fit.of_known_laws() })
    }

    fn training_data(&self) -> TrainingData<'_> {
        TrainingData {
            frames: self.dataset.split("train"),
            viewing_distance: self.dataset.viewing_distance(),
            seed: self.config.seed,
            device: self.device,
        }
    }

    fn training_loop(&self) -> TrainingLoop<'_> {
        let budget = self.budget.as_ref();
        TrainingLoop { run: self.run, config: self.config, checkpoints: &self.checkpoints, budget }
    }

    /// Whether there is anything to tune on; without, training ends with stage 1.
    fn has_images(&self) -> bool {
        !self.dataset.split("train").is_empty()
    }

    /// Stage 1. It takes seconds, minutes where no law describes many objects, and is not interrupted; its
    /// report is `distillation.json`, and a checkpoint marks its end.
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
            time_window: end_of_window(self.dataset, source, self.config.motion.dt),
            pixel_size: self.dataset.pixel_size(),
            background: self.dataset.background,
            frames: self.dataset.split("train"),
            viewing_distance: self.dataset.viewing_distance(),
            seed: self.config.seed,
            device: self.device,
        };
        let gaussians = source.len();
        self.training_loop().with_budget(|budget| budget.begin(Stage::Distill, self.config.last_stage));
        let mut observer = Observer { budget: self.budget.as_ref(), control, gaussians };
        let initial = initialise_scene(source, &request, &mut observer)?;
        self.training_loop().with_budget(Budget::end);
        self.save_distilled(&initial)?;
        Ok(initial.scene)
    }

    /// Writes the report of stage 1, and the checkpoint of its end.
    fn save_distilled(&self, initial: &InitialScene) -> Result<(), TrainError> {
        let path = self.run.distillation_path();
        let json = serde_json::to_vec_pretty(&initial.reports)
            .map_err(|e| FileError::new("write file", &path, e.into()))?;
        write_atomically(&path, |w| w.write_all(&json))?;
        save_rows(&initial.source_rows, &self.run.source_rows_path())?;
        self.checkpoints.save(Stage::Distill, 0, scene_to_tensors(&initial.scene, CHECKPOINT_FORMAT))?;
        Ok(())
    }

    /// Whether a stage does not run: the configuration leaves it out, there is nothing to train or no image
    /// to train on, or objects that follow linear laws alone have been fitted already.
    fn is_left_out(&self, stage: Stage, scene: &LagrangianScene) -> bool {
        let config = self.config;
        let has_fit = config.fit_dynamics.steps > 0;
        let nothing_to_do = match stage {
            Stage::Source | Stage::Distill => false,
            Stage::RefineGaussians => config.refine_gaussians.iterations == 0 || scene.is_empty(),
            Stage::TuneGaussians | Stage::RetuneGaussians => {
                config.tune_gaussians.iterations == 0 || scene.is_empty()
            }
            Stage::FitDynamics => !has_fit || scene.objects.is_empty(),
            Stage::TuneDynamics => {
                let is_fitted = has_fit && scene.objects.iter().all(is_a_law);
                config.tune_dynamics.iterations == 0 || is_fitted || scene.objects.is_empty()
            }
        };
        nothing_to_do || !self.has_images() || !config.last_stage.includes(stage)
    }

    /// A stage after stage 1, at its first step.
    fn trainer(
        &self,
        stage: Stage,
        scene: LagrangianScene,
    ) -> Result<Box<dyn SceneTrainer + '_>, TrainError> {
        let config = self.config;
        let data = self.training_data();
        Ok(match stage {
            Stage::FitDynamics => Box::new(self.fit_dynamics(scene)?),
            Stage::TuneDynamics => Box::new(TuneDynamics::new(scene, data, &config.tune_dynamics)),
            Stage::RefineGaussians => {
                Box::new(TuneGaussians::refinement(scene, data, &config.refine_gaussians))
            }
            _ => Box::new(TuneGaussians::new(scene, data, &config.tune_gaussians)),
        })
    }
}
