//! FreeGave's networks on a device of Vulkan, Metal or DX12 (feature `gpu`), against the processor.
#![cfg(feature = "gpu")]

#[path = "common/networks.rs"]
mod networks;

use std::sync::Arc;

use burn::tensor::Device;
use lgs_model::source::freegave::tensor::carry;
use lgs_model::source::freegave::{Advection, FreeGaveNetworks, Learns};
use lgs_model::source::tensor::NetworkCall;
use lgs_model::source::{DeformationConfig, FreeGaveConfig, HeadInit, RotationForm, VelocityConfig};
use lgs_tensor::cube::device_for_tests;
use networks::{FRAME, assert_close, run};

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
        let velocity = VelocityConfig { rotation, ..VelocityConfig::quick() };
        let net = FreeGaveNetworks::init(FreeGaveConfig { deformation, velocity }, FRAME, 5);
        for time in [rest, carried, back, field] {
            let on = |device: &Device| {
                run(&net.params, 70, &device.clone().autodiff(), |params, means, rotations| {
                    let call = NetworkCall { config: Arc::new(net.config.clone()), frame: net.frame, time };
                    carry(params, means, rotations, call)
                })
            };
            assert_close(&format!("{rotation:?}, {time:?}"), &on(&device), &on(&Device::flex()));
        }
    }
}
