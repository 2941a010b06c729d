//! The backend extension: the kernels' calls and the operations.

use super::RolloutCall;
use crate::state::Edit;
use crate::supports::Supports;
use crate::system::SystemConfig;
use burn::backend::tensor::FloatTensor;
use burn::backend::{Backend, backend_extension};
use lgs_tensor::Kernel;
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

/// Backends that can run systems: kernels of accelerations and rollouts (parameters `[p]`, positions and
/// velocities `[n, 3]`) and of the alignment (positions and candidates `[n, 3]`).
pub trait DynamicsKernels:
    Kernel<AccelerationCall, 3> + Kernel<RolloutCall, 3> + Kernel<AlignCall, 2>
{
}

impl<B> DynamicsKernels for B where
    B: Kernel<AccelerationCall, 3> + Kernel<RolloutCall, 3> + Kernel<AlignCall, 2>
{
}

/// The operations on backends with and without gradients.
#[backend_extension(Autodiff, Flex, Cube: cfg(feature = "gpu"))]
pub trait DynamicsOps: Backend {
    /// Accelerations `[n, 3]`.
    fn acceleration(
        params: FloatTensor<Self>,
        q: FloatTensor<Self>,
        v: FloatTensor<Self>,
        call: AccelerationCall,
    ) -> FloatTensor<Self>;
    /// States `[states, n, 10]`.
    fn rollout(
        params: FloatTensor<Self>,
        q0: FloatTensor<Self>,
        v0: FloatTensor<Self>,
        call: RolloutCall,
    ) -> FloatTensor<Self>;
    /// Aligned positions and rotation matrices `[n, 3 + 9]`.
    fn align(position: FloatTensor<Self>, candidate: FloatTensor<Self>, call: AlignCall)
    -> FloatTensor<Self>;
}

lgs_tensor::operations! {
    DynamicsOps of DynamicsKernels;
    acceleration(params, q, v; call: AccelerationCall);
    rollout(params, q0, v0; call: RolloutCall);
    align(position, candidate; call: AlignCall);
}
