//! FreeGave's networks in plain tensor operations: the twin that tests compare [`super::network`] with, differentiated by Burn.

use burn::tensor::{
    Tensor, TensorData,
    activation::{relu, silu},
};

use super::config::{ChainLayout, FreeGaveConfig};
use super::network::Hop;
use super::twist::{TWIST, steps, twist_times};
use crate::source::encoding::encode;
use crate::source::network::InputFrame;
use crate::source::reference::{ReferenceInput, columns, cross, deform_with_codes, encoded_positions, linear};

/// Inputs of [`carry`].
pub struct CarryInput<'a> {
    /// Sizes.
    pub config: &'a FreeGaveConfig,
    /// The map of positions before encoding.
    pub frame: InputFrame,
    /// Parameters `[P]`.
    pub params: Tensor<1>,
    /// Canonical centres `[n, 3]`.
    pub means: Tensor<2>,
    /// Canonical quaternions `[n, 4]`.
    pub rotations: Tensor<2>,
    /// The times; rotations along the integration are left out.
    pub hop: Hop,
}

/// Pose rows `[n, DELTAS]`, as [`super::network::carry`] without turning.
#[must_use]
pub fn carry(input: CarryInput<'_>) -> Tensor<2> {
    let CarryInput { config, frame, params, means, rotations, hop } = input;
    let layout = config.layout();
    let x = encoded_positions(&config.deformation, frame, &means);
    let mut hidden = x.clone();
    for (i, l) in layout.code.hidden.iter().enumerate() {
        if i > 0 && i == config.velocity.code_skip_layer + 1 {
            hidden = Tensor::cat(vec![x.clone(), hidden], 1);
        }
        hidden = relu(linear(&params, l, hidden));
    }
    let codes = linear(&params, &layout.code.head, hidden);
    let weights = chain(&params, &layout.segment, codes.clone(), relu);
    let deformation = ReferenceInput { config: &config.deformation, frame, params: params.clone(), means, rotations, time: hop.from };
    let poses = deform_with_codes(deformation, Some(codes));
    let h = steps(hop.from, hop.to, hop.longest_step);
    let times = twist_times(hop.from, &h);
    let twist = |t: f32| {
        let encoding = encode(&[t], config.velocity.time_frequencies);
        let width = encoding.len();
        let time = Tensor::<2>::from_data(TensorData::new(encoding, [1, width]), &params.device());
        weights.clone().matmul(chain(&params, &layout.velocity, time, silu).reshape([config.bases(), TWIST]))
    };
    // The velocity field sees where it starts as a constant, and the deformation what the velocity field adds.
    let start = columns(&poses, 0, 3).detach();
    let mut p = start.clone();
    for (i, h) in h.iter().enumerate() {
        let halfway = p.clone() + velocity(&twist(times[2 * i]), &p) * (0.5 * h);
        p = p + velocity(&twist(times[2 * i + 1]), &halfway) * *h;
    }
    Tensor::cat(vec![columns(&poses, 0, 3) + (p - start), columns(&poses, 3, 7)], 1)
}

fn chain(params: &Tensor<1>, layout: &ChainLayout, x: Tensor<2>, activation: fn(Tensor<2>) -> Tensor<2>) -> Tensor<2> {
    let hidden = layout.hidden.iter().fold(x, |x, l| activation(linear(params, l, x)));
    linear(params, &layout.head, hidden)
}

fn velocity(twist: &Tensor<2>, p: &Tensor<2>) -> Tensor<2> {
    columns(twist, 0, 3) - cross(&columns(twist, 3, 3), p)
}

#[cfg(test)]
mod tests {
    use super::super::config::VelocityConfig;
    use super::super::network::{FreeGaveNetworks, HopInput, Learns, carry_kept, carry_vjp};
    use super::super::tensor::{self, HopSpec};
    use super::*;
    use crate::source::pose::DELTAS;
    use crate::source::{DeformationConfig, HeadInit, MotionHead};
    use burn::tensor::Device;
    use lgs_core::testing::{assert_gradient_close, assert_values_close};
    use std::sync::Arc;

    fn gaussians(n: usize) -> (Vec<[f32; 3]>, Vec<[f32; 4]>) {
        let wave = |i: usize, f: f32| (i as f32 * f).sin();
        let means = (0..n).map(|i| [wave(i, 0.37), wave(i + 9, 0.11), wave(i, 0.23) * 0.5]);
        let rotations = (0..n).map(|i| [1.0 + wave(i, 0.5), wave(i, 0.7), wave(i, 1.1), wave(i, 0.2)]);
        (means.collect(), rotations.collect())
    }

    fn weights(n: usize) -> Vec<f32> {
        (0..n * DELTAS).map(|i| ((i * 29 % 17) as f32 - 8.0) * 0.1).collect()
    }

    fn config(head: MotionHead) -> FreeGaveConfig {
        let deformation =
            DeformationConfig { head_init: HeadInit::Uniform, motion_head: head, code: 5, ..DeformationConfig::freegave_quick() };
        FreeGaveConfig { deformation, velocity: VelocityConfig { code_depth: 3, code_skip_layer: 1, ..VelocityConfig::quick() } }
    }

    fn compare(config: &FreeGaveConfig, n: usize, hop: Hop) {
        let frame = InputFrame { center: [0.1, -0.2, 0.3], scale: 1.3 };
        let networks = FreeGaveNetworks::init(config.clone(), frame, 5);
        let device = Device::flex().autodiff();
        let (means, rotations) = gaussians(n);
        let leaf = |values: &[f32], width: usize| {
            Tensor::<2>::from_data(TensorData::new(values.to_vec(), [values.len() / width, width]), &device).require_grad()
        };
        let run = |fused: bool| {
            let params = Tensor::<1>::from_floats(networks.params.as_slice(), &device).require_grad();
            let (means, rotations) = (leaf(means.as_flattened(), 3), leaf(rotations.as_flattened(), 4));
            let leaves = (params.clone(), means.clone(), rotations.clone());
            let out = if fused {
                tensor::carry(params, means, rotations, HopSpec { config: Arc::new(config.clone()), frame, hop })
            } else {
                carry(CarryInput { config, frame, params, means, rotations, hop })
            };
            let weights = Tensor::<2>::from_data(TensorData::new(weights(n), [n, DELTAS]), &device);
            let g = (out.clone() * weights).sum().backward();
            let values = |t: TensorData| t.try_to_vec::<f32>().expect("f32");
            [
                values(out.into_data()),
                values(leaves.0.grad(&g).expect("params").into_data()),
                values(leaves.1.grad(&g).expect("means").into_data()),
                values(leaves.2.grad(&g).expect("rotations").into_data()),
            ]
        };
        let (found, expected) = (run(true), run(false));
        assert_values_close("poses", &found[0], &expected[0], 1e-5, 1e-5);
        for (i, name) in ["parameters", "means", "rotations"].into_iter().enumerate() {
            assert_gradient_close(name, &found[i + 1], &expected[i + 1]);
        }
    }

    #[test]
    fn the_fused_networks_agree_with_their_twin() {
        let hop = Hop { from: 0.4, to: 0.55, longest_step: 0.06, turns: false, learns: Learns::All };
        compare(&config(MotionHead::Rigid), 1, hop);
        compare(&config(MotionHead::Turn), 700, hop);
        compare(&config(MotionHead::Turn), 300, Hop { from: 0.4, to: 0.3, longest_step: f32::INFINITY, turns: false, learns: Learns::All });
        compare(&config(MotionHead::Rigid), 300, Hop::none(0.2));
        let paper = FreeGaveConfig { deformation: DeformationConfig::freegave_paper(), velocity: VelocityConfig::paper() };
        compare(&paper, 100, hop);
    }

    #[test]
    fn the_velocity_field_can_learn_alone() {
        let config = config(MotionHead::Rigid);
        let layout = config.layout();
        let networks = FreeGaveNetworks::init(config.clone(), InputFrame::IDENTITY, 5);
        let (means, rotations) = gaussians(300);
        let gradients = |learns| {
            let hop = Hop { from: 0.4, to: 0.55, longest_step: 0.06, turns: false, learns };
            let input =
                HopInput { config: &config, frame: networks.frame, params: &networks.params, means: &means, rotations: &rotations, hop };
            carry_vjp(input, &carry_kept(input).1, weights(300).as_chunks().0)
        };
        let (all, alone) = (gradients(Learns::All), gradients(Learns::Velocity));
        let (code, segment) = (layout.deformation.len, layout.segment.hidden[0].weight);
        assert!(alone.params[..code].iter().all(|v| *v == 0.0) && alone.means.as_flattened().iter().all(|v| *v == 0.0));
        assert_ne!(alone.params[code..segment], all.params[code..segment], "codes also steer the deformation");
        assert!(alone.params[code..segment].iter().any(|v| *v != 0.0));
        assert_eq!(alone.params[segment..], all.params[segment..]);
    }

    #[test]
    fn gradients_are_the_same_for_any_number_of_threads() {
        let config = config(MotionHead::Rigid);
        let networks = FreeGaveNetworks::init(config.clone(), InputFrame::IDENTITY, 5);
        let (means, rotations) = gaussians(3000);
        let weights = weights(3000);
        let hop = Hop { from: 0.4, to: 0.55, longest_step: 0.06, turns: true, learns: Learns::All };
        let run = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("pool");
            let input =
                HopInput { config: &config, frame: networks.frame, params: &networks.params, means: &means, rotations: &rotations, hop };
            pool.install(|| carry_vjp(input, &carry_kept(input).1, weights.as_chunks().0))
        };
        let one = run(1);
        assert!(one.params.iter().any(|v| *v != 0.0));
        assert_eq!(one, run(2));
        assert_eq!(one, run(5));
    }
}
