//! The motion of a scene at the times of the training frames, kept on the device until it is rolled anew.
//!
//! The motion itself is rolled on the processor by [`Motion`], as everywhere; a state is handed to the device
//! once, when a frame of its time is first drawn.

use std::collections::BTreeMap;

use burn::tensor::{Device, Tensor, TensorData};
use lgs_core::linear::{matrix_from_quat, quat_mul, quat_normalize};
use lgs_dynamics::RolloutSpec;
use lgs_model::{LagrangianScene, Motion, SceneState};

use crate::cloud_tensors::rows;

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
    /// Rotations since t = 0 as quaternions `[n, 4]`.
    pub(super) turns: Tensor<2>,
    /// The same as matrices `[n, 3, 3]`.
    pub(super) matrices: Tensor<3>,
    /// Quaternions of the Gaussians `[n, 4]`.
    pub(super) rotations: Tensor<2>,
}

impl FrameStates {
    /// The motion of a scene as it is, for use on a device.
    pub(super) fn new(scene: LagrangianScene, device: &Device) -> Self {
        Self { motion: Motion::owned(scene), on_device: BTreeMap::new(), device: device.clone() }
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
            StateTensors::new(&state, &motion.scene().dynamic_gaussians.rotations, device)
        });
        state.clone()
    }
}

impl StateTensors {
    fn new(state: &SceneState, at_start: &[[f32; 4]], device: &Device) -> Self {
        let n = state.len();
        let matrices: Vec<f32> = state.rotation.iter().flat_map(|&q| matrix_from_quat(q)).flatten().collect();
        let rotations: Vec<[f32; 4]> =
            state.rotation.iter().zip(at_start).map(|(&r, &r0)| quat_mul(r, quat_normalize(r0))).collect();
        Self {
            means: rows(&state.q, device),
            turns: rows(&state.rotation, device),
            matrices: Tensor::from_data(TensorData::new(matrices, [n, 3, 3]), device),
            rotations: rows(&rotations, device),
        }
    }
}
