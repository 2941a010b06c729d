//! Accelerations, rollouts and alignment as differentiable Burn operations.
//!
//! A tensor on an autodiff device gets one graph node per call, whose backward pass is the crate's own on
//! slices; nothing of the networks' activations stays on the tape. A node has one output, so states and
//! alignments leave packed.

#[cfg(feature = "gpu")]
mod cube;
mod flex;
mod on_device;
mod ops;

use crate::state::{Edit, RolloutSpec, VelocityPolicy};
use crate::supports::Supports;
use crate::system::SystemConfig;
use burn::tensor::Tensor;
use std::sync::Arc;

pub use on_device::processor;
pub use ops::{AccelerationCall, AlignCall, DynamicsKernels, DynamicsOps, rollout};

/// The constants of a rollout; the fields are those of [`crate::RolloutSpec`] and [`crate::System`].
#[derive(Clone, Debug)]
pub struct RolloutCall {
    /// Kinds, sizes and normalisation of the system.
    pub config: SystemConfig,
    /// Length of a step.
    pub dt: f32,
    /// Number of full steps.
    pub steps: usize,
    /// Length of one more, shorter step.
    pub last_dt: Option<f32>,
    /// Manipulations.
    pub edit: Edit,
    /// Supports of the local rigid alignment.
    pub supports: Option<Arc<Supports>>,
    /// Treatment of velocities at an alignment.
    pub velocity_policy: VelocityPolicy,
}

impl RolloutCall {
    /// The same for functions on slices.
    #[must_use]
    pub fn spec(&self) -> RolloutSpec<'_> {
        RolloutSpec {
            dt: self.dt,
            steps: self.steps,
            last_dt: self.last_dt,
            edit: self.edit,
            supports: self.supports.as_deref(),
            velocity_policy: self.velocity_policy,
        }
    }
}

/// Accelerations `[n, 3]` for parameters `[p]`, positions and velocities `[n, 3]`; differentiable by all
/// three.
///
/// # Panics
/// If the shapes do not fit the system.
#[must_use]
pub fn acceleration(
    config: SystemConfig,
    edit: Edit,
    params: Tensor<1>,
    q: Tensor<2>,
    v: Tensor<2>,
) -> Tensor<2> {
    ops::acceleration(params, q, v, AccelerationCall { config, edit })
}

/// Aligned positions `[n, 3]` and rotation matrices `[n, 3, 3]`; differentiable by both tensors.
///
/// # Panics
/// If the shapes do not fit the supports.
#[must_use]
pub fn align(position: Tensor<2>, candidate: Tensor<2>, supports: Arc<Supports>) -> (Tensor<2>, Tensor<3>) {
    let n = supports.particles();
    let packed = ops::align(position, candidate, AlignCall { supports });
    (packed.clone().slice([0..n, 0..3]), packed.slice([0..n, 3..12]).reshape([n, 3, 3]))
}
