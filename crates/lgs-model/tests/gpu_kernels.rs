//! The deformation network on a device of Vulkan, Metal or DX12 (feature `gpu`), against the processor.
#![cfg(feature = "gpu")]

#[path = "common/networks.rs"]
mod networks;

use std::sync::Arc;

use burn::tensor::Device;
use lgs_model::source::tensor::{NetworkCall, deform};
use lgs_model::source::{Deformation, DeformationConfig, HeadInit, MotionHead};
use lgs_tensor::cube::device_for_tests;
use networks::{FRAME, assert_close, run};

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
        let on = |device: &Device| {
            run(&net.params, 130, &device.clone().autodiff(), |params, means, rotations| {
                let config = Arc::new(net.config.clone());
                deform(params, means, rotations, NetworkCall { config, frame: net.frame, time: 0.4 })
            })
        };
        let (name, found) =
            (format!("{:?} of depth {}", net.config.motion_head, net.config.depth), on(&device));
        assert_close(&name, &found, &on(&Device::flex()));
        assert!(found == on(&device), "{name}: the same bytes twice");
    }
}
