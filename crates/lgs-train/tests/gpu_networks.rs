//! The paper's networks on a device of Vulkan, Metal or DX12 (feature `gpu`): stage 1 and the motion of a
//! scene are those of the processor.
#![cfg(feature = "gpu")]

use burn::tensor::Device;
use lgs_core::GaussianCloud;
use lgs_core::testing::assert_values_close;
use lgs_distill::{
    Alignment, DistillConfig, Distilled, DistilledParticles, RolloutConfig, Trajectories, distill,
};
use lgs_dynamics::tensor::processor;
use lgs_dynamics::{Edit, Reversal, Supports, System, VelocityPolicy};
use lgs_model::Motion;
use lgs_model::testing::particles;
use lgs_tensor::cube::device_for_tests;

/// Points that fall and turn.
fn falling() -> Trajectories {
    let times: Vec<f32> = (0..16).map(|i| 0.02 * i as f32).collect();
    let at = |time: f32, j: usize| {
        let (angle, height) = (0.5 * j as f32 + 2.0 * time, 0.1 * (j % 3) as f32);
        [0.3 * angle.cos(), 0.3 * angle.sin(), 1.0 + height - 4.9 * time * time]
    };
    let positions = times.iter().map(|&time| (0..20).map(|j| at(time, j)).collect()).collect();
    Trajectories::unweighted(times, positions)
}

fn distilled(device: &Device) -> DistilledParticles {
    let config = DistillConfig {
        hidden: 16,
        rollout: RolloutConfig { steps: 40, particles: 12, ..RolloutConfig::networks() },
        alignment: Some(Alignment { support: 5, velocity_policy: VelocityPolicy::Keep }),
        device: device.clone(),
        ..DistillConfig::networks()
    };
    match distill(&falling(), &config, 3, &mut |_| {}).expect("networks") {
        Distilled::Particles(found) => *found,
        Distilled::Generalised(_) => panic!("no law was asked for"),
    }
}

#[test]
fn stage_1_of_the_networks_is_that_of_the_processor() {
    let Some(device) = device_for_tests() else { return };
    let [found, expected] = [device, processor()].map(|device| distilled(&device));
    let [v0, expected_v0] = [&found, &expected].map(|of| of.v0.as_flattened().to_vec());
    assert_values_close("starting velocities", &v0, &expected_v0, 1e-2, 1e-2);
    let [error, expected_error] = [&found, &expected].map(|of| of.report.window_error);
    assert!((error / expected_error - 1.0).abs() < 1e-2, "{error} {expected_error}");
}

#[test]
fn the_motion_of_a_scene_is_that_of_the_processor() {
    let Some(device) = device_for_tests() else { return };
    let DistilledParticles { q0, v0, system, .. } = distilled(&processor());
    let system = System { params: system.params.iter().map(|p| 1.5 * p).collect(), ..system };
    let supports = Some(Supports::nearest(&q0, 5));
    let cloud = GaussianCloud::isotropic(q0, 0.05, [0.9, 0.3, 0.1], 0.9);
    let scene = particles(cloud, v0, system, supports);
    let edit = Edit { velocity_scale: 0.5, potential_scale: 2.0, force_scale: 0.5 };
    // More steps than are rolled at once, and a part of one.
    for time in [0.004, 0.4999, -0.1] {
        let [found, expected] = [device.clone(), processor()]
            .map(|device| Motion::new(&scene, edit, Reversal::Exact).on(&device).state_at(time));
        assert_values_close("positions", found.q.as_flattened(), expected.q.as_flattened(), 1e-4, 1e-5);
        assert_values_close("velocities", found.v.as_flattened(), expected.v.as_flattened(), 1e-3, 1e-4);
        let [found, expected] = [&found, &expected].map(|state| state.rotation.as_flattened());
        assert_values_close("rotations", found, expected, 1e-4, 1e-5);
    }
}
