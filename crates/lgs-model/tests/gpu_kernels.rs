//! The deformation network on a device of Vulkan, Metal or DX12 (feature `gpu`), against the processor.
#![cfg(feature = "gpu")]

use std::sync::Arc;

use burn::tensor::{Device, Tensor, TensorData};
use lgs_core::testing::{assert_gradient_close, assert_values_close};
use lgs_model::source::tensor::{NetworkCall, deform};
use lgs_model::source::{DELTAS, Deformation, DeformationConfig, HeadInit, InputFrame, MotionHead};
use lgs_tensor::cube::device_for_tests;

const FRAME: InputFrame = InputFrame { center: [0.1, -0.2, 0.3], scale: 1.3 };

fn leaf<const D: usize>(values: &[f32], shape: [usize; D], device: &Device) -> Tensor<D> {
    Tensor::from_data(TensorData::new(values.to_vec(), shape), device).require_grad()
}

fn values<const D: usize>(tensor: Tensor<D>) -> Vec<f32> {
    tensor.into_data().try_to_vec::<f32>().expect("f32 values")
}

/// Poses, and gradients by parameters, centres and quaternions.
fn run(net: &Deformation, n: usize, device: &Device) -> [Vec<f32>; 4] {
    let wave =
        |count: usize, step: f32| -> Vec<f32> { (0..count).map(|i| (i as f32 * step).sin()).collect() };
    let params = leaf(&net.params, [net.params.len()], device);
    let means = leaf(&wave(3 * n, 0.7), [n, 3], device);
    let rotations = leaf(&wave(4 * n, 1.3), [n, 4], device);
    let spec = NetworkCall { config: Arc::new(net.config.clone()), frame: net.frame, time: 0.4 };
    let poses = deform(params.clone(), means.clone(), rotations.clone(), spec);
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
    let quick = DeformationConfig { head_init: HeadInit::Uniform, ..DeformationConfig::quick() };
    let heads = [MotionHead::Displacement, MotionHead::Turn, MotionHead::Rigid];
    let of_heads = heads.map(|motion_head| DeformationConfig { motion_head, ..quick.clone() });
    let still = DeformationConfig { head_init: HeadInit::Zero, ..of_heads[2].clone() };
    let plain = DeformationConfig { time_features: 0, skip_layer: 9, depth: 2, ..of_heads[0].clone() };
    let skipping = DeformationConfig { depth: 4, width: 24, skip_layer: 2, ..of_heads[2].clone() };
    for config in of_heads.into_iter().chain([still, plain, skipping]) {
        let net = Deformation::init(config, FRAME, 5);
        let found = run(&net, 130, &device.clone().autodiff());
        let expected = run(&net, 130, &Device::flex().autodiff());
        let name = format!("{:?} of depth {}", net.config.motion_head, net.config.depth);
        assert_values_close(&name, &found[0], &expected[0], 1e-4, 1e-5);
        for (found, expected) in found.iter().zip(&expected).skip(1) {
            assert_gradient_close(&name, found, expected);
        }
        let again = run(&net, 130, &device.clone().autodiff());
        assert!(found == again, "{name}: the same bytes twice");
    }
}
