//! Stage 2: photometric tuning of U, Q and the initial velocity, with the Gaussians fixed.
//!
//! A step draws a few training frames, rolls every object once up to the latest of them, takes a shortened step to each frame's own time
//! (G9), renders all Gaussians (G24) and descends the photometric loss. With truncation (G26) the rollout starts, without gradient, from
//! the current motion's state `window_steps` before the earliest frame, so that memory does not grow with the length of the video.

use std::sync::Arc;

use burn::tensor::{Device, Tensor};
use lgs_core::stream;
use lgs_data::dataset::Frame;
use lgs_dynamics::tensor::{RolloutCall, rollout};
use lgs_dynamics::{Edit, Reversal, RolloutSpec, Supports};
use lgs_model::{LagrangianScene, Motion, ObjectModel, TensorFile, TensorFileError};
use rand::RngExt;

use super::config::{InitialVelocity, TuneDynamicsConfig};
use super::mover_tensors::{CloudTensors, quat_mul, rows};
use super::{StepReport, View, cosine, frame_loss, psnr_of};
use crate::adam::{AdamGroup, values};

/// Stage 2 of a run.
pub struct TuneDynamics<'a> {
    scene: LagrangianScene,
    frames: &'a [Frame],
    config: &'a TuneDynamicsConfig,
    seed: u64,
    step: usize,
    objects: Vec<TrainableObject>,
    device: Device,
}

/// One object's trainable tensors.
struct TrainableObject {
    network: AdamGroup<1>,
    /// `[6, 1]` twist (linear, angular about the centre) or `[n, 3]` change of every velocity, on top of `base_velocity`.
    velocity: AdamGroup<2>,
    base_velocity: Tensor<2>,
    /// `[3 n, 6]`, velocities from a twist; none if every velocity is free.
    twist_basis: Option<Tensor<2>>,
    rms_speed: f32,
    supports: Option<Arc<Supports>>,
}

/// One object's leaves in a step's graph, and what became of them.
struct ObjectPath {
    network: Tensor<1>,
    velocity: Tensor<2>,
    /// States `[steps + 1, n, 10]`: position, velocity, rotation since the window's start.
    states: Tensor<3>,
    /// Rotation up to the window's start, `[n, 4]`.
    start_rotation: Tensor<2>,
}

impl<'a> TuneDynamics<'a> {
    /// Stage 2 from its first step. `frames` are the training frames.
    #[must_use]
    pub fn new(scene: LagrangianScene, frames: &'a [Frame], config: &'a TuneDynamicsConfig, seed: u64) -> Self {
        let device = Device::flex();
        let objects = scene.objects.iter().map(|o| TrainableObject::new(o, &scene, config.initial_velocity, &device)).collect();
        Self { scene, frames, config, seed, step: 0, objects, device }
    }

    /// Steps done.
    #[must_use]
    pub fn step_index(&self) -> usize {
        self.step
    }

    /// Whether all steps are done; so they are where nothing moves.
    #[must_use]
    pub fn is_finished(&self) -> bool {
        self.step >= self.config.iterations || self.objects.is_empty() || self.frames.is_empty()
    }

    /// The scene with what has been learned so far.
    #[must_use]
    pub fn scene(&self) -> LagrangianScene {
        let mut scene = self.scene.clone();
        for (object, trained) in scene.objects.iter_mut().zip(&self.objects) {
            object.system.params = trained.network.values();
            let velocity = values(&trained.velocity_from(trained.velocity.leaf()).inner());
            scene.velocities[object.members.clone()].copy_from_slice(velocity.as_chunks().0);
        }
        scene
    }

    /// One optimiser step.
    pub fn step(&mut self) -> StepReport {
        let mut rng = stream(self.seed, "tune-dynamics", self.step as u64);
        let chosen: Vec<&Frame> = (0..self.config.frames_per_step.max(1)).map(|_| &self.frames[rng.random_range(0..self.frames.len())]).collect();
        let window = self.window(&chosen);
        let device = self.device.clone().autodiff();
        let paths = self.roll(&window, &device);
        let statics = CloudTensors::new(&self.scene.statics, &device);
        let movers = CloudTensors::new(&self.scene.movers, &device);
        let losses = chosen.iter().filter(|f| window.contains(f.time)).map(|frame| {
            let moved = self.movers_at(&movers, &paths, &window, frame.time);
            let view = View { frame, background: self.scene.background, ssim_weight: self.config.ssim_weight, device: &device };
            frame_loss(statics.followed_by(&moved), self.scene.movers.sh_degree, &view)
        });
        let (losses, errors): (Vec<Tensor<1>>, Vec<f64>) = losses.unzip();
        let count = losses.len() as f32;
        let psnr = psnr_of(errors.iter().sum::<f64>() / f64::from(count));
        let loss = Tensor::cat(losses, 0).sum().div_scalar(count);
        let gradients = loss.backward();
        let rate = cosine(self.step, self.config.iterations);
        for (object, path) in self.objects.iter_mut().zip(&paths) {
            object.network.step(self.config.learning_rate * rate, path.network.grad(&gradients));
            let velocity_rate = self.config.velocity_learning_rate * f64::from(object.rms_speed) * rate;
            object.velocity.step(velocity_rate, path.velocity.grad(&gradients));
        }
        self.step += 1;
        StepReport { loss: values(&loss.inner())[0], psnr }
    }

    /// The steps to roll: from the window's start (0, or `window_steps` before the latest frame) to the latest frame.
    fn window(&self, frames: &[&Frame]) -> Window {
        let dt = self.scene.motion.dt;
        let last = frames.iter().map(|f| RolloutSpec::until(f.time.max(0.0), dt).steps).max().unwrap_or(0);
        let truncate = self.config.window_steps > 0 && !self.step.is_multiple_of(self.config.full_window_every.max(1));
        let first = if truncate { last.saturating_sub(self.config.window_steps) } else { 0 };
        Window { first, steps: last - first, dt }
    }

    /// Rolls every object over the window.
    fn roll(&self, window: &Window, device: &Device) -> Vec<ObjectPath> {
        let start = (window.first > 0).then(|| {
            let scene = self.scene();
            Motion::new(&scene, Edit::default(), Reversal::Exact).state_at(window.first as f32 * window.dt)
        });
        let roll_object = |(object, trained): (&ObjectModel, &TrainableObject)| {
            let (network, velocity) = (trained.network.leaf(), trained.velocity.leaf());
            let members = object.members.clone();
            let (q, v, rotation) = match &start {
                Some(state) => (
                    rows(&state.q[members.clone()], device),
                    rows(&state.v[members.clone()], device),
                    rows(&state.rotation[members], device),
                ),
                None => {
                    let identity = vec![[1.0, 0.0, 0.0, 0.0]; members.len()];
                    (rows(&self.scene.movers.means[members], device), trained.velocity_from(velocity.clone()), rows(&identity, device))
                }
            };
            let states = rollout(network.clone(), q, v, trained.call(object, window.dt, window.steps));
            ObjectPath { network, velocity, states, start_rotation: rotation }
        };
        self.scene.objects.iter().zip(&self.objects).map(roll_object).collect()
    }

    /// The moving Gaussians at a frame's time.
    fn movers_at(&self, movers: &CloudTensors, paths: &[ObjectPath], window: &Window, time: f32) -> CloudTensors {
        let until = RolloutSpec::until(time.max(0.0), window.dt);
        let (mut means, mut rotations) = (Vec::new(), Vec::new());
        for ((object, trained), path) in self.scene.objects.iter().zip(&self.objects).zip(paths) {
            let n = object.members.len();
            let mut state = path.states.clone().narrow(0, until.steps - window.first, 1).reshape([n, 10]);
            let mut rotation = quat_mul(&state.clone().narrow(1, 6, 4), &path.start_rotation);
            if let Some(rest) = until.last_dt {
                let (q, v) = (state.clone().narrow(1, 0, 3), state.narrow(1, 3, 3));
                let states = rollout(path.network.clone(), q, v, trained.call(object, rest, 1));
                state = states.narrow(0, 1, 1).reshape([n, 10]);
                rotation = quat_mul(&state.clone().narrow(1, 6, 4), &rotation);
            }
            let at_start = movers.rotations.clone().narrow(0, object.members.start, n);
            means.push(state.narrow(1, 0, 3));
            rotations.push(quat_mul(&rotation, &at_start));
        }
        CloudTensors { means: Tensor::cat(means, 0), rotations: Tensor::cat(rotations, 0), ..movers.clone() }
    }

    /// Stores what a resumed run needs beside [`Self::scene_at_start`].
    pub fn save(&self, file: &mut TensorFile) {
        for (index, object) in self.objects.iter().enumerate() {
            object.network.insert_into(file, &format!("tune.{index}.network"));
            object.velocity.insert_into(file, &format!("tune.{index}.velocity"));
        }
    }

    /// The scene that the stage started from; velocities are relative to it.
    #[must_use]
    pub fn scene_at_start(&self) -> &LagrangianScene {
        &self.scene
    }

    /// Continues from a checkpoint of `step` steps.
    ///
    /// # Errors
    /// If a tensor is absent or does not fit the scene.
    pub fn restore(&mut self, file: &TensorFile, step: usize) -> Result<(), TensorFileError> {
        for (index, object) in self.objects.iter_mut().enumerate() {
            let parameters = self.scene.objects[index].system.params.len();
            object.network = AdamGroup::read_from(file, &format!("tune.{index}.network"), [Some(parameters)], &self.device)?;
            let shape = object.velocity_shape().map(Some);
            object.velocity = AdamGroup::read_from(file, &format!("tune.{index}.velocity"), shape, &self.device)?;
        }
        self.step = step;
        Ok(())
    }
}

/// Steps that are rolled with gradients.
struct Window {
    first: usize,
    steps: usize,
    dt: f32,
}

impl Window {
    fn contains(&self, time: f32) -> bool {
        RolloutSpec::until(time.max(0.0), self.dt).steps >= self.first
    }
}

impl TrainableObject {
    fn new(object: &ObjectModel, scene: &LagrangianScene, kind: InitialVelocity, device: &Device) -> Self {
        let velocities = &scene.velocities[object.members.clone()];
        let points = &scene.movers.means[object.members.clone()];
        let mean_square = velocities.iter().flatten().map(|v| v * v).sum::<f32>() / points.len().max(1) as f32;
        let twist_basis = (kind == InitialVelocity::Twist).then(|| twist_basis(points, device));
        let shape = if twist_basis.is_some() { [6, 1] } else { [points.len(), 3] };
        let parameters = object.system.params.clone();
        Self {
            network: AdamGroup::new(parameters, [object.system.params.len()], device),
            velocity: AdamGroup::new(vec![0.0; shape[0] * shape[1]], shape, device),
            base_velocity: rows(velocities, device),
            twist_basis,
            rms_speed: mean_square.sqrt(),
            supports: object.supports.clone().map(Arc::new),
        }
    }

    fn call(&self, object: &ObjectModel, dt: f32, steps: usize) -> RolloutCall {
        RolloutCall {
            config: object.system.config,
            dt,
            steps,
            last_dt: None,
            edit: Edit::default(),
            supports: self.supports.clone(),
            velocity_policy: object.velocity_policy,
        }
    }

    fn velocity_shape(&self) -> [usize; 2] {
        if self.twist_basis.is_some() { [6, 1] } else { self.base_velocity.dims() }
    }

    /// Initial velocities `[n, 3]` from a leaf of the trainable part.
    fn velocity_from(&self, change: Tensor<2>) -> Tensor<2> {
        let base = self.base_velocity.clone().autodiff();
        match &self.twist_basis {
            Some(basis) => base + basis.clone().autodiff().matmul(change).reshape(self.base_velocity.dims()),
            None => base + change,
        }
    }
}

/// `[3 n, 6]`: row 3j + i gives component i of particle j's velocity from a twist (u, ω) about the object's centre, u + ω × r.
fn twist_basis(points: &[[f32; 3]], device: &Device) -> Tensor<2> {
    let n = points.len().max(1) as f32;
    let center: [f32; 3] = std::array::from_fn(|i| points.iter().map(|p| p[i]).sum::<f32>() / n);
    let mut basis = Vec::with_capacity(3 * points.len());
    for p in points {
        let [x, y, z] = std::array::from_fn(|i| p[i] - center[i]);
        basis.push([1.0, 0.0, 0.0, 0.0, z, -y]);
        basis.push([0.0, 1.0, 0.0, -z, 0.0, x]);
        basis.push([0.0, 0.0, 1.0, y, -x, 0.0]);
    }
    rows(&basis, device)
}
