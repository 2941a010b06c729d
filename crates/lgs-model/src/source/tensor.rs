//! The deformation network as a Burn operation, differentiable by its parameters and by the Gaussians that it
//! moves.

use burn::backend::tensor::FloatTensor;
use burn::backend::{Backend, Dispatch, Flex, backend_extension};
use burn::tensor::Tensor;
use lgs_tensor::Kernel;
use lgs_tensor::flex::{floats, rows, tensor, tensor_of_rows};
use std::sync::Arc;

use super::config::DeformationConfig;
use super::input::{DeformInput, InputFrame};
use super::network::{Kept, deform as deform_rows, deform_kept, deform_vjp};

/// The constants of a call.
#[derive(Clone, Debug)]
pub struct DeformSpec {
    /// Sizes.
    pub config: DeformationConfig,
    /// The map of positions before encoding.
    pub frame: InputFrame,
    /// The frame's time.
    pub time: f32,
}

/// Backends that can run the network: kernels from parameters `[P]`, centres `[n, 3]` and quaternions
/// `[n, 4]` to pose rows `[n, DELTAS]`.
pub trait DeformationKernels: Kernel<DeformSpec, 3> {}

impl<B: Kernel<DeformSpec, 3>> DeformationKernels for B {}

/// The operation on backends with and without gradients.
#[backend_extension(Autodiff, Flex, Cube: cfg(feature = "gpu"))]
pub trait DeformationOps: Backend {
    /// Pose rows `[n, DELTAS]` from parameters `[P]`, centres `[n, 3]` and quaternions `[n, 4]`.
    fn deform(
        params: FloatTensor<Self>,
        means: FloatTensor<Self>,
        rotations: FloatTensor<Self>,
        spec: DeformSpec,
    ) -> FloatTensor<Self>;
}

fn input<'a>(inputs: &'a [FloatTensor<Flex>; 3], spec: &'a DeformSpec) -> DeformInput<'a> {
    let [params, means, rotations] = inputs;
    DeformInput {
        config: &spec.config,
        frame: spec.frame,
        params: floats(params),
        means: rows(means),
        rotations: rows(rotations),
        time: spec.time,
    }
}

impl Kernel<DeformSpec, 3> for Flex {
    type Kept = ([FloatTensor<Self>; 3], Arc<Kept>);

    fn forward(spec: &DeformSpec, inputs: [FloatTensor<Self>; 3]) -> FloatTensor<Self> {
        let _span = tracing::trace_span!("deformation network").entered();
        let inputs = inputs.map(|t| t.to_contiguous());
        tensor_of_rows(deform_rows(input(&inputs, spec)))
    }

    fn forward_kept(spec: &DeformSpec, inputs: [FloatTensor<Self>; 3]) -> (FloatTensor<Self>, Self::Kept) {
        let _span = tracing::trace_span!("deformation network").entered();
        let inputs = inputs.map(|t| t.to_contiguous());
        let (poses, kept) = deform_kept(input(&inputs, spec));
        (tensor_of_rows(poses), (inputs, Arc::new(kept)))
    }

    fn vjp(
        spec: &DeformSpec,
        (inputs, kept): Self::Kept,
        v_poses: FloatTensor<Self>,
    ) -> [FloatTensor<Self>; 3] {
        let _span = tracing::trace_span!("deformation network, backward").entered();
        let v = deform_vjp(input(&inputs, spec), &kept, rows(&v_poses.to_contiguous()));
        let len = v.params.len();
        [tensor(v.params, [len]), tensor_of_rows(v.means), tensor_of_rows(v.rotations)]
    }
}

lgs_tensor::operations! {
    DeformationOps of DeformationKernels;
    deform(params, means, rotations; spec: DeformSpec);
}

/// Pose rows `[n, DELTAS]` of Gaussians with centres `[n, 3]` and quaternions `[n, 4]`, from parameters
/// `[P]`; differentiable by all three, by the centres not through their encoding.
#[must_use]
pub fn deform(params: Tensor<1>, means: Tensor<2>, rotations: Tensor<2>, spec: DeformSpec) -> Tensor<2> {
    let out = <Dispatch as DeformationOps>::deform(
        params.into_dispatch(),
        means.into_dispatch(),
        rotations.into_dispatch(),
        spec,
    );
    Tensor::from_dispatch(out)
}

#[cfg(test)]
mod tests {
    use super::super::network::Deformation;
    use super::super::reference::{self, ReferenceInput};
    use super::super::testing::{FRAME, compare_twins, gaussians, weights};
    use super::super::{HeadInit, MotionHead};
    use super::*;

    fn compare(config: &DeformationConfig, n: usize) {
        let net = Deformation::init(config.clone(), FRAME, 5);
        let time = 0.4;
        let spec = DeformSpec { config: config.clone(), frame: FRAME, time };
        compare_twins(
            &net.params,
            n,
            |params, means, rotations| deform(params, means, rotations, spec),
            |params, means, rotations| {
                reference::deform(ReferenceInput { config, frame: FRAME, params, means, rotations, time })
            },
        );
    }

    #[test]
    fn the_fused_network_agrees_with_its_twin() {
        let rigid = DeformationConfig {
            head_init: HeadInit::Uniform,
            motion_head: MotionHead::Rigid,
            ..DeformationConfig::quick()
        };
        let moved = DeformationConfig { motion_head: MotionHead::Displacement, ..rigid.clone() };
        compare(&rigid, 1);
        compare(&rigid, 700);
        compare(&moved, 700);
        compare(&DeformationConfig { motion_head: MotionHead::Turn, ..rigid.clone() }, 300);
        compare(
            &DeformationConfig {
                time_features: 0,
                skip_layer: 9,
                depth: 2,
                gain_start: 1.0,
                gain_slope: 0.0,
                ..moved
            },
            300,
        );
        compare(&DeformationConfig { depth: 6, width: 24, skip_layer: 4, ..rigid }, 5000);
        compare(&DeformationConfig { width: 64, ..DeformationConfig::paper() }, 300);
    }

    #[test]
    fn gradients_are_the_same_for_any_number_of_threads() {
        let config = DeformationConfig::quick();
        let net = Deformation::init(config.clone(), InputFrame::IDENTITY, 5);
        let (means, rotations) = gaussians(3000);
        let weights = weights(3000);
        let run = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("pool");
            let input = DeformInput {
                config: &config,
                frame: net.frame,
                params: &net.params,
                means: &means,
                rotations: &rotations,
                time: 0.3,
            };
            pool.install(|| deform_vjp(input, &deform_kept(input).1, weights.as_chunks().0))
        };
        let one = run(1);
        assert!(one.params.iter().any(|v| *v != 0.0));
        assert_eq!(one, run(2));
        assert_eq!(one, run(5));
    }

    #[test]
    fn no_gaussians_give_no_poses_and_a_zero_gradient() {
        let config = DeformationConfig::quick();
        let net = Deformation::init(config.clone(), InputFrame::IDENTITY, 5);
        assert!(net.poses(&[], &[], 0.5).is_empty());
        let input = DeformInput {
            config: &config,
            frame: net.frame,
            params: &net.params,
            means: &[],
            rotations: &[],
            time: 0.5,
        };
        assert!(deform_vjp(input, &deform_kept(input).1, &[]).params.iter().all(|v| *v == 0.0));
    }
}
