//! The kernels' calls and the operations.

use super::RolloutCall;
use crate::state::Edit;
use crate::supports::Supports;
use crate::system::SystemConfig;
use std::sync::Arc;

/// The constants of a call of accelerations.
#[derive(Clone, Debug)]
pub struct AccelerationCall {
    /// Kinds, sizes and normalisation of the system.
    pub config: SystemConfig,
    /// Manipulations.
    pub edit: Edit,
}

/// The constants of a call of the alignment.
#[derive(Clone, Debug)]
pub struct AlignCall {
    /// Supports of the local rigid alignment.
    pub supports: Arc<Supports>,
}

lgs_tensor::calls! {
    AccelerationCall: "accelerations";
    RolloutCall: "rollout";
    AlignCall: "alignment";
}

lgs_tensor::operations! {
    /// Backends that can run systems: kernels of accelerations and rollouts (parameters `[p]`, positions and
    /// velocities `[n, 3]`) and of the alignment (positions and candidates `[n, 3]`).
    pub trait DynamicsKernels;

    /// The operations on backends with and without gradients.
    pub trait DynamicsOps;

    /// Accelerations `[n, 3]`.
    pub(super) fn acceleration(params: 1, q: 2, v: 2; call: AccelerationCall) -> 2;

    /// States `[states, n, 10]` (position, velocity, rotation quaternion) of a rollout from rotation
    /// identity; differentiable by all tensors.
    ///
    /// # Panics
    /// If the shapes do not fit the system or the supports.
    pub fn rollout(params: 1, q0: 2, v0: 2; call: RolloutCall) -> 3;

    /// Aligned positions and rotation matrices `[n, 3 + 9]`.
    pub(super) fn align(position: 2, candidate: 2; call: AlignCall) -> 2;
}
