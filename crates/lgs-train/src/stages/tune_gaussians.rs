//! Stage 3: the Gaussians against the images, with the dynamics frozen.
//!
//! The same comes before stage 2: a source model lets Gaussians slip where its motion is not that of the surfaces, and only once
//! they have settled into the distilled motion do the images' residuals speak of what is wrong with it.
//!
//! A step draws one training frame and its state of the current motion. Moving Gaussians are drawn where the rollout put them, displaced by
//! the accumulated rotation times what their means have changed since that rollout (straight-through, G34); the motion is rolled anew
//! from the changed means every so many steps.

use burn::tensor::{Device, Gradients, Tensor, TensorData};
use lgs_core::{GaussianCloud, linear, stream};
use lgs_data::dataset::Frame;
use lgs_dynamics::{Edit, Reversal};
use lgs_model::{LagrangianScene, Motion, SceneState, TensorFile, TensorFileError, scene_to_tensors};
use rand::RngExt;

use super::config::TuneGaussiansConfig;
use super::mover_tensors::{CloudTensors, quat_mul, rows};
use super::{StepReport, Tuning, View, cosine, frame_loss, psnr_of};
use crate::adam::{AdamGroup, values};
use crate::checkpoint::{CHECKPOINT_FORMAT, Stage};

/// Colours' direction-dependent part learns slower by this (reference section 2.6).
const SH_REST_DIVISOR: f64 = 20.0;

/// Stage 3 of a run, or the settling before stage 2.
pub struct TuneGaussians<'a> {
    stage: Stage,
    scene: LagrangianScene,
    frames: &'a [Frame],
    config: TuneGaussiansConfig,
    seed: u64,
    step: usize,
    statics: TrainableCloud,
    movers: TrainableCloud,
    /// Means that the cached states were rolled from.
    rolled_means: Vec<[f32; 3]>,
    /// The motion at every training time; frames of one time share it.
    states: FrameStates,
    device: Device,
}

impl<'a> TuneGaussians<'a> {
    /// The stage of that name from its first step. `frames` are the training frames.
    #[must_use]
    pub fn new(stage: Stage, scene: LagrangianScene, frames: &'a [Frame], config: &TuneGaussiansConfig, seed: u64) -> Self {
        let device = Device::flex();
        let config = config.stretched(frames.first().map_or(0, |f| f.camera.width));
        let (statics, movers) = (TrainableCloud::new(&scene.statics, &device), TrainableCloud::new(&scene.movers, &device));
        Self {
            stage,
            rolled_means: Vec::new(),
            states: FrameStates::default(),
            scene,
            frames,
            config,
            seed,
            step: 0,
            statics,
            movers,
            device,
        }
    }

    fn roll(&mut self) {
        let _span = tracing::trace_span!("roll the motion").entered();
        let scene = self.scene();
        self.states = FrameStates::roll(&scene, self.frames);
        self.rolled_means = scene.movers.means;
    }

    /// Moving Gaussians in a state of the motion, with gradients to what they were at t = 0.
    fn moved(&self, movers: CloudTensors, state: &SceneState, device: &Device) -> CloudTensors {
        let matrices: Vec<f32> = state.rotation.iter().flat_map(|&q| linear::matrix_from_quat(q)).flatten().collect();
        let matrices = Tensor::<3>::from_data(TensorData::new(matrices, [state.len(), 3, 3]), device);
        let change = movers.means.clone() - rows(&self.rolled_means, device);
        let turned = (matrices * change.reshape([state.len(), 1, 3])).sum_dim(2).reshape([state.len(), 3]);
        CloudTensors {
            means: rows(&state.q, device) + turned,
            rotations: quat_mul(&rows(&state.rotation, device), &movers.rotations),
            ..movers
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
        scene.statics = self.statics.cloud(self.scene.statics.sh_degree);
        scene.movers = self.movers.cloud(self.scene.movers.sh_degree);
        scene
    }

    fn step(&mut self) -> StepReport {
        if self.rolled_means.is_empty() || self.step.is_multiple_of(self.config.refresh_every.max(1)) {
            self.roll();
        }
        let mut rng = stream(self.seed, self.stage.name(), self.step as u64);
        let chosen = rng.random_range(0..self.frames.len());
        let device = self.device.clone().autodiff();
        let (statics, movers) = (self.statics.leaves(), self.movers.leaves());
        let moved = self.moved(movers.tensors(), self.states.of(chosen), &device);
        let cloud = statics.tensors().followed_by(&moved);
        let view =
            View { frame: &self.frames[chosen], background: self.scene.background, ssim_weight: self.config.ssim_weight, device: &device };
        let (loss, error) = frame_loss(cloud, self.scene.movers.sh_degree, &view);
        let gradients = tracing::trace_span!("backward").in_scope(|| loss.backward());
        let rate = cosine(self.step, self.config.iterations);
        for (cloud, leaves) in [(&mut self.statics, &statics), (&mut self.movers, &movers)] {
            cloud.descend(leaves, &gradients, &self.config, rate);
        }
        self.step += 1;
        StepReport { loss: values(&loss.inner())[0], psnr: psnr_of(error) }
    }

    fn checkpoint(&self) -> TensorFile {
        let mut file = scene_to_tensors(&self.scene(), CHECKPOINT_FORMAT);
        self.statics.save(&mut file, "tune.static");
        self.movers.save(&mut file, "tune.mover");
        file.insert("tune.rolled_means", &[self.rolled_means.len(), 3], self.rolled_means.as_flattened());
        file
    }

    fn restore(&mut self, file: &TensorFile, step: usize) -> Result<(), TensorFileError> {
        self.statics = TrainableCloud::restore(file, "tune.static", &self.scene.statics, &self.device)?;
        self.movers = TrainableCloud::restore(file, "tune.mover", &self.scene.movers, &self.device)?;
        let means: Vec<[f32; 3]> = file.rows("tune.rolled_means")?;
        if means.len() == self.scene.movers.len() && !means.is_empty() {
            let mut rolled = self.scene();
            rolled.movers.means.copy_from_slice(&means);
            self.states = FrameStates::roll(&rolled, self.frames);
            self.rolled_means = means;
        }
        self.step = step;
        Ok(())
    }
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

/// Trainable arrays of a cloud; the constant and the direction-dependent part of the colours apart, as their rates differ.
struct TrainableCloud {
    means: AdamGroup<2>,
    rotations: AdamGroup<2>,
    log_scales: AdamGroup<2>,
    raw_opacities: AdamGroup<1>,
    sh_constant: AdamGroup<2>,
    /// None at degree 0.
    sh_rest: Option<AdamGroup<2>>,
}

/// The leaves of one step's graph.
struct CloudLeaves {
    means: Tensor<2>,
    rotations: Tensor<2>,
    log_scales: Tensor<2>,
    raw_opacities: Tensor<1>,
    sh_constant: Tensor<2>,
    sh_rest: Option<Tensor<2>>,
}

impl CloudLeaves {
    fn tensors(&self) -> CloudTensors {
        let n = self.means.dims()[0];
        let constant = self.sh_constant.clone();
        let sh = match &self.sh_rest {
            Some(rest) => Tensor::cat(vec![constant, rest.clone()], 1),
            None => constant,
        };
        let coefficients = sh.dims()[1] / 3;
        CloudTensors {
            means: self.means.clone(),
            rotations: self.rotations.clone(),
            log_scales: self.log_scales.clone(),
            raw_opacities: self.raw_opacities.clone(),
            sh: sh.reshape([n, coefficients, 3]),
        }
    }
}

impl TrainableCloud {
    fn new(cloud: &GaussianCloud, device: &Device) -> Self {
        let (n, stride) = (cloud.len(), cloud.sh_stride());
        let columns = |from: usize, to: usize| cloud.sh.chunks_exact(stride).flat_map(move |row| row[from..to].iter().copied()).collect();
        Self {
            means: AdamGroup::new(cloud.means.as_flattened().to_vec(), [n, 3], device),
            rotations: AdamGroup::new(cloud.rotations.as_flattened().to_vec(), [n, 4], device),
            log_scales: AdamGroup::new(cloud.log_scales.as_flattened().to_vec(), [n, 3], device),
            raw_opacities: AdamGroup::new(cloud.raw_opacities.clone(), [n], device),
            sh_constant: AdamGroup::new(columns(0, 3), [n, 3], device),
            sh_rest: (stride > 3).then(|| AdamGroup::new(columns(3, stride), [n, stride - 3], device)),
        }
    }

    fn leaves(&self) -> CloudLeaves {
        CloudLeaves {
            means: self.means.leaf(),
            rotations: self.rotations.leaf(),
            log_scales: self.log_scales.leaf(),
            raw_opacities: self.raw_opacities.leaf(),
            sh_constant: self.sh_constant.leaf(),
            sh_rest: self.sh_rest.as_ref().map(AdamGroup::leaf),
        }
    }

    fn cloud(&self, sh_degree: usize) -> GaussianCloud {
        let sh = values(&self.leaves().tensors().sh.inner());
        GaussianCloud {
            means: self.means.values().as_chunks().0.to_vec(),
            rotations: self.rotations.values().as_chunks().0.to_vec(),
            log_scales: self.log_scales.values().as_chunks().0.to_vec(),
            raw_opacities: self.raw_opacities.values(),
            sh,
            sh_degree,
        }
    }

    fn descend(&mut self, leaves: &CloudLeaves, gradients: &Gradients, config: &TuneGaussiansConfig, rate: f64) {
        self.means.step(rate * config.means_learning_rate, leaves.means.grad(gradients));
        self.rotations.step(rate * config.rotations_learning_rate, leaves.rotations.grad(gradients));
        self.log_scales.step(rate * config.scales_learning_rate, leaves.log_scales.grad(gradients));
        self.raw_opacities.step(rate * config.opacities_learning_rate, leaves.raw_opacities.grad(gradients));
        self.sh_constant.step(rate * config.colors_learning_rate, leaves.sh_constant.grad(gradients));
        if let (Some(group), Some(leaf)) = (&mut self.sh_rest, &leaves.sh_rest) {
            group.step(rate * config.colors_learning_rate / SH_REST_DIVISOR, leaf.grad(gradients));
        }
    }

    fn save(&self, file: &mut TensorFile, name: &str) {
        self.means.insert_into(file, &format!("{name}.means"));
        self.rotations.insert_into(file, &format!("{name}.rotations"));
        self.log_scales.insert_into(file, &format!("{name}.log_scales"));
        self.raw_opacities.insert_into(file, &format!("{name}.raw_opacities"));
        self.sh_constant.insert_into(file, &format!("{name}.sh_constant"));
        if let Some(rest) = &self.sh_rest {
            rest.insert_into(file, &format!("{name}.sh_rest"));
        }
    }

    /// Reads what [`Self::save`] wrote for a cloud of the same size and degree as `like`.
    fn restore(file: &TensorFile, name: &str, like: &GaussianCloud, device: &Device) -> Result<Self, TensorFileError> {
        let n = Some(like.len());
        let matrix = |field: &str, width: usize| AdamGroup::read_from(file, &format!("{name}.{field}"), [n, Some(width)], device);
        let rest = like.sh_stride() - 3;
        Ok(Self {
            means: matrix("means", 3)?,
            rotations: matrix("rotations", 4)?,
            log_scales: matrix("log_scales", 3)?,
            raw_opacities: AdamGroup::read_from(file, &format!("{name}.raw_opacities"), [n], device)?,
            sh_constant: matrix("sh_constant", 3)?,
            sh_rest: if rest > 0 { Some(matrix("sh_rest", rest)?) } else { None },
        })
    }
}
