//! Stage 3: the Gaussians against the images, with the dynamics frozen.
//!
//! The same comes before stage 2, as refinement: a source model lets Gaussians slip where its motion is not
//! that of the surfaces, and only once they fit the distilled motion do the images' residuals tell what is
//! wrong with it.
//!
//! A step draws one training frame and its state of the current motion. Dynamic Gaussians are drawn where the
//! rollout put them, displaced by the accumulated rotation times what their means have changed since that
//! rollout (straight-through, method §6); the motion is rolled anew from the changed means every so many
//! steps. The few Gaussians that support a rigid constraint keep their means, and with them the motion that
//! was found for the object.

use burn::tensor::{Device, Tensor, TensorData};
use lgs_core::optim::cosine_decay;
use lgs_core::stream;
use lgs_data::dataset::Frame;
use lgs_dynamics::Supports;
use lgs_model::{LagrangianScene, TensorFile, TensorFileError, scene_to_tensors};
use rand::RngExt;

use super::TrainingData;
use super::body_displacements::{BodyDisplacements, displaced};
use super::config::TuneGaussiansConfig;
use super::frame_states::{FrameStates, StateTensors};
use super::light::lit_at;
use super::opacity_prior::OpacityPrior;
use crate::adam::AdamSteps;
use crate::checkpoint::{CHECKPOINT_FORMAT, Stage};
use crate::clock::Clock;
use crate::cloud_tensors::{CloudTensors, host_rows, products, quat_matrices, rows};
use crate::driver::{Glance, SceneTrainer, Status, Trainer};
use crate::figures::StepReport;
use crate::trainable_cloud::TrainableCloud;
use crate::view::{Sensor, View};

/// Name of the means of the kept motion in a checkpoint.
const ROLLED_MEANS: &str = "tune.rolled_means";
/// Name of the round in a checkpoint.
const ROUND: &str = "tune.round";

/// Stage 3 of a run, or the refinement before stage 2.
pub struct TuneGaussians<'a> {
    stage: Stage,
    /// How often the stage has begun.
    round: usize,
    scene: LagrangianScene,
    frames: &'a [Frame],
    config: TuneGaussiansConfig,
    seed: u64,
    clock: Clock,
    static_gaussians: TrainableCloud,
    dynamic_gaussians: TrainableCloud,
    /// `[n, 1]`: one for dynamic Gaussians whose means may change, zero for the others.
    is_free: Tensor<2>,
    prior: OpacityPrior,
    /// In the refinement, where a body may move otherwise than its tracks.
    displacements: Option<BodyDisplacements>,
    kept: Option<KeptMotion>,
    device: Device,
}

/// The motion that Gaussians are drawn in, and the means `[n, 3]` that it was rolled from.
struct KeptMotion {
    states: FrameStates,
    means: Tensor<2>,
}

impl KeptMotion {
    fn roll(scene: LagrangianScene, device: &Device) -> Self {
        Self { means: rows(&scene.dynamic_gaussians.means, device), states: FrameStates::new(scene, device) }
    }
}

impl<'a> TuneGaussians<'a> {
    /// Stage 3 from its first step.
    #[must_use]
    pub fn new(scene: LagrangianScene, data: TrainingData<'a>, config: &TuneGaussiansConfig) -> Self {
        Self::of_stage(Stage::TuneGaussians, scene, data, config)
    }

    /// The refinement before stage 2 from its first step.
    #[must_use]
    pub fn refinement(scene: LagrangianScene, data: TrainingData<'a>, config: &TuneGaussiansConfig) -> Self {
        Self::of_stage(Stage::RefineGaussians, scene, data, config)
    }

    /// Stage 3 once more from its first step, or another time after the steps of those before.
    #[must_use]
    pub fn again(
        scene: LagrangianScene,
        data: TrainingData<'a>,
        config: &TuneGaussiansConfig,
        before: Option<&Self>,
    ) -> Self {
        let again = Self::of_stage(Stage::RetuneGaussians, scene, data, config);
        let Some(before) = before else { return again };
        let clock = before.clock.begun_again(again.clock.length());
        Self { round: before.round + 1, clock, ..again }
    }

    /// How often the stage has begun, this time included.
    #[must_use]
    pub fn round(&self) -> usize {
        self.round
    }

    fn of_stage(
        stage: Stage,
        scene: LagrangianScene,
        data: TrainingData<'a>,
        config: &TuneGaussiansConfig,
    ) -> Self {
        let TrainingData { frames, viewing_distance, seed, device } = data;
        let config = config.resolved(frames.first().map_or(0, |f| f.camera.width), viewing_distance);
        let is_trained = !frames.is_empty() && !scene.is_empty();
        Self {
            stage,
            round: 1,
            clock: Clock::new(if is_trained { config.iterations } else { 0 }),
            static_gaussians: TrainableCloud::new(&scene.static_gaussians, device),
            dynamic_gaussians: TrainableCloud::new(&scene.dynamic_gaussians, device),
            is_free: is_free(&scene, device),
            prior: OpacityPrior::new(&scene, config.opacity_prior, device),
            displacements: match stage {
                Stage::RefineGaussians => BodyDisplacements::new(&scene, device),
                _ => None,
            },
            scene,
            frames,
            config,
            seed,
            kept: None,
            device: device.clone(),
        }
    }
}

/// Dynamic Gaussians in a state of the motion, with gradients to what they were at t = 0.
fn moved(at_start: CloudTensors, state: StateTensors, rolled_means: &Tensor<2>) -> CloudTensors {
    let change = at_start.means - rolled_means.clone().autodiff();
    CloudTensors {
        means: state.means.autodiff() + products(state.matrices.autodiff(), change),
        rotations: products(quat_matrices(state.turns).autodiff(), at_start.rotations),
        log_scales: at_start.log_scales + state.growth.autodiff(),
        sh: state.colors.autodiff().of(at_start.sh),
        ..at_start
    }
}

impl Trainer for TuneGaussians<'_> {
    fn status(&self) -> Status {
        Status::of(self.stage, &self.clock, self.scene.len())
    }

    fn clock(&mut self) -> Option<&mut Clock> {
        Some(&mut self.clock)
    }

    fn glance(&self) -> Glance {
        Glance::Scene(self.scene().into())
    }

    fn step(&mut self) -> StepReport {
        let step = self.clock.taken();
        self.clock.advance();
        let kept = self.kept.take().filter(|_| !step.is_multiple_of(self.config.refresh_every.max(1)));
        let mut kept = kept.unwrap_or_else(|| KeptMotion::roll(self.scene(), &self.device));
        let mut rng = stream(self.seed, self.stage.name(), step as u64);
        let frame = &self.frames[rng.random_range(0..self.frames.len())];
        let device = self.device.clone().autodiff();
        let (of_static, of_dynamic) = (self.static_gaussians.leaves(), self.dynamic_gaussians.leaves());
        let moved = moved(of_dynamic.tensors(), kept.states.at(frame.time), &kept.means);
        let (moved, displacement) = displaced(self.displacements.as_ref(), moved, frame.time);
        let cloud =
            lit_at(of_static.tensors().followed_by(moved), 0..self.scene.len(), (&self.scene, frame.time));
        let sensor = Sensor::of(frame, &device);
        let view = View::of_scene(&self.scene, (frame, &sensor), self.config.ssim_weight, &device);
        let compared = view.compare_cloud(cloud);
        let loss = self.prior.added_to(compared.loss.clone(), [&of_static, &of_dynamic]);
        let mut gradients = tracing::trace_span!("backward").in_scope(|| loss.backward());
        let decay = cosine_decay(self.clock.iteration() - 1, self.config.iterations);
        let rates = self.config.cloud_rates().scaled(decay);
        let (of_static, mut of_dynamic) =
            (of_static.gradients(&mut gradients), of_dynamic.gradients(&mut gradients));
        of_dynamic.means = of_dynamic.means.map(|gradient| gradient * self.is_free.clone());
        let mut steps = AdamSteps::default();
        self.static_gaussians.add_steps(of_static, &rates, &mut steps);
        self.dynamic_gaussians.add_steps(of_dynamic, &rates, &mut steps);
        if let (Some(displacements), Some(leaf)) = (&mut self.displacements, displacement) {
            displacements.add_step(&leaf, &mut gradients, decay, &mut steps);
        }
        steps.take();
        self.kept = Some(kept);
        StepReport::on_device(&compared.loss, &[compared.mse])
    }

    fn checkpoint(&self) -> TensorFile {
        let mut file = scene_to_tensors(&self.scene(), CHECKPOINT_FORMAT);
        self.clock.insert_into(&mut file);
        file.set_metadata(ROUND, self.round.to_string());
        self.prior.insert_into(&mut file);
        self.static_gaussians.insert_into(&mut file, "tune.static");
        self.dynamic_gaussians.insert_into(&mut file, "tune.dynamic");
        if let Some(displacements) = &self.displacements {
            displacements.insert_into(&mut file);
        }
        if let Some(kept) = &self.kept {
            let means: Vec<[f32; 3]> = host_rows(&kept.means);
            file.insert(ROLLED_MEANS, &[means.len(), 3], means.as_flattened());
        }
        file
    }

    fn restore(&mut self, file: &TensorFile, step: usize) -> Result<(), TensorFileError> {
        let read = |name: &str, like: &TrainableCloud, degree: usize| {
            let cloud = TrainableCloud::read_from(file, name, degree, &self.device)?;
            if cloud.len() == like.len() {
                Ok(cloud)
            } else {
                Err(file.field(name, &format!("{} Gaussians", like.len()), cloud.len().to_string()))
            }
        };
        let LagrangianScene { static_gaussians, dynamic_gaussians, .. } = &self.scene;
        let of_static = read("tune.static", &self.static_gaussians, static_gaussians.sh_degree)?;
        let of_dynamic = read("tune.dynamic", &self.dynamic_gaussians, dynamic_gaussians.sh_degree)?;
        (self.static_gaussians, self.dynamic_gaussians) = (of_static, of_dynamic);
        self.prior.restore(file)?;
        if let Some(displacements) = &mut self.displacements {
            displacements.restore(file)?;
        }
        if step > 0 {
            let mut rolled = self.scene();
            rolled.dynamic_gaussians.means =
                super::rows_of_gaussians(file, ROLLED_MEANS, self.dynamic_gaussians.len())?;
            self.kept = Some(KeptMotion::roll(rolled, &self.device));
        }
        let round = file.metadata(ROUND)?;
        self.round = round.parse().map_err(|_| file.field(ROUND, "a number", round.to_owned()))?;
        self.clock.restore(file, step)
    }
}

impl SceneTrainer for TuneGaussians<'_> {
    fn scene(&self) -> LagrangianScene {
        let mut scene = self.scene.clone();
        scene.static_gaussians = self.static_gaussians.cloud();
        scene.dynamic_gaussians = self.dynamic_gaussians.cloud();
        scene
    }
}

/// `[n, 1]`: zero for the dynamic Gaussians that are the common support of all particles of an object under
/// a rigid constraint, one for the others.
fn is_free(scene: &LagrangianScene, device: &Device) -> Tensor<2> {
    let mut is_free = vec![1.0_f32; scene.dynamic_gaussians.len()];
    for object in &scene.objects {
        for &support in object.dynamics.supports().and_then(Supports::common).into_iter().flatten() {
            is_free[object.members.start + support as usize] = 0.0;
        }
    }
    Tensor::from_data(TensorData::new(is_free, [scene.dynamic_gaussians.len(), 1]), device)
}
