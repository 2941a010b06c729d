//! What is learned of the training cameras: gains, offsets and motions, one row per camera.
//!
//! Motions are in pixels: a rotation about an axis of the camera by as many, and a translation that shifts
//! the middle of the scene by as many, so that one rate suits all of them whatever the lens and the world's
//! scale.

use burn::tensor::{Device, Gradients, Tensor, TensorData};
use lgs_core::optim::log_linear;
use lgs_core::{Camera, Exposure, Gauge};
use lgs_data::dataset::{Dataset, Frame};
use lgs_model::{TensorFile, TensorFileError};

use super::config::{CamerasConfig, Refine};
use super::refined::{RefinedCamera, RefinedCameras};
use crate::adam::AdamGroup;
use crate::view::Sensor;

/// Numbers per camera: of a motion, or of gains and offsets.
const WIDTH: usize = 6;
/// Names in checkpoints.
const POSES: &str = "cameras.poses";
const EXPOSURES: &str = "cameras.exposures";

/// A camera as the dataset gives it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Given {
    pub(super) camera: Camera,
    /// Depth of the middle of the scene, world units.
    pub(super) depth: f32,
}

impl Given {
    /// The motion that a pixel of each of its six numbers is: radians, world units.
    pub(super) fn units(&self) -> [f32; WIDTH] {
        let (turn, shift) = (1.0 / self.camera.fx, self.depth / self.camera.fx);
        [turn, turn, turn, shift, shift, shift]
    }

    /// The same, `[6]`.
    fn units_on(&self, device: &Device) -> Tensor<1> {
        Tensor::from_floats(self.units(), device)
    }
}

/// The refinement of the cameras of a run; nothing is refined where the settings say so.
pub(crate) struct CameraRefinement {
    config: CamerasConfig,
    iterations: usize,
    cameras: Vec<Given>,
    /// Row by the number of a frame's camera.
    rows: Vec<usize>,
    /// Motions `[cameras, 6]`, pixels.
    poses: Option<AdamGroup<2>>,
    /// Gains minus 1, then offsets `[cameras, 6]`.
    exposures: Option<AdamGroup<2>>,
    /// Motions that no image shows, and what tells how much of them is in others, both `[k, 6 cameras]`,
    /// pixels ([`Gauge`]).
    gauge: Option<[Tensor<2>; 2]>,
}

impl CameraRefinement {
    /// The refinement of a dataset's training cameras, nothing corrected yet; the settings are resolved ones.
    pub(crate) fn new(dataset: &Dataset, config: &CamerasConfig, iterations: usize, device: &Device) -> Self {
        let (cameras, rows) = distinct(dataset);
        let n = cameras.len();
        let group = |asked: Refine| {
            (asked == Refine::On && n > 1).then(|| AdamGroup::new(vec![0.0; WIDTH * n], [n, WIDTH], device))
        };
        let poses = group(config.refine_poses);
        let gauge = poses.as_ref().map(|_| gauge_in_pixels(&cameras, dataset.scene_box().center, device));
        let exposures = group(config.refine_exposure);
        Self { config: config.clone(), iterations, cameras, rows, poses, exposures, gauge }
    }

    /// How a frame is seen at an iteration, with what is to be learned of its camera then as leaves.
    pub(crate) fn sensor(&self, frame: &Frame, iteration: usize) -> Sensor {
        let row = self.rows[frame.camera_id];
        let pose = self.poses.as_ref().filter(|_| self.refines_poses(iteration));
        Sensor {
            pose: pose.map(|group| {
                let units = self.cameras[row].units_on(&group.device());
                (row_of(group, row) * units).autodiff().require_grad()
            }),
            exposure: self.exposures.as_ref().map(|group| row_of(group, row).autodiff().require_grad()),
        }
    }

    fn refines_poses(&self, iteration: usize) -> bool {
        iteration as f32 >= self.config.pose_after * self.iterations as f32
    }

    /// The motion of a row, in radians and world units.
    fn motion(&self, poses: &AdamGroup<2>, row: usize) -> [f32; WIDTH] {
        let (pixels, units) = (poses.values(), self.cameras[row].units());
        std::array::from_fn(|i| units[i] * pixels[WIDTH * row + i])
    }

    /// A step of the camera of a frame along the gradients of its leaves.
    pub(crate) fn step(
        &mut self,
        frame: &Frame,
        sensor: &Sensor,
        iteration: usize,
        gradients: &mut Gradients,
    ) {
        let (row, part) = (self.rows[frame.camera_id], iteration as f64 / self.iterations as f64);
        let config = &self.config;
        if let (Some(group), Some(leaf)) = (&mut self.exposures, &sensor.exposure) {
            let rate = log_linear(part, [config.exposure_start, config.exposure_end]);
            let gradient = leaf.grad_remove(gradients);
            descend(group, row, gradient, (rate, config.exposure_weight));
            let mean = group.value().mean_dim(0);
            group.shift(mean.neg());
        }
        if let (Some(group), Some(leaf)) = (&mut self.poses, &sensor.pose) {
            let after = f64::from(config.pose_after);
            let part = (part - after) / (1.0 - after).max(f64::EPSILON);
            let rate = log_linear(part, [config.pose_start, config.pose_end]);
            let units = self.cameras[row].units_on(&group.device());
            let gradient = leaf.grad_remove(gradients).map(|gradient| gradient * units);
            descend(group, row, gradient, (rate, config.pose_weight));
            if let Some([basis, dual]) = &self.gauge {
                let [n, width] = group.value().dims();
                let poses = group.value().reshape([n * width, 1]);
                let along = basis.clone().transpose().matmul(dual.clone().matmul(poses));
                group.shift(along.reshape([n, width]).neg());
            }
        }
    }

    /// What has been found; nothing where nothing is refined.
    pub(crate) fn refined(&self) -> Option<RefinedCameras> {
        let (poses, exposures) = (self.poses.as_ref(), self.exposures.as_ref().map(AdamGroup::values));
        if poses.is_none() && exposures.is_none() {
            return None;
        }
        let camera = |row: usize| {
            let Given { camera, depth } = self.cameras[row];
            let motion = poses.map_or([0.0; WIDTH], |group| self.motion(group, row));
            let exposure = exposures.as_ref().map_or(Exposure::IDENTITY, |values| Exposure {
                gain: std::array::from_fn(|c| 1.0 + values[WIDTH * row + c]),
                offset: std::array::from_fn(|c| values[WIDTH * row + 3 + c]),
            });
            let pixels = camera.displacement(&camera.seeing_moved(motion), depth) as f32;
            RefinedCamera { given: camera.camera_from_world, motion, exposure, pixels }
        };
        Some(RefinedCameras { cameras: (0..self.cameras.len()).map(camera).collect() })
    }

    /// Adds values and moments to a checkpoint.
    pub(crate) fn insert_into(&self, file: &mut TensorFile) {
        for (name, group) in [(POSES, &self.poses), (EXPOSURES, &self.exposures)] {
            if let Some(group) = group {
                group.insert_into(file, name);
            }
        }
    }

    /// Reads what [`Self::insert_into`] wrote.
    ///
    /// # Errors
    /// If something is absent, not finite or of another shape.
    pub(crate) fn restore(&mut self, file: &TensorFile, device: &Device) -> Result<(), TensorFileError> {
        let shape = [Some(self.cameras.len()), Some(WIDTH)];
        for (name, group) in [(POSES, &mut self.poses), (EXPOSURES, &mut self.exposures)] {
            if let Some(group) = group {
                *group = AdamGroup::read_from(file, name, shape, device)?;
            }
        }
        Ok(())
    }
}

/// The gauge of cameras that look at a place, for motions in pixels.
fn gauge_in_pixels(cameras: &[Given], center: [f32; 3], device: &Device) -> [Tensor<2>; 2] {
    let all: Vec<Camera> = cameras.iter().map(|given| given.camera).collect();
    let Gauge { basis, dual } = Gauge::of(&all, center);
    let units: Vec<f64> = cameras.iter().flat_map(|given| given.units().map(f64::from)).collect();
    let rows = |motions: &[Vec<f64>], scaled: fn(f64, f64) -> f64| {
        let values =
            motions.iter().flat_map(|row| row.iter().zip(&units).map(|(v, u)| scaled(*v, *u) as f32));
        let values: Vec<f32> = values.collect();
        Tensor::from_data(TensorData::new(values, [motions.len(), units.len()]), device)
    };
    [rows(&basis, |v, unit| v / unit), rows(&dual, |v, unit| v * unit)]
}

/// A row of a group `[6]`.
fn row_of(group: &AdamGroup<2>, row: usize) -> Tensor<1> {
    group.value().slice([row..row + 1, 0..WIDTH]).reshape([WIDTH])
}

/// One step of Adam with a gradient in one row, and that of the mean squared deviation from no correction.
fn descend(group: &mut AdamGroup<2>, row: usize, gradient: Option<Tensor<1>>, (rate, weight): (f64, f32)) {
    let Some(gradient) = gradient else { return };
    let whole = gradient + row_of(group, row).mul_scalar(2.0 * weight);
    let zeros = group.value().zeros_like();
    let rows = zeros.slice_assign([row..row + 1, 0..WIDTH], whole.reshape([1, WIDTH]));
    group.step(rate, Some(rows));
}

/// The cameras of the training split by pose, and the row of each camera's number.
fn distinct(dataset: &Dataset) -> (Vec<Given>, Vec<usize>) {
    let center = dataset.scene_box().center;
    let mut cameras: Vec<Given> = Vec::new();
    let mut rows = Vec::new();
    for frame in dataset.split("train") {
        if rows.len() <= frame.camera_id {
            rows.resize(frame.camera_id + 1, usize::MAX);
        }
        if rows[frame.camera_id] != usize::MAX {
            continue;
        }
        let camera = frame.camera;
        let pose = camera.camera_from_world;
        let known = cameras.iter().position(|given| given.camera.camera_from_world == pose);
        rows[frame.camera_id] = known.unwrap_or_else(|| {
            let depth = camera.pixel_from_world(center).1.abs().max(camera.near);
            cameras.push(Given { camera, depth });
            cameras.len() - 1
        });
    }
    (cameras, rows)
}
