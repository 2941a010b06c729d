//! FreeGave's networks on a device of Vulkan, Metal or DX12 (feature `gpu`), against the processor.
#![cfg(feature = "gpu")]

use std::sync::Arc;

use burn::tensor::{Device, Tensor, TensorData};
use lgs_core::testing::{assert_gradient_close, assert_values_close};
use lgs_model::source::freegave::tensor::carry;
use lgs_model::source::freegave::{Advection, FreeGaveNetworks, Learns};
use lgs_model::source::tensor::NetworkCall;
use lgs_model::source::{
    DELTAS, DeformationConfig, FreeGaveConfig, HeadInit, InputFrame, RotationForm, VelocityConfig,
};
use lgs_tensor::cube::device_for_tests;

const FRAME: InputFrame = InputFrame { center: [0.1, -0.2, 0.3], scale: 1.3 };

fn leaf<const D: usize>(values: &[f32], shape: [usize; D], device: &Device) -> Tensor<D> {
    Tensor::from_data(TensorData::new(values.to_vec(), shape), device).require_grad()
}

fn values<const D: usize>(tensor: Tensor<D>) -> Vec<f32> {
    tensor.into_data().try_to_vec::<f32>().expect("f32 values")
}

fn wave(count: usize, step: f32) -> Vec<f32> {
    (0..count).map(|i| (i as f32 * step).sin()).collect()
}

/// Poses, and gradients by parameters, centres and quaternions.
fn run(networks: &FreeGaveNetworks, n: usize, time: Advection, device: &Device) -> [Vec<f32>; 4] {
    let params = leaf(&networks.params, [networks.params.len()], device);
    let means = leaf(&wave(3 * n, 0.7), [n, 3], device);
    let rotations = leaf(&wave(4 * n, 1.3), [n, 4], device);
    let call = NetworkCall { config: Arc::new(networks.config.clone()), frame: networks.frame, time };
    let poses = carry(params.clone(), means.clone(), rotations.clone(), call);
    let weights = Tensor::from_data(TensorData::new(wave(DELTAS * n, 0.9), [n, DELTAS]), device);
    let grads = (poses.clone() * weights).sum().backward();
    [
        values(poses),
        values(params.grad(&grads).expect("parameters")),
        values(means.grad(&grads).expect("centres")),
        values(rotations.grad(&grads).expect("quaternions")),
    ]
}

#[test]
fn poses_and_gradients_are_those_of_the_processor() {
    let Some(device) = device_for_tests() else { return };
    let rest = Advection::none(0.4);
    let carried = Advection { from: 0.3, to: 0.52, longest_step: 0.1, turns: true, learns: Learns::All };
    let back = Advection { from: 0.5, to: 0.4, longest_step: f32::INFINITY, turns: false, ..carried };
    let field = Advection { learns: Learns::Velocity, ..carried };
    for rotation in [RotationForm::Fixed, RotationForm::Reference] {
        let deformation =
            DeformationConfig { head_init: HeadInit::Uniform, ..DeformationConfig::freegave_quick() };
        let config =
            FreeGaveConfig { deformation, velocity: VelocityConfig { rotation, ..VelocityConfig::quick() } };
        let networks = FreeGaveNetworks::init(config, FRAME, 5);
        for time in [rest, carried, back, field] {
            let found = run(&networks, 70, time, &device.clone().autodiff());
            let expected = run(&networks, 70, time, &Device::flex().autodiff());
            let name = format!("{rotation:?}, {time:?}");
            assert_values_close(&name, &found[0], &expected[0], 1e-4, 1e-5);
            for (found, expected) in found.iter().zip(&expected).skip(1) {
                match expected.iter().all(|v| *v == 0.0) {
                    true => assert!(found.iter().all(|v| *v == 0.0), "{name}"),
                    false => assert_gradient_close(&name, found, expected),
                }
            }
        }
    }
}
