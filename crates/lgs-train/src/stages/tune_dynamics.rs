//! Stage 2: photometric tuning of U, Q, the initial velocity and the initial pose of every object, with its
//! Gaussians fixed.
//!
//! Every few steps the whole motion is rolled without gradients and kept (G23). A step draws training frames
//! and, in every object, a subset of its particles; the subset is rolled with gradients, the others are drawn
//! where the kept motion has them (G24). One rollout serves all frames: each frame takes the state of its
//! last full step and a shortened step to its own time (G9). With truncation (G26) the rollout begins at a
//! kept state `window_steps` before the latest frame, so that memory does not grow with the length of the
//! video.

use burn::tensor::{Device, Tensor};
use lgs_core::stream;
use lgs_data::dataset::Frame;
use lgs_dynamics::{Edit, RolloutSpec};
use lgs_model::{LagrangianScene, SceneState, TensorFile, TensorFileError, scene_to_tensors};
use rand::RngExt;

use super::cloud_tensors::CloudTensors;
use super::config::TuneDynamicsConfig;
use super::object_tensors::{ObjectPath, TrainableObject, Window};
use super::{StepReport, Tuning, View, cosine, frame_loss, psnr_of};
use crate::adam::values;
use crate::checkpoint::{CHECKPOINT_FORMAT, Stage};

/// Stage 2 of a run.
pub struct TuneDynamics<'a> {
    scene: LagrangianScene,
    frames: &'a [Frame],
    config: &'a TuneDynamicsConfig,
    seed: u64,
    step: usize,
    objects: Vec<TrainableObject>,
    kept: Option<KeptMotion>,
    device: Device,
}

/// The motion of a scene as it was some steps ago: states on the step grid over the window.
struct KeptMotion {
    scene: LagrangianScene,
    states: Vec<SceneState>,
}

impl KeptMotion {
    fn roll(scene: LagrangianScene) -> Self {
        let _span = tracing::trace_span!("roll the motion").entered();
        let steps = RolloutSpec::until(scene.motion.time_window, scene.motion.dt).steps;
        let start = SceneState::at_start(scene.dynamic_gaussians.means.clone(), scene.velocities.clone());
        let mut states = vec![start];
        states.extend(scene.advance(&states[0], scene.motion.dt, steps, Edit::default(), None));
        Self { scene, states }
    }

    fn state_at(&self, time: f32) -> SceneState {
        let until = RolloutSpec::until(time, self.scene.motion.dt);
        let state = &self.states[until.steps.min(self.states.len() - 1)];
        let rest =
            until.last_dt.and_then(|rest| self.scene.advance(state, rest, 1, Edit::default(), None).pop());
        rest.unwrap_or_else(|| state.clone())
    }
}

impl<'a> TuneDynamics<'a> {
    /// Stage 2 from its first step. `frames` are the training frames.
    #[must_use]
    pub fn new(
        scene: LagrangianScene,
        frames: &'a [Frame],
        config: &'a TuneDynamicsConfig,
        seed: u64,
    ) -> Self {
        let device = Device::flex();
        let objects = scene
            .objects
            .iter()
            .map(|o| TrainableObject::new(o, &scene, config.initial_velocity, &device))
            .collect();
        Self { scene, frames, config, seed, step: 0, objects, kept: None, device }
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

    /// The photometric loss of one frame and its mean squared error.
    fn loss(
        &self,
        frame: &Frame,
        kept: &KeptMotion,
        paths: &[ObjectPath],
        window: &Window,
        device: &Device,
    ) -> (Tensor<1>, f64) {
        let state = kept.state_at(frame.time.max(0.0));
        let cloud = kept.scene.cloud_at(&state);
        let static_gaussians = self.scene.static_gaussians.len();
        let mut is_free = vec![false; cloud.len()];
        for row in paths.iter().flat_map(|path| &path.rows) {
            is_free[static_gaussians + row] = true;
        }
        let fixed: Vec<usize> = (0..cloud.len()).filter(|&i| !is_free[i]).collect();
        let mut drawn = CloudTensors::new(&cloud.select(&fixed), device);
        for (object, path) in self.objects.iter().zip(paths) {
            let at_start = if path.is_displaced() { &self.scene } else { &kept.scene };
            let own = CloudTensors::new(&at_start.dynamic_gaussians.select(&path.rows), device);
            let (means, rotations) = path.poses_at(object, window, frame.time.max(0.0), &own.rotations);
            drawn = drawn.followed_by(&CloudTensors { means, rotations, ..own });
        }
        let view =
            View { frame, background: self.scene.background, ssim_weight: self.config.ssim_weight, device };
        frame_loss(drawn, cloud.sh_degree, &view)
    }

    /// The scene that the kept motion of a checkpoint was rolled from.
    fn kept_scene(&self, file: &TensorFile) -> Result<LagrangianScene, TensorFileError> {
        let mut scene = self.scene.clone();
        let dynamic_gaussians = scene.dynamic_gaussians.len();
        scene.velocities = kept_rows(file, "tune.kept.velocities", dynamic_gaussians)?;
        scene.dynamic_gaussians.means = kept_rows(file, "tune.kept.means", dynamic_gaussians)?;
        scene.dynamic_gaussians.rotations = kept_rows(file, "tune.kept.rotations", dynamic_gaussians)?;
        for (index, object) in scene.objects.iter_mut().enumerate() {
            let name = format!("tune.kept.{index}");
            let (_, params) = file.values(&name)?;
            if params.len() != object.system.params.len() {
                return Err(file.field(
                    &name,
                    &format!("{} values", object.system.params.len()),
                    params.len().to_string(),
                ));
            }
            object.system.params.copy_from_slice(params);
        }
        Ok(scene)
    }
}

impl Tuning for TuneDynamics<'_> {
    fn stage(&self) -> Stage {
        Stage::TuneDynamics
    }

    fn steps(&self) -> usize {
        self.config.iterations
    }

    fn step_index(&self) -> usize {
        self.step
    }

    fn is_finished(&self) -> bool {
        self.step >= self.config.iterations || self.objects.is_empty() || self.frames.is_empty()
    }

    fn scene(&self) -> LagrangianScene {
        let mut scene = self.scene.clone();
        self.objects.iter().enumerate().for_each(|(index, trained)| trained.write_to(&mut scene, index));
        scene
    }

    fn step(&mut self) -> StepReport {
        let kept = match self.kept.take() {
            Some(kept) if !self.step.is_multiple_of(self.config.refresh_every) => kept,
            _ => KeptMotion::roll(self.scene()),
        };
        let mut rng = stream(self.seed, "tune-dynamics", self.step as u64);
        let chosen: Vec<&Frame> = (0..self.config.frames_per_step)
            .map(|_| &self.frames[rng.random_range(0..self.frames.len())])
            .collect();
        let window = self.window(&chosen);
        let device = self.device.clone().autodiff();
        let start = &kept.states[window.first.min(kept.states.len() - 1)];
        let paths: Vec<ObjectPath> = (self.scene.objects.iter().zip(&self.objects))
            .map(|(object, trained)| {
                trained.roll(object, start, &window, self.config.subset, &mut rng, &device)
            })
            .collect();
        let losses = chosen
            .iter()
            .filter(|f| window.contains(f.time))
            .map(|f| self.loss(f, &kept, &paths, &window, &device));
        let (losses, errors): (Vec<Tensor<1>>, Vec<f64>) = losses.unzip();
        let count = losses.len() as f32;
        let loss = Tensor::cat(losses, 0).sum().div_scalar(count);
        let gradients = tracing::trace_span!("backward").in_scope(|| loss.backward());
        let rate = cosine(self.step, self.config.iterations);
        for (object, path) in self.objects.iter_mut().zip(&paths) {
            object.network.step(self.config.learning_rate * rate, path.network.grad(&gradients));
            let velocity_rate = self.config.velocity_learning_rate * f64::from(object.rms_speed) * rate;
            object.velocity.step(velocity_rate, path.velocity.grad(&gradients));
            object.pose.step(
                self.config.pose_learning_rate * rate,
                path.pose.as_ref().and_then(|pose| pose.grad(&gradients)),
            );
        }
        self.step += 1;
        self.kept = Some(kept);
        let psnr = psnr_of(errors.iter().sum::<f64>() / f64::from(count));
        StepReport { loss: values(&loss.inner())[0], psnr }
    }

    fn checkpoint(&self) -> TensorFile {
        let mut file = scene_to_tensors(&self.scene, CHECKPOINT_FORMAT);
        for (index, object) in self.objects.iter().enumerate() {
            object.insert_into(&mut file, &format!("tune.{index}"));
        }
        let Some(kept) = &self.kept else { return file };
        let LagrangianScene { dynamic_gaussians, velocities, .. } = &kept.scene;
        file.insert("tune.kept.velocities", &[velocities.len(), 3], velocities.as_flattened());
        file.insert("tune.kept.means", &[dynamic_gaussians.len(), 3], dynamic_gaussians.means.as_flattened());
        file.insert(
            "tune.kept.rotations",
            &[dynamic_gaussians.len(), 4],
            dynamic_gaussians.rotations.as_flattened(),
        );
        for (index, object) in kept.scene.objects.iter().enumerate() {
            file.insert(format!("tune.kept.{index}"), &[object.system.params.len()], &object.system.params);
        }
        file
    }

    fn restore(&mut self, file: &TensorFile, step: usize) -> Result<(), TensorFileError> {
        for (index, object) in self.objects.iter_mut().enumerate() {
            object.restore(file, &format!("tune.{index}"), &self.device)?;
        }
        if step > 0 {
            self.kept = Some(KeptMotion::roll(self.kept_scene(file)?));
        }
        self.step = step;
        Ok(())
    }
}

/// Rows of the kept motion in a checkpoint, one per moving Gaussian.
fn kept_rows<const D: usize>(
    file: &TensorFile,
    name: &str,
    dynamic_gaussians: usize,
) -> Result<Vec<[f32; D]>, TensorFileError> {
    let rows: Vec<[f32; D]> = file.rows(name)?;
    if rows.len() == dynamic_gaussians {
        Ok(rows)
    } else {
        Err(file.field(name, &format!("{dynamic_gaussians} rows"), rows.len().to_string()))
    }
}
