//! The motion of a scene at the times of the training frames, kept on the device until it is rolled anew.
//!
//! The motion itself is rolled by [`Motion`], as everywhere, particles on the device; a state is handed to it
//! once, when a frame of its time is first drawn.

use std::collections::BTreeMap;

use burn::tensor::{Device, Tensor, TensorData};
use lgs_core::TurnedHarmonics;
use lgs_core::linear::{Mat3, matrix_from_quat, quat_conjugate, quat_mul, quat_normalize, sub};
use lgs_dynamics::RolloutSpec;
use lgs_model::{LagrangianScene, Motion, SceneState};

use crate::cloud_tensors::rows;
use crate::turned_colors::TurnedColors;

/// A kept motion.
pub(super) struct FrameStates {
    motion: Motion<'static>,
    /// By the bits of the time.
    on_device: BTreeMap<u32, StateTensors>,
    device: Device,
}

/// The dynamic Gaussians at a time.
#[derive(Clone)]
pub(super) struct StateTensors {
    /// Positions `[n, 3]`, world units.
    pub(super) means: Tensor<2>,
    /// Rotations of the Gaussians since t = 0 as quaternions `[n, 4]`.
    pub(super) turns: Tensor<2>,
    /// The linear maps of small offsets since t = 0 `[n, 3, 3]`.
    pub(super) matrices: Tensor<3>,
    /// Quaternions of the Gaussians `[n, 4]`.
    pub(super) rotations: Tensor<2>,
    /// By how much their log-scales have grown since t = 0 `[n, 3]`.
    pub(super) growth: Tensor<2>,
    /// How their harmonics have turned since t = 0.
    pub(super) colors: TurnedColors,
}

impl FrameStates {
    /// The motion of a scene as it is, for use on a device.
    pub(super) fn new(scene: LagrangianScene, device: &Device) -> Self {
        Self { motion: Motion::owned(scene).on(device), on_device: BTreeMap::new(), device: device.clone() }
    }

    /// The scene that the motion was rolled from.
    pub(super) fn scene(&self) -> &LagrangianScene {
        self.motion.scene()
    }

    /// The state after a number of full steps, at most at the end of the captured window.
    pub(super) fn after(&mut self, steps: usize) -> SceneState {
        let motion = self.scene().motion;
        let steps = steps.min(RolloutSpec::until(motion.time_window, motion.dt).steps);
        self.motion.states(steps)[steps].clone()
    }

    /// The dynamic Gaussians at a time.
    pub(super) fn at(&mut self, time: f32) -> StateTensors {
        let Self { motion, on_device, device } = self;
        let state = on_device.entry(time.to_bits()).or_insert_with(|| {
            let _span = tracing::trace_span!("roll the motion").entered();
            let state = motion.state_at(time);
            StateTensors::new(&state, motion.scene(), device)
        });
        state.clone()
    }
}

impl StateTensors {
    fn new(state: &SceneState, scene: &LagrangianScene, device: &Device) -> Self {
        let (n, at_start) = (state.len(), &scene.dynamic_gaussians);
        let (rotations, log_scales) = scene.shapes_at(state);
        let mut turns = state.rotation.clone();
        let mut matrices: Vec<Mat3> = turns.iter().map(|&turn| matrix_from_quat(turn)).collect();
        for object in scene.objects.iter().filter(|object| object.deforms()) {
            let members = &object.members;
            let linear = scene.linear_map(members, state).transpose().to_cols_array_2d();
            matrices[members.clone()].fill(linear.map(|row| row.map(|x| x as f32)));
            for row in members.clone() {
                turns[row] =
                    quat_mul(rotations[row], quat_conjugate(quat_normalize(at_start.rotations[row])));
            }
        }
        let grown = |(now, before): (&[f32; 3], &[f32; 3])| sub(*now, *before);
        let growth: Vec<[f32; 3]> = log_scales.iter().zip(&at_start.log_scales).map(grown).collect();
        let matrices: Vec<f32> = matrices.into_iter().flatten().flatten().collect();
        Self {
            means: rows(&state.q, device),
            turns: rows(&turns, device),
            matrices: Tensor::from_data(TensorData::new(matrices, [n, 3, 3]), device),
            rotations: rows(&rotations, device),
            growth: rows(&growth, device),
            colors: colors(state, scene, device),
        }
    }
}

/// How the harmonics of bodies have turned since t = 0.
fn colors(state: &SceneState, scene: &LagrangianScene, device: &Device) -> TurnedColors {
    let turned = |turn| TurnedHarmonics::new(turn, scene.dynamic_gaussians.sh_degree);
    let bodies = scene.turned_bodies(state).into_iter();
    TurnedColors::new(bodies.map(|(rows, turn)| (rows, turned(turn))), device)
}
