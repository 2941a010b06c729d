//! FreeGave's networks in plain tensor operations: the twin that tests compare [`super::network`] with,
//! differentiated by Burn.

use burn::tensor::activation::{relu, silu};
use burn::tensor::{Tensor, TensorData};
use lgs_nn::encoding::encode;

use super::config::FreeGaveConfig;
use super::twist::{TWIST, steps, twist_times};
use crate::source::reference::{ReferenceInput, columns, cross, deform_with_codes, encoded_positions, mlp};

/// Pose rows `[n, DELTAS]`, as [`super::tensor::carry`]; rotations along the integration are left out.
#[must_use]
pub fn carry(input: ReferenceInput<'_, FreeGaveConfig>) -> Tensor<2> {
    let ReferenceInput { config, frame, params, means, rotations, time: advection } = input;
    let layout = config.layout();
    let x = encoded_positions(&config.deformation, frame, &means);
    let codes = mlp(&params, &layout.code, &x, relu);
    let weights = mlp(&params, &layout.segment, &codes, relu);
    let deformation = ReferenceInput {
        config: &config.deformation,
        frame,
        params: params.clone(),
        means,
        rotations,
        time: advection.from,
    };
    let poses = deform_with_codes(deformation, Some(codes));
    let h = steps(advection.from, advection.to, advection.longest_step);
    let times = twist_times(advection.from, &h);
    let twist = |t: f32| {
        let encoding = encode(&[t], config.velocity.time_frequencies);
        let width = encoding.len();
        let time = Tensor::<2>::from_data(TensorData::new(encoding, [1, width]), &params.device());
        weights.clone().matmul(mlp(&params, &layout.velocity, &time, silu).reshape([config.bases(), TWIST]))
    };
    // The velocity field sees where it starts as a constant, and the deformation what the velocity field
    // adds.
    let start = columns(&poses, 0, 3).detach();
    let mut p = start.clone();
    for (i, h) in h.iter().enumerate() {
        let halfway = p.clone() + velocity(&twist(times[2 * i]), &p) * (0.5 * h);
        p = p + velocity(&twist(times[2 * i + 1]), &halfway) * *h;
    }
    Tensor::cat(vec![columns(&poses, 0, 3) + (p - start), columns(&poses, 3, 7)], 1)
}

fn velocity(twist: &Tensor<2>, p: &Tensor<2>) -> Tensor<2> {
    columns(twist, 0, 3) - cross(&columns(twist, 3, 3), p)
}

#[cfg(test)]
mod tests {
    use super::super::input::{Advection, Learns};
    use super::super::network::FreeGaveNetworks;
    use super::super::tensor;
    use super::*;
    use crate::source::config::VelocityConfig;
    use crate::source::input::InputFrame;
    use crate::source::pose_network::{PoseGradients, PoseNetwork};
    use crate::source::tensor::NetworkCall;
    use crate::source::testing::{FRAME, compare_twins, gaussians, weights};
    use crate::source::{DeformationConfig, HeadInit, MotionHead};
    use std::sync::Arc;

    fn config(head: MotionHead) -> FreeGaveConfig {
        let deformation = DeformationConfig {
            head_init: HeadInit::Uniform,
            motion_head: head,
            code: 5,
            ..DeformationConfig::freegave_quick()
        };
        FreeGaveConfig {
            deformation,
            velocity: VelocityConfig { code_depth: 3, code_skip_layer: 1, ..VelocityConfig::quick() },
        }
    }

    fn compare(config: &FreeGaveConfig, n: usize, advection: Advection) {
        let params = FreeGaveNetworks::init(config.clone(), FRAME, 5).params;
        let call = NetworkCall { config: Arc::new(config.clone()), frame: FRAME, time: advection };
        compare_twins(
            &params,
            n,
            |params, means, rotations| tensor::carry(params, means, rotations, call),
            |params, means, rotations| {
                carry(ReferenceInput { config, frame: FRAME, params, means, rotations, time: advection })
            },
        );
    }

    #[test]
    fn the_fused_networks_agree_with_their_twin() {
        let advection =
            Advection { from: 0.4, to: 0.55, longest_step: 0.06, turns: false, learns: Learns::All };
        compare(&config(MotionHead::Rigid), 1, advection);
        compare(&config(MotionHead::Turn), 700, advection);
        compare(
            &config(MotionHead::Turn),
            300,
            Advection { from: 0.4, to: 0.3, longest_step: f32::INFINITY, turns: false, learns: Learns::All },
        );
        compare(&config(MotionHead::Rigid), 300, Advection::none(0.2));
        let paper = FreeGaveConfig {
            deformation: DeformationConfig::freegave_paper(),
            velocity: VelocityConfig::paper(),
        };
        compare(&paper, 100, advection);
    }

    /// Gradients of a weighted sum of the pose rows of some Gaussians.
    fn carried_back(networks: &FreeGaveNetworks, count: usize, advection: Advection) -> PoseGradients {
        let (means, rotations) = gaussians(count);
        let input = networks.input(&means, &rotations, advection);
        let (_, kept) = FreeGaveConfig::poses_kept(input);
        FreeGaveConfig::vjp(input, &kept, weights(count).as_chunks().0)
    }

    #[test]
    fn the_velocity_field_can_learn_alone() {
        let config = config(MotionHead::Rigid);
        let layout = config.layout();
        let networks = FreeGaveNetworks::init(config.clone(), InputFrame::IDENTITY, 5);
        let gradients = |learns| {
            let advection = Advection { from: 0.4, to: 0.55, longest_step: 0.06, turns: false, learns };
            carried_back(&networks, 300, advection)
        };
        let (all, alone) = (gradients(Learns::All), gradients(Learns::Velocity));
        let (code, segment) = (layout.deformation.len, layout.segment.hidden[0].weight);
        assert!(
            alone.params[..code].iter().all(|v| *v == 0.0)
                && alone.means.as_flattened().iter().all(|v| *v == 0.0)
        );
        assert_ne!(
            alone.params[code..segment],
            all.params[code..segment],
            "codes also steer the deformation"
        );
        assert!(alone.params[code..segment].iter().any(|v| *v != 0.0));
        assert_eq!(alone.params[segment..], all.params[segment..]);
    }

    #[test]
    fn gradients_are_the_same_for_any_number_of_threads() {
        let config = config(MotionHead::Rigid);
        let networks = FreeGaveNetworks::init(config.clone(), InputFrame::IDENTITY, 5);
        let advection =
            Advection { from: 0.4, to: 0.55, longest_step: 0.06, turns: true, learns: Learns::All };
        let run = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("pool");
            pool.install(|| carried_back(&networks, 3000, advection))
        };
        let one = run(1);
        assert!(one.params.iter().any(|v| *v != 0.0));
        assert_eq!(one, run(2));
        assert_eq!(one, run(5));
    }
}
