//! Stage 2, first part: every object's start and the constants of its law by least squares on the images, its
//! Gaussians fixed.

use lgs_data::dataset::Frame;
use lgs_distill::DistillConfig;
use lgs_model::{LagrangianScene, TensorFile, TensorFileError, scene_to_tensors};

use super::TrainingData;
use super::bands_of_views::with_bands_of_views;
use super::config::FitDynamicsConfig;
use super::image_laws::with_laws_of_images;
use super::law_choice::{LawChoice, Sought};
use super::newton::Newton;
use crate::checkpoint::{CHECKPOINT_FORMAT, Stage};
use crate::driver::{Glance, SceneTrainer, Status, Trainer};
use crate::figures::StepReport;

/// The fit of a scene's dynamics.
pub struct FitDynamics<'a> {
    scene: LagrangianScene,
    frames: &'a [Frame],
    config: &'a FitDynamicsConfig,
    step: usize,
    newton: Newton,
    seed: u64,
    /// How laws are chosen once more, by the images; not at all without.
    laws: Option<DistillConfig>,
    /// Whether there is time to seek laws of objects that have none.
    has_time: bool,
    /// Whether there is time to seek laws of parts of the window, which takes about as long as all before it.
    has_time_for_parts: Box<dyn Fn() -> bool + 'a>,
}

impl<'a> FitDynamics<'a> {
    /// The fit from its first step.
    #[must_use]
    pub fn new(scene: LagrangianScene, data: TrainingData<'a>, config: &'a FitDynamicsConfig) -> Self {
        let TrainingData { frames, seed, .. } = data;
        Self {
            newton: Newton::new(&scene, seed),
            scene,
            frames,
            config,
            step: 0,
            seed,
            laws: None,
            has_time: true,
            has_time_for_parts: Box::new(|| true),
        }
    }
}

impl<'a> FitDynamics<'a> {
    /// The same without laws of parts of the window where there is no time for them.
    #[must_use]
    pub fn while_there_is_time(self, has_time_for_parts: impl Fn() -> bool + 'a) -> Self {
        Self { has_time_for_parts: Box::new(has_time_for_parts), ..self }
    }
}

impl FitDynamics<'_> {
    /// The same with laws chosen once more by the images, before the first step.
    #[must_use]
    pub fn choosing_laws(self, laws: DistillConfig) -> Self {
        Self { laws: Some(laws), ..self }
    }

    /// The same in a hurry: laws are chosen for those objects alone that have one.
    #[must_use]
    pub fn of_known_laws(self) -> Self {
        Self { has_time: false, ..self }
    }

    /// The scene with its laws as the images of the first step show them, without any step, and with bands
    /// that allow for what single views have wrong; and by how many decibels it draws the images better.
    #[must_use]
    pub fn with_laws_of_images(self) -> (LagrangianScene, f64) {
        let frames = self.config.observed(self.frames, 0);
        let (scene, gain) = match &self.laws {
            Some(laws) => self.chosen(laws, Sought::OfEach, &frames),
            None => (self.scene.clone(), 0.0),
        };
        let resolved = self.laws.as_ref().map_or(0.0, |laws| f64::from(laws.forecast_tolerance));
        (with_bands_of_views(scene, &self.scene, &frames, (resolved, self.seed)), gain)
    }
}

impl FitDynamics<'_> {
    /// The scene with laws chosen by images, and by how many decibels it draws them better. Laws of parts and
    /// of couples are sought once, before the first step.
    fn chosen(&self, config: &DistillConfig, sought: Sought, frames: &[&Frame]) -> (LagrangianScene, f64) {
        let sought = if self.has_time { sought } else { Sought::Known };
        let choice = LawChoice { config, seed: self.seed, sought };
        with_laws_of_images(self.scene.clone(), frames, choice, &self.has_time_for_parts)
    }
}

impl Trainer for FitDynamics<'_> {
    fn status(&self) -> Status {
        let has_nothing = self.frames.is_empty() || self.scene.objects.is_empty();
        // The first step chooses laws; where none is taken nothing is left to be fitted.
        let is_done = self.step > 0 && self.newton.is_empty();
        let steps = match (has_nothing, is_done) {
            (true, _) => 0,
            (false, true) => self.step,
            (false, false) => self.config.steps,
        };
        Status { stage: Stage::FitDynamics, step: self.step, steps, gaussians: self.scene.len() }
    }

    fn glance(&self) -> Glance {
        Glance::Scene(self.scene().into())
    }

    fn step(&mut self) -> StepReport {
        let frames = self.config.observed(self.frames, self.step);
        if let Some(laws) = self.laws.as_ref().filter(|_| self.step == 0) {
            (self.scene, _) = self.chosen(laws, Sought::All, &frames);
            self.newton = Newton::new(&self.scene, self.seed);
        }
        let report = self.newton.step(&self.scene, &frames);
        self.step += 1;
        report
    }

    fn checkpoint(&self) -> TensorFile {
        let mut file = scene_to_tensors(&self.scene, CHECKPOINT_FORMAT);
        self.newton.insert_into(&mut file);
        file
    }

    fn restore(&mut self, file: &TensorFile, step: usize) -> Result<(), TensorFileError> {
        self.step = step;
        self.newton.restore(file)
    }
}

impl SceneTrainer for FitDynamics<'_> {
    fn scene(&self) -> LagrangianScene {
        self.newton.applied_to(&self.scene)
    }
}
