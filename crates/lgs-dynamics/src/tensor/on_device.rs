//! Rollouts of slices on any device.

use burn::tensor::{Device, Tensor, TensorData};
use lgs_core::linear::quat_mul;
use rayon::prelude::*;

use super::{RolloutCall, ops};
use crate::rollout;
use crate::state::State;
use crate::system::System;

/// The processor as a device: where rollouts need no tensors.
#[must_use]
pub fn processor() -> Device {
    Device::flex()
}

impl State {
    /// The states that a system with these parameters brings this one to, itself among them: those of
    /// [`crate::rollout`], rolled on a device and read back once.
    ///
    /// # Panics
    /// If the parameters are not those of the system, the supports not those of as many particles, or the
    /// device fails.
    #[must_use]
    pub fn rolled_on(&self, device: &Device, params: &[f32], call: RolloutCall) -> Vec<Self> {
        if *device == processor() || self.is_empty() {
            let system = System { config: call.config, params: params.to_vec() };
            return rollout(&system, self, &call.spec());
        }
        let params = Tensor::from_data(params, device);
        let states = ops::rollout(params, points(&self.q, device), points(&self.v, device), call);
        let values = states.into_data().try_into_vec::<f32>().expect("states are in single precision");
        let rows = values.as_chunks::<10>().0;
        rows.par_chunks(self.len()).map(|rows| self.after(rows)).collect()
    }

    /// The state that begins with this one's rotations and has gone on to rows of position, velocity and
    /// rotation since.
    fn after(&self, rows: &[[f32; 10]]) -> Self {
        let turned =
            |(row, &before): (&[f32; 10], &[f32; 4])| quat_mul([row[6], row[7], row[8], row[9]], before);
        Self {
            q: rows.iter().map(|row| [row[0], row[1], row[2]]).collect(),
            v: rows.iter().map(|row| [row[3], row[4], row[5]]).collect(),
            rotation: rows.iter().zip(&self.rotation).map(turned).collect(),
        }
    }
}

/// Points as a tensor `[n, 3]`.
fn points(points: &[[f32; 3]], device: &Device) -> Tensor<2> {
    Tensor::from_data(TensorData::new(points.as_flattened().to_vec(), [points.len(), 3]), device)
}
