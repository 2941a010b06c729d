//! Stage 3: the Gaussians against the images, with the dynamics frozen.
//!
//! The same comes before stage 2: a source model lets Gaussians slip where its motion is not that of the
//! surfaces, and only once they have settled into the distilled motion do the images' residuals speak of what
//! is wrong with it.
//!
//! A step draws one training frame and its state of the current motion. Moving Gaussians are drawn where the
//! rollout put them, displaced by the accumulated rotation times what their means have changed since that
//! rollout (straight-through, G34); the motion is rolled anew from the changed means every so many steps. The
//! few Gaussians that hold a whole object rigid keep their means, and with them the motion that was found for
//! the object.

use burn::tensor::{Device, Tensor, TensorData};
use lgs_core::{linear, stream};
use lgs_data::dataset::Frame;
use lgs_dynamics::{Edit, Reversal, Supports};
use lgs_model::{LagrangianScene, Motion, SceneState, TensorFile, TensorFileError, scene_to_tensors};
use rand::RngExt;

use super::cloud_tensors::{CloudTensors, quat_mul, rows};
use super::config::TuneGaussiansConfig;
use super::trainable_cloud::TrainableCloud;
use super::{StepReport, Tuning, View, cosine, frame_loss, psnr_of};
use crate::adam::values;
use crate::checkpoint::{CHECKPOINT_FORMAT, Stage};

/// Stage 3 of a run, or the settling before stage 2.
pub struct TuneGaussians<'a> {
    stage: Stage,
    scene: LagrangianScene,
    frames: &'a [Frame],
    config: TuneGaussiansConfig,
    seed: u64,
    step: usize,
    static_gaussians: TrainableCloud,
    dynamic_gaussians: TrainableCloud,
    /// `[n, 1]`: one for moving Gaussians whose means may change.
    is_loose: Tensor<2>,
    /// Means that the cached states were rolled from.
    rolled_means: Vec<[f32; 3]>,
    /// The motion at every training time; frames of one time share it.
    states: FrameStates,
    device: Device,
}

impl<'a> TuneGaussians<'a> {
    /// The stage of that name from its first step. `frames` are the training frames.
    #[must_use]
    pub fn new(
        stage: Stage,
        scene: LagrangianScene,
        frames: &'a [Frame],
        config: &TuneGaussiansConfig,
        seed: u64,
    ) -> Self {
        let device = Device::flex();
        let config = config.stretched(frames.first().map_or(0, |f| f.camera.width));
        let (static_gaussians, dynamic_gaussians) = (
            TrainableCloud::new(&scene.static_gaussians, &device),
            TrainableCloud::new(&scene.dynamic_gaussians, &device),
        );
        Self {
            stage,
            rolled_means: Vec::new(),
            states: FrameStates::default(),
            is_loose: freely_tuned(&scene, &device),
            scene,
            frames,
            config,
            seed,
            step: 0,
            static_gaussians,
            dynamic_gaussians,
            device,
        }
    }

    fn roll(&mut self) {
        let _span = tracing::trace_span!("roll the motion").entered();
        let scene = self.scene();
        self.states = FrameStates::roll(&scene, self.frames);
        self.rolled_means = scene.dynamic_gaussians.means;
    }

    /// Moving Gaussians in a state of the motion, with gradients to what they were at t = 0.
    fn moved(&self, dynamic_gaussians: CloudTensors, state: &SceneState, device: &Device) -> CloudTensors {
        let matrices: Vec<f32> =
            state.rotation.iter().flat_map(|&q| linear::matrix_from_quat(q)).flatten().collect();
        let matrices = Tensor::<3>::from_data(TensorData::new(matrices, [state.len(), 3, 3]), device);
        let change = dynamic_gaussians.means.clone() - rows(&self.rolled_means, device);
        let turned = (matrices * change.reshape([state.len(), 1, 3])).sum_dim(2).reshape([state.len(), 3]);
        CloudTensors {
            means: rows(&state.q, device) + turned,
            rotations: quat_mul(&rows(&state.rotation, device), &dynamic_gaussians.rotations),
            ..dynamic_gaussians
        }
    }
}

impl Tuning for TuneGaussians<'_> {
    fn stage(&self) -> Stage {
        self.stage
    }

    fn steps(&self) -> usize {
        self.config.iterations
    }

    fn step_index(&self) -> usize {
        self.step
    }

    fn is_finished(&self) -> bool {
        self.step >= self.config.iterations || self.frames.is_empty() || self.scene.is_empty()
    }

    fn scene(&self) -> LagrangianScene {
        let mut scene = self.scene.clone();
        scene.static_gaussians = self.static_gaussians.cloud(self.scene.static_gaussians.sh_degree);
        scene.dynamic_gaussians = self.dynamic_gaussians.cloud(self.scene.dynamic_gaussians.sh_degree);
        scene
    }

    fn step(&mut self) -> StepReport {
        if self.rolled_means.is_empty() || self.step.is_multiple_of(self.config.refresh_every.max(1)) {
            self.roll();
        }
        let mut rng = stream(self.seed, self.stage.name(), self.step as u64);
        let chosen = rng.random_range(0..self.frames.len());
        let device = self.device.clone().autodiff();
        let (static_gaussians, dynamic_gaussians) =
            (self.static_gaussians.leaves(), self.dynamic_gaussians.leaves());
        let moved = self.moved(dynamic_gaussians.tensors(), self.states.of(chosen), &device);
        let cloud = static_gaussians.tensors().followed_by(&moved);
        let view = View {
            frame: &self.frames[chosen],
            background: self.scene.background,
            ssim_weight: self.config.ssim_weight,
            device: &device,
        };
        let (loss, error) = frame_loss(cloud, self.scene.dynamic_gaussians.sh_degree, &view);
        let gradients = tracing::trace_span!("backward").in_scope(|| loss.backward());
        let rate = cosine(self.step, self.config.iterations);
        self.static_gaussians.descend(
            &static_gaussians,
            static_gaussians.means.grad(&gradients),
            &gradients,
            &self.config,
            rate,
        );
        let of_means =
            dynamic_gaussians.means.grad(&gradients).map(|gradient| gradient * self.is_loose.clone());
        self.dynamic_gaussians.descend(&dynamic_gaussians, of_means, &gradients, &self.config, rate);
        self.step += 1;
        StepReport { loss: values(&loss.inner())[0], psnr: psnr_of(error) }
    }

    fn checkpoint(&self) -> TensorFile {
        let mut file = scene_to_tensors(&self.scene(), CHECKPOINT_FORMAT);
        self.static_gaussians.save(&mut file, "tune.static");
        self.dynamic_gaussians.save(&mut file, "tune.dynamic");
        file.insert("tune.rolled_means", &[self.rolled_means.len(), 3], self.rolled_means.as_flattened());
        file
    }

    fn restore(&mut self, file: &TensorFile, step: usize) -> Result<(), TensorFileError> {
        self.static_gaussians =
            TrainableCloud::restore(file, "tune.static", &self.scene.static_gaussians, &self.device)?;
        self.dynamic_gaussians =
            TrainableCloud::restore(file, "tune.dynamic", &self.scene.dynamic_gaussians, &self.device)?;
        let means: Vec<[f32; 3]> = file.rows("tune.rolled_means")?;
        if means.len() == self.scene.dynamic_gaussians.len() && !means.is_empty() {
            let mut rolled = self.scene();
            rolled.dynamic_gaussians.means.copy_from_slice(&means);
            self.states = FrameStates::roll(&rolled, self.frames);
            self.rolled_means = means;
        }
        self.step = step;
        Ok(())
    }
}

/// `[n, 1]`: zero for the moving Gaussians that hold an object rigid as the common support of all its
/// particles, one for the others.
fn freely_tuned(scene: &LagrangianScene, device: &Device) -> Tensor<2> {
    let mut loose = vec![1.0_f32; scene.dynamic_gaussians.len()];
    for object in &scene.objects {
        for &anchor in object.supports.as_ref().and_then(Supports::common).into_iter().flatten() {
            loose[object.members.start + anchor as usize] = 0.0;
        }
    }
    Tensor::from_data(TensorData::new(loose, [scene.dynamic_gaussians.len(), 1]), device)
}

/// States of a motion by training frame.
#[derive(Default)]
struct FrameStates {
    /// One per distinct time.
    states: Vec<SceneState>,
    /// Which of them a frame is drawn in.
    of_frame: Vec<usize>,
}

impl FrameStates {
    fn roll(scene: &LagrangianScene, frames: &[Frame]) -> Self {
        let mut motion = Motion::new(scene, Edit::default(), Reversal::Exact);
        let mut times: Vec<f32> = frames.iter().map(|f| f.time).collect();
        times.sort_by(f32::total_cmp);
        times.dedup();
        let of_frame = frames.iter().map(|f| times.partition_point(|&t| t < f.time)).collect();
        Self { states: times.into_iter().map(|t| motion.state_at(t)).collect(), of_frame }
    }

    fn of(&self, frame: usize) -> &SceneState {
        &self.states[self.of_frame[frame]]
    }
}
