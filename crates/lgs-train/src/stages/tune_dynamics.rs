//! Stage 2: photometric tuning of U, Q, the initial velocity and the initial pose of every object, with its
//! Gaussians fixed.
//!
//! Every few steps the whole motion is rolled without gradients and kept (method §6). A step draws training
//! frames and, in every object, a subset of its particles; the subset is rolled with gradients, the others
//! are drawn where the kept motion has them. One rollout serves all frames: each frame takes the state of its
//! last full step and a shortened step to its own time (method §4.3). With truncation the rollout begins at a
//! kept state `window_steps` before the latest frame, so that memory does not grow with the length of the
//! video.

use burn::tensor::{Device, Tensor};
use lgs_core::optim::cosine_decay;
use lgs_core::stream;
use lgs_data::dataset::Frame;
use lgs_dynamics::RolloutSpec;
use lgs_model::{LagrangianScene, ObjectModel, ParticleDynamics};
use lgs_model::{TensorFile, TensorFileError, scene_to_tensors};
use rand::RngExt;

use super::config::TuneDynamicsConfig;
use super::frame_states::{FrameStates, StateTensors};
use super::light::lit_at;
use super::object_tensors::{ObjectPath, Roll, TrainableObject, Window};
use super::{TrainingData, rows_of_gaussians};
use crate::adam::AdamSteps;
use crate::checkpoint::{CHECKPOINT_FORMAT, Stage};
use crate::cloud_tensors::{CloudTensors, row_indices};
use crate::driver::{Glance, SceneTrainer, Status, Trainer};
use crate::figures::StepReport;
use crate::view::{Comparison, Sensor, View};

/// Stage 2 of a run.
pub struct TuneDynamics<'a> {
    scene: LagrangianScene,
    frames: &'a [Frame],
    config: &'a TuneDynamicsConfig,
    seed: u64,
    step: usize,
    objects: Vec<TrainableObject>,
    static_gaussians: CloudTensors,
    /// At t = 0, before any displacement.
    dynamic_gaussians: CloudTensors,
    kept: Option<KeptMotion>,
    device: Device,
}

/// The motion of the scene as it was some steps ago, and its Gaussians at t = 0.
struct KeptMotion {
    states: FrameStates,
    at_start: CloudTensors,
}

impl KeptMotion {
    fn roll(scene: LagrangianScene, device: &Device) -> Self {
        let at_start = CloudTensors::new(&scene.dynamic_gaussians, device);
        Self { at_start, states: FrameStates::new(scene, device) }
    }

    /// The dynamic Gaussians at a time.
    fn at(&mut self, time: f32) -> CloudTensors {
        let state = self.states.at(time);
        let log_scales = self.at_start.log_scales.clone() + state.growth;
        let sh = state.colors.of(self.at_start.sh.clone());
        let StateTensors { means, rotations, .. } = state;
        CloudTensors { means, rotations, log_scales, sh, ..self.at_start.clone() }
    }
}

/// The rollouts of a step's subset, and the window that they cover.
struct Rollouts {
    window: Window,
    paths: Vec<ObjectPath>,
}

impl<'a> TuneDynamics<'a> {
    /// Stage 2 from its first step.
    #[must_use]
    pub fn new(scene: LagrangianScene, data: TrainingData<'a>, config: &'a TuneDynamicsConfig) -> Self {
        let TrainingData { frames, seed, device, .. } = data;
        let of_particles = |(index, object): (usize, &ObjectModel)| {
            let particles = object.dynamics.particles().filter(|_| object.recording.is_none())?;
            Some(TrainableObject::new(index, particles, &scene, (config.initial_velocity, device)))
        };
        let objects = scene.objects.iter().enumerate().filter_map(of_particles).collect();
        Self {
            static_gaussians: CloudTensors::new(&scene.static_gaussians, device),
            dynamic_gaussians: CloudTensors::new(&scene.dynamic_gaussians, device),
            scene,
            frames,
            config,
            seed,
            step: 0,
            objects,
            kept: None,
            device: device.clone(),
        }
    }

    /// The steps to roll: from the window's start (0, or `window_steps` before the latest frame) to the
    /// latest frame.
    fn window(&self, frames: &[&Frame]) -> Window {
        let dt = self.scene.motion.dt;
        let last = frames.iter().map(|f| RolloutSpec::until(f.time.max(0.0), dt).steps).max().unwrap_or(0);
        let truncate =
            self.config.window_steps > 0 && !self.step.is_multiple_of(self.config.full_window_every);
        let first = if truncate { last.saturating_sub(self.config.window_steps) } else { 0 };
        Window { first, steps: last - first, dt }
    }

    /// Rolls a subset of every object's particles over the window of some frames.
    fn roll(&self, frames: &[&Frame], kept: &mut KeptMotion, rng: &mut lgs_core::Stream) -> Rollouts {
        let window = self.window(frames);
        let start = kept.states.after(window.first);
        let device = self.device.clone().autodiff();
        let paths = (self.objects.iter())
            .map(|trained| {
                let roll = Roll { start: &start, window: &window, subset: self.config.subset };
                trained.roll(&roll, rng, &device)
            })
            .collect();
        Rollouts { window, paths }
    }

    /// The Gaussians of one frame, those of the subset where their rollout has them, compared with it.
    fn compare(&self, frame: &Frame, kept: &mut KeptMotion, rollouts: &Rollouts) -> Comparison {
        let time = frame.time.max(0.0);
        let mut is_rolled = vec![false; self.scene.dynamic_gaussians.len()];
        rollouts.paths.iter().flat_map(|path| &path.rows).for_each(|&row| is_rolled[row] = true);
        let fixed: Vec<usize> = (0..is_rolled.len()).filter(|&row| !is_rolled[row]).collect();
        let mut drawn = self.static_gaussians.clone();
        let still = drawn.len();
        let dynamic = fixed.iter().chain(rollouts.paths.iter().flat_map(|path| &path.rows));
        let rows: Vec<usize> = (0..still).chain(dynamic.map(|row| still + row)).collect();
        if !fixed.is_empty() {
            drawn = drawn.followed_by(kept.at(time).select(&row_indices(fixed, &self.device)));
        }
        let mut drawn = drawn.autodiff();
        for (object, path) in self.objects.iter().zip(&rollouts.paths) {
            let at_start = if path.is_displaced() { &self.dynamic_gaussians } else { &kept.at_start };
            let own = at_start.select(&row_indices(path.rows.iter().copied(), &self.device)).autodiff();
            let (means, rotations) = path.poses_at(object, &rollouts.window, time, &own.rotations);
            drawn = drawn.followed_by(CloudTensors { means, rotations, ..own });
        }
        let device = self.device.clone().autodiff();
        let drawn = lit_at(drawn, rows.into_iter(), (&self.scene, time));
        let sensor = Sensor::of(frame, &device);
        let view = View::of_scene(&self.scene, (frame, &sensor), self.config.ssim_weight, &device);
        view.compare_cloud(drawn)
    }

    /// The scene that the kept motion of a checkpoint was rolled from.
    fn kept_scene(&self, file: &TensorFile) -> Result<LagrangianScene, TensorFileError> {
        let mut scene = self.scene.clone();
        let n = scene.dynamic_gaussians.len();
        scene.velocities = rows_of_gaussians(file, "tune.kept.velocities", n)?;
        scene.dynamic_gaussians.means = rows_of_gaussians(file, "tune.kept.means", n)?;
        scene.dynamic_gaussians.rotations = rows_of_gaussians(file, "tune.kept.rotations", n)?;
        for (index, object) in scene.objects.iter_mut().enumerate() {
            let Some(ParticleDynamics { system, .. }) = object.dynamics.particles_mut() else { continue };
            let name = format!("tune.kept.{index}");
            let (_, params) = file.values(&name)?;
            if params.len() != system.params.len() {
                let expected = format!("{} values", system.params.len());
                return Err(file.field(&name, &expected, params.len().to_string()));
            }
            system.params.copy_from_slice(params);
        }
        Ok(scene)
    }

    /// A step of every object along the gradients of its tensors.
    fn descend(&mut self, paths: &[ObjectPath], gradients: &mut burn::tensor::Gradients) {
        let (config, rate) = (self.config, cosine_decay(self.step, self.config.iterations));
        let mut steps = AdamSteps::default();
        for (object, path) in self.objects.iter_mut().zip(paths) {
            steps.add(&mut object.network, config.learning_rate * rate, path.network.grad_remove(gradients));
            let velocity_rate = config.velocity_learning_rate * f64::from(object.rms_speed) * rate;
            steps.add(&mut object.velocity, velocity_rate, path.velocity.grad_remove(gradients));
            let pose = path.pose.as_ref().and_then(|pose| pose.grad_remove(gradients));
            object.pose.add_step(config.pose_learning_rate * rate, pose, &mut steps);
        }
        steps.take();
    }
}

impl Trainer for TuneDynamics<'_> {
    fn status(&self) -> Status {
        let is_trained = !self.frames.is_empty() && !self.objects.is_empty();
        Status {
            stage: Stage::TuneDynamics,
            step: self.step,
            steps: if is_trained { self.config.iterations } else { 0 },
            gaussians: self.scene.len(),
        }
    }

    fn glance(&self) -> Glance {
        Glance::Scene(self.scene().into())
    }

    fn step(&mut self) -> StepReport {
        let kept = self.kept.take().filter(|_| !self.step.is_multiple_of(self.config.refresh_every));
        let mut kept = kept.unwrap_or_else(|| KeptMotion::roll(self.scene(), &self.device));
        let mut rng = stream(self.seed, "tune-dynamics", self.step as u64);
        let chosen: Vec<&Frame> = (0..self.config.frames_per_step)
            .map(|_| &self.frames[rng.random_range(0..self.frames.len())])
            .collect();
        let rollouts = self.roll(&chosen, &mut kept, &mut rng);
        let compared = chosen.iter().filter(|frame| rollouts.window.contains(frame.time)).map(|frame| {
            let Comparison { loss, mse, .. } = self.compare(frame, &mut kept, &rollouts);
            (loss, mse)
        });
        let (losses, errors): (Vec<Tensor<1>>, Vec<Tensor<1>>) = compared.unzip();
        let loss = Tensor::cat(losses, 0).sum().div_scalar(errors.len() as f32);
        let mut gradients = tracing::trace_span!("backward").in_scope(|| loss.backward());
        self.descend(&rollouts.paths, &mut gradients);
        self.step += 1;
        self.kept = Some(kept);
        StepReport::on_device(&loss, &errors)
    }

    fn checkpoint(&self) -> TensorFile {
        let mut file = scene_to_tensors(&self.scene, CHECKPOINT_FORMAT);
        for object in &self.objects {
            object.insert_into(&mut file, &format!("tune.{}", object.index));
        }
        let Some(kept) = &self.kept else { return file };
        let LagrangianScene { dynamic_gaussians, velocities, objects, .. } = kept.states.scene();
        let n = velocities.len();
        file.insert("tune.kept.velocities", &[n, 3], velocities.as_flattened());
        file.insert("tune.kept.means", &[n, 3], dynamic_gaussians.means.as_flattened());
        file.insert("tune.kept.rotations", &[n, 4], dynamic_gaussians.rotations.as_flattened());
        for (index, object) in objects.iter().enumerate() {
            if let Some(ParticleDynamics { system, .. }) = object.dynamics.particles() {
                file.insert(format!("tune.kept.{index}"), &[system.params.len()], &system.params);
            }
        }
        file
    }

    fn restore(&mut self, file: &TensorFile, step: usize) -> Result<(), TensorFileError> {
        for object in &mut self.objects {
            object.restore(file, &format!("tune.{}", object.index))?;
        }
        if step > 0 {
            self.kept = Some(KeptMotion::roll(self.kept_scene(file)?, &self.device));
        }
        self.step = step;
        Ok(())
    }
}

impl SceneTrainer for TuneDynamics<'_> {
    fn scene(&self) -> LagrangianScene {
        let mut scene = self.scene.clone();
        self.objects.iter().for_each(|trained| trained.write_to(&mut scene));
        scene
    }
}
