//! FreeGave's networks as a Burn operation, differentiable by their parameters and by the Gaussians that they
//! move.

use std::sync::Arc;

use burn::backend::autodiff::checkpoint::{base::Checkpointer, strategy::CheckpointStrategy};
use burn::backend::autodiff::grads::Gradients;
use burn::backend::autodiff::ops::{Backward, Ops, OpsKind};
use burn::backend::ops::FloatTensorOps;
use burn::backend::tensor::FloatTensor;
use burn::backend::{Autodiff, Backend, Dispatch, Flex, backend_extension};
use burn::tensor::{Tensor, TensorData};

use super::config::FreeGaveConfig;
use super::network::{Advection, AdvectionInput, Kept, carry as carry_rows, carry_kept, carry_vjp};
use crate::source::network::InputFrame;
use crate::source::pose::DELTAS;

/// What a call needs beside tensors.
#[derive(Clone, Debug)]
pub struct AdvectionSpec {
    /// Sizes.
    pub config: Arc<FreeGaveConfig>,
    /// The map of positions before encoding.
    pub frame: InputFrame,
    /// The times.
    pub advection: Advection,
}

/// Backends that can run the networks forwards.
#[backend_extension(Autodiff, Flex)]
pub trait FreeGaveOps: Backend {
    /// Pose rows `[n, DELTAS]` from parameters `[P]`, centres `[n, 3]` and quaternions `[n, 4]`.
    fn carry(
        params: FloatTensor<Self>,
        means: FloatTensor<Self>,
        rotations: FloatTensor<Self>,
        spec: AdvectionSpec,
    ) -> FloatTensor<Self>;
}

/// Backends that can run them backwards; apart from [`FreeGaveOps`], as only the inner backend of an autodiff
/// one is asked.
pub trait FreeGaveKernels: FreeGaveOps {
    /// Pose rows, and what their way back needs.
    fn carry_kept(inputs: [FloatTensor<Self>; 3], spec: &AdvectionSpec) -> (FloatTensor<Self>, Arc<Kept>);

    /// Cotangents of parameters, centres and quaternions, given that of the rows.
    fn carry_vjp(
        inputs: [FloatTensor<Self>; 3],
        spec: &AdvectionSpec,
        kept: &Kept,
        v_poses: FloatTensor<Self>,
    ) -> [FloatTensor<Self>; 3];
}

fn input<'a>(inputs: &'a [FloatTensor<Flex>; 3], spec: &'a AdvectionSpec) -> AdvectionInput<'a> {
    let [params, means, rotations] = inputs;
    AdvectionInput {
        config: &spec.config,
        frame: spec.frame,
        params: params.storage(),
        means: means.storage::<f32>().as_chunks::<3>().0,
        rotations: rotations.storage::<f32>().as_chunks::<4>().0,
        advection: spec.advection,
    }
}

fn tensor<const D: usize>(values: Vec<f32>, shape: [usize; D]) -> FloatTensor<Flex> {
    Flex::float_from_data(TensorData::new(values, shape), &Default::default())
}

impl FreeGaveOps for Flex {
    fn carry(
        params: FloatTensor<Self>,
        means: FloatTensor<Self>,
        rotations: FloatTensor<Self>,
        spec: AdvectionSpec,
    ) -> FloatTensor<Self> {
        let _span = tracing::trace_span!("deformation network").entered();
        let inputs = [params, means, rotations].map(|t| t.to_contiguous());
        let poses = carry_rows(input(&inputs, &spec));
        let n = poses.len();
        tensor(poses.into_flattened(), [n, DELTAS])
    }
}

impl FreeGaveKernels for Flex {
    fn carry_kept(inputs: [FloatTensor<Self>; 3], spec: &AdvectionSpec) -> (FloatTensor<Self>, Arc<Kept>) {
        let _span = tracing::trace_span!("deformation network").entered();
        let inputs = inputs.map(|t| t.to_contiguous());
        let (poses, kept) = carry_kept(input(&inputs, spec));
        let n = poses.len();
        (tensor(poses.into_flattened(), [n, DELTAS]), Arc::new(kept))
    }

    fn carry_vjp(
        inputs: [FloatTensor<Self>; 3],
        spec: &AdvectionSpec,
        kept: &Kept,
        v_poses: FloatTensor<Self>,
    ) -> [FloatTensor<Self>; 3] {
        let _span = tracing::trace_span!("deformation network, backward").entered();
        let (inputs, v_poses) = (inputs.map(|t| t.to_contiguous()), v_poses.to_contiguous());
        let v = carry_vjp(input(&inputs, spec), kept, v_poses.storage::<f32>().as_chunks().0);
        let (len, n) = (v.params.len(), v.means.len());
        [
            tensor(v.params, [len]),
            tensor(v.means.into_flattened(), [n, 3]),
            tensor(v.rotations.into_flattened(), [n, 4]),
        ]
    }
}

#[derive(Debug)]
struct Carry;

impl<B: FreeGaveKernels> Backward<B, 3> for Carry {
    type State = ([FloatTensor<B>; 3], AdvectionSpec, Arc<Kept>);

    fn backward(self, ops: Ops<Self::State, 3>, grads: &mut Gradients, _checkpointer: &mut Checkpointer) {
        let (inputs, spec, kept) = ops.state;
        let v_poses = grads.consume::<B>(&ops.node);
        let by_parent = B::carry_vjp(inputs, &spec, &kept, v_poses);
        for (parent, v) in ops.parents.into_iter().zip(by_parent) {
            if let Some(parent) = parent {
                grads.register::<B>(parent.id, v);
            }
        }
    }
}

impl<B: FreeGaveKernels, C: CheckpointStrategy> FreeGaveOps for Autodiff<B, C> {
    fn carry(
        params: FloatTensor<Self>,
        means: FloatTensor<Self>,
        rotations: FloatTensor<Self>,
        spec: AdvectionSpec,
    ) -> FloatTensor<Self> {
        let nodes = [params.node(), means.node(), rotations.node()];
        let inputs = [params, means, rotations].map(|t| t.into_primitive());
        match Carry.prepare::<C>(nodes).compute_bound().stateful() {
            OpsKind::Tracked(prep) => {
                let (out, kept) = B::carry_kept(inputs.clone(), &spec);
                prep.finish((inputs, spec, kept), out)
            }
            OpsKind::UnTracked(prep) => {
                let [params, means, rotations] = inputs;
                prep.finish(B::carry(params, means, rotations, spec))
            }
        }
    }
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
