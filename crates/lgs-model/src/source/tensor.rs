//! Networks that move Gaussians as Burn operations, differentiable by their parameters and by the Gaussians
//! that they move: the kernel of all of them, and the operation of the deformation network.

use std::sync::Arc;

use burn::backend::Flex;
use burn::backend::tensor::FloatTensor;
use lgs_tensor::flex::{floats, rows, tensor, tensor_of_rows};
use lgs_tensor::{Call, Kernel};

use super::config::DeformationConfig;
use super::input::InputFrame;
use super::pose_network::{NetworkInput, PoseNetwork};

/// The constants of a call of networks.
#[derive(Clone, Debug)]
pub struct NetworkCall<N: PoseNetwork> {
    /// Sizes.
    pub config: Arc<N>,
    /// The map of positions before encoding.
    pub frame: InputFrame,
    /// The time of the call, or its times.
    pub time: N::Time,
}

impl<N: PoseNetwork> NetworkCall<N> {
    fn input<'a>(&'a self, inputs: &'a [FloatTensor<Flex>; 3]) -> NetworkInput<'a, N> {
        let [params, means, rotations] = inputs;
        NetworkInput {
            config: &self.config,
            frame: self.frame,
            params: floats(params),
            means: rows(means),
            rotations: rows(rotations),
            time: self.time,
        }
    }
}

impl<N: PoseNetwork> Kernel<NetworkCall<N>, 3> for Flex
where
    NetworkCall<N>: Call,
{
    type Kept = ([FloatTensor<Self>; 3], Arc<N::Kept>);

    fn forward(call: &NetworkCall<N>, inputs: [FloatTensor<Self>; 3]) -> FloatTensor<Self> {
        let inputs = inputs.map(|t| t.to_contiguous());
        tensor_of_rows(N::poses(call.input(&inputs)))
    }

    fn forward_kept(
        call: &NetworkCall<N>,
        inputs: [FloatTensor<Self>; 3],
    ) -> (FloatTensor<Self>, Self::Kept) {
        let inputs = inputs.map(|t| t.to_contiguous());
        let (poses, kept) = N::poses_kept(call.input(&inputs));
        (tensor_of_rows(poses), (inputs, Arc::new(kept)))
    }

    fn vjp(
        call: &NetworkCall<N>,
        (inputs, kept): Self::Kept,
        v_poses: FloatTensor<Self>,
    ) -> [FloatTensor<Self>; 3] {
        let v = N::vjp(call.input(&inputs), &kept, rows(&v_poses.to_contiguous()));
        let len = v.params.len();
        [tensor(v.params, [len]), tensor_of_rows(v.means), tensor_of_rows(v.rotations)]
    }
}

lgs_tensor::calls! { NetworkCall<DeformationConfig>: "deformation network"; }

lgs_tensor::operations! {
    /// Backends that can run the deformation network: kernels from parameters `[P]`, centres `[n, 3]` and
    /// quaternions `[n, 4]` to pose rows `[n, DELTAS]`.
    pub trait DeformationKernels;

    /// The operation of the deformation network on backends with and without gradients.
    pub trait DeformationOps;

    /// Pose rows `[n, DELTAS]` of Gaussians with centres `[n, 3]` and quaternions `[n, 4]`, from parameters
    /// `[P]`; differentiable by all three, by the centres not through their encoding.
    pub fn deform(params: 1, means: 2, rotations: 2; call: NetworkCall<DeformationConfig>) -> 2;
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
        let call = NetworkCall { config: Arc::new(config.clone()), frame: FRAME, time };
        compare_twins(
            &net.params,
            n,
            |params, means, rotations| deform(params, means, rotations, call),
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
            let input = net.input(&means, &rotations, 0.3);
            let back = |kept| DeformationConfig::vjp(input, &kept, weights.as_chunks().0);
            pool.install(|| back(DeformationConfig::poses_kept(input).1))
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
        let input = net.input(&[], &[], 0.5);
        let (_, kept) = DeformationConfig::poses_kept(input);
        assert!(DeformationConfig::vjp(input, &kept, &[]).params.iter().all(|v| *v == 0.0));
    }
}
