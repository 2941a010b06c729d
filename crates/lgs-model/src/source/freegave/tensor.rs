//! FreeGave's networks as a Burn operation, differentiable by their parameters and by the Gaussians that they
//! move.

use std::sync::Arc;

use burn::backend::tensor::FloatTensor;
use burn::backend::{Backend, Dispatch, Flex, backend_extension};
use burn::tensor::Tensor;
use lgs_tensor::Kernel;
use lgs_tensor::flex::{floats, rows, tensor, tensor_of_rows};

use super::config::FreeGaveConfig;
use super::input::{Advection, AdvectionInput};
use super::network::{Kept, carry as carry_rows, carry_kept, carry_vjp};
use crate::source::input::InputFrame;

/// The constants of a call.
#[derive(Clone, Debug)]
pub struct AdvectionSpec {
    /// Sizes.
    pub config: Arc<FreeGaveConfig>,
    /// The map of positions before encoding.
    pub frame: InputFrame,
    /// The times.
    pub advection: Advection,
}

/// Backends that can run the networks: kernels from parameters `[P]`, centres `[n, 3]` and quaternions
/// `[n, 4]` to pose rows `[n, DELTAS]`.
pub trait FreeGaveKernels: Kernel<AdvectionSpec, 3> {}

impl<B: Kernel<AdvectionSpec, 3>> FreeGaveKernels for B {}

/// The operation on backends with and without gradients.
#[backend_extension(Autodiff, Flex, Cube: cfg(feature = "gpu"))]
pub trait FreeGaveOps: Backend {
    /// Pose rows `[n, DELTAS]` from parameters `[P]`, centres `[n, 3]` and quaternions `[n, 4]`.
    fn carry(
        params: FloatTensor<Self>,
        means: FloatTensor<Self>,
        rotations: FloatTensor<Self>,
        spec: AdvectionSpec,
    ) -> FloatTensor<Self>;
}

fn input<'a>(inputs: &'a [FloatTensor<Flex>; 3], spec: &'a AdvectionSpec) -> AdvectionInput<'a> {
    let [params, means, rotations] = inputs;
    AdvectionInput {
        config: &spec.config,
        frame: spec.frame,
        params: floats(params),
        means: rows(means),
        rotations: rows(rotations),
        advection: spec.advection,
    }
}

impl Kernel<AdvectionSpec, 3> for Flex {
    type Kept = ([FloatTensor<Self>; 3], Arc<Kept>);

    fn forward(spec: &AdvectionSpec, inputs: [FloatTensor<Self>; 3]) -> FloatTensor<Self> {
        let _span = tracing::trace_span!("deformation network").entered();
        let inputs = inputs.map(|t| t.to_contiguous());
        tensor_of_rows(carry_rows(input(&inputs, spec)))
    }

    fn forward_kept(spec: &AdvectionSpec, inputs: [FloatTensor<Self>; 3]) -> (FloatTensor<Self>, Self::Kept) {
        let _span = tracing::trace_span!("deformation network").entered();
        let inputs = inputs.map(|t| t.to_contiguous());
        let (poses, kept) = carry_kept(input(&inputs, spec));
        (tensor_of_rows(poses), (inputs, Arc::new(kept)))
    }

    fn vjp(
        spec: &AdvectionSpec,
        (inputs, kept): Self::Kept,
        v_poses: FloatTensor<Self>,
    ) -> [FloatTensor<Self>; 3] {
        let _span = tracing::trace_span!("deformation network, backward").entered();
        let v = carry_vjp(input(&inputs, spec), &kept, rows(&v_poses.to_contiguous()));
        let len = v.params.len();
        [tensor(v.params, [len]), tensor_of_rows(v.means), tensor_of_rows(v.rotations)]
    }
}

#[cfg(feature = "gpu")]
impl lgs_tensor::cube::OnProcessor for AdvectionSpec {
    const OPERATION: &'static str = "networks of FreeGave";
}

lgs_tensor::operations! {
    FreeGaveOps of FreeGaveKernels;
    carry(params, means, rotations; spec: AdvectionSpec);
}

/// Pose rows `[n, DELTAS]` of Gaussians with centres `[n, 3]` and quaternions `[n, 4]`, from parameters
/// `[P]`; differentiable by all three in the way of [`super::network`].
#[must_use]
pub fn carry(params: Tensor<1>, means: Tensor<2>, rotations: Tensor<2>, spec: AdvectionSpec) -> Tensor<2> {
    let out = <Dispatch as FreeGaveOps>::carry(
        params.into_dispatch(),
        means.into_dispatch(),
        rotations.into_dispatch(),
        spec,
    );
    Tensor::from_dispatch(out)
}
