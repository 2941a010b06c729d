//! Accelerations and rollouts on a device of Vulkan, Metal or DX12 (feature `gpu`), against the processor and
//! the conformance vectors.
#![cfg(feature = "gpu")]
#![expect(clippy::unwrap_used, reason = "a test stops at what it did not expect")]

mod support;

use std::sync::Arc;

use burn::tensor::Device;
use lgs_core::testing::{assert_gradient_close, assert_values_close};
use lgs_dynamics::tensor::RolloutCall;
use lgs_dynamics::{Edit, ForceKind, PotentialKind, Supports, System, SystemConfig, VelocityPolicy};
use lgs_tensor::cube::device_for_tests;
use support::devices::{accelerated, assert_close, rolled};
use support::{Vector, lively_system, random_points, system_of, vectors};

const EDIT: Edit = Edit { velocity_scale: 0.7, potential_scale: 1.2, force_scale: 0.8 };

/// Numbers in ±1.
fn weights(count: usize, seed: u64) -> Vec<f32> {
    random_points(count.div_ceil(3), 1.0, seed).as_flattened()[..count].to_vec()
}

#[test]
fn accelerations_are_those_of_the_processor() {
    let Some(device) = device_for_tests() else { return };
    for n in [1, 70, 130] {
        let (q, v) = (random_points(n, 0.6, 1), random_points(n, 0.5, 2));
        let weight = weights(3 * n, 3);
        for potential in [PotentialKind::Mlp, PotentialKind::QuadraticMlp] {
            for force in [ForceKind::None, ForceKind::Mlp, ForceKind::Structured] {
                let system = lively_system(potential, force);
                let on = |device: &Device| accelerated(&system, [&q, &v], EDIT, &weight, device);
                let (name, found) = (format!("{n} particles, {potential:?}, {force:?}"), on(&device));
                assert_close(&name, &found, &on(&Device::flex()), 1);
                assert!(found == on(&device), "{name}: the same bytes twice");
            }
        }
    }
}

#[test]
fn networks_of_any_depth_and_width_are_those_of_the_processor() {
    let Some(device) = device_for_tests() else { return };
    let (q, v, weight) = (random_points(9, 0.6, 1), random_points(9, 0.5, 2), weights(27, 3));
    for (hidden, hidden_layers) in [(1, 1), (6, 4), (33, 1)] {
        let lively = lively_system(PotentialKind::QuadraticMlp, ForceKind::Mlp);
        let config = SystemConfig { hidden, hidden_layers, ..lively.config };
        let params = weights(config.parameters(), 7);
        let system = System { config, params };
        let on = |device: &Device| accelerated(&system, [&q, &v], EDIT, &weight, device);
        assert_close(&format!("{hidden_layers} of {hidden}"), &on(&device), &on(&Device::flex()), 1);
    }
}

/// Every kind of potential and force, every treatment of velocities, and one support that all share.
fn cases(q: &[[f32; 3]]) -> Vec<(PotentialKind, ForceKind, Option<Arc<Supports>>, VelocityPolicy)> {
    let (mlp, quadratic) = (PotentialKind::Mlp, PotentialKind::QuadraticMlp);
    let near = Some(Arc::new(Supports::nearest(q, 12)));
    let shared = Some(Arc::new(Supports::shared(&[0, 3, 5, 8, 13, 21], q.len())));
    vec![
        (mlp, ForceKind::None, None, VelocityPolicy::Keep),
        (quadratic, ForceKind::Mlp, None, VelocityPolicy::Keep),
        (quadratic, ForceKind::Structured, None, VelocityPolicy::Keep),
        (quadratic, ForceKind::Structured, near.clone(), VelocityPolicy::Keep),
        (mlp, ForceKind::Mlp, near.clone(), VelocityPolicy::FromPositions),
        (mlp, ForceKind::Structured, near, VelocityPolicy::Rigid),
        (mlp, ForceKind::Mlp, shared.clone(), VelocityPolicy::Keep),
        (quadratic, ForceKind::None, shared, VelocityPolicy::Rigid),
    ]
}

#[test]
fn rollouts_are_those_of_the_processor() {
    let Some(device) = device_for_tests() else { return };
    let (q, v) = (random_points(70, 0.6, 1), random_points(70, 0.5, 2));
    let weight = weights(6 * 70 * 10, 9);
    for (potential, force, supports, velocity_policy) in cases(&q) {
        let name = format!("{potential:?} {force:?} {} {velocity_policy:?}", supports.is_some());
        let system = lively_system(potential, force);
        let call = RolloutCall {
            config: system.config,
            dt: 0.05,
            steps: 4,
            last_dt: Some(0.02),
            edit: EDIT,
            supports,
            velocity_policy,
        };
        let on = |device: &Device| rolled(&system, [&q, &v], &call, &weight, device);
        let found = on(&device);
        assert_close(&name, &found, &on(&Device::flex()), 1);
        assert!(found == on(&device), "{name}: the same bytes twice");
    }
}

#[test]
fn more_particles_than_are_evaluated_at_a_time_are_those_of_the_processor() {
    let Some(device) = device_for_tests() else { return };
    let (n, normalisation) = (2100, lively_system(PotentialKind::Mlp, ForceKind::Mlp).config.normalisation);
    let config = SystemConfig { hidden: 256, hidden_layers: 4, normalisation, ..SystemConfig::paper() };
    let params = weights(config.parameters(), 7).into_iter().map(|value| 0.1 * value).collect();
    let system = System { config, params };
    let (q, v, weight) = (random_points(n, 0.6, 1), random_points(n, 0.5, 2), weights(2 * n * 10, 9));
    for supports in [None, Some(Arc::new(Supports::nearest(&q, 8)))] {
        let call = RolloutCall {
            config,
            dt: 0.05,
            steps: 1,
            last_dt: None,
            edit: EDIT,
            supports,
            velocity_policy: VelocityPolicy::Keep,
        };
        let on = |device: &Device| rolled(&system, [&q, &v], &call, &weight, device);
        assert_close("many particles", &on(&device), &on(&Device::flex()), 1);
    }
}

#[test]
fn a_rollout_of_nothing_and_one_without_steps_are_those_of_the_processor() {
    let Some(device) = device_for_tests() else { return };
    let system = lively_system(PotentialKind::QuadraticMlp, ForceKind::Mlp);
    for (n, steps) in [(0, 3), (5, 0)] {
        let (q, v) = (random_points(n, 0.6, 1), random_points(n, 0.5, 2));
        let call = RolloutCall {
            config: system.config,
            dt: 0.05,
            steps,
            last_dt: None,
            edit: EDIT,
            supports: None,
            velocity_policy: VelocityPolicy::Keep,
        };
        let weight = weights((steps + 1) * n * 10, 4);
        let on = |device: &Device| rolled(&system, [&q, &v], &call, &weight, device);
        assert_close(&format!("{n} particles, {steps} steps"), &on(&device), &on(&Device::flex()), 1);
    }
}

#[test]
fn rollouts_pass_conformance() {
    let Some(device) = device_for_tests() else { return };
    for vector in vectors("dynamics") {
        check_rollout(&vector, &device);
    }
}

fn check_rollout(vector: &Vector, device: &Device) {
    let system = system_of(vector);
    let (q, v) = (vector.points("position"), vector.points("velocity"));
    let edit = Edit::default();
    let a = accelerated(&system, [&q, &v], edit, &vec![1.0; 3 * q.len()], device);
    assert_values_close("acceleration", &a[0], &vector.floats("acceleration"), 2e-4, 1e-5);
    let supports = vector.constants["lra"].as_bool().unwrap().then(|| {
        let (indices, k) = vector.indices("neighbours");
        Arc::new(Supports::from_rows(indices, k).unwrap())
    });
    let call = RolloutCall {
        config: system.config,
        dt: vector.number("dt") as f32,
        steps: vector.number("steps") as usize,
        last_dt: None,
        edit,
        supports,
        velocity_policy: VelocityPolicy::Keep,
    };
    let of_position = |w: &[f32; 3]| [w[0], w[1], w[2], 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    let weight: Vec<f32> = vector.points("loss_weight").iter().flat_map(of_position).collect();
    let run = rolled(&system, [&q, &v], &call, &weight, device);
    let trajectory: Vec<f32> = run[0].as_chunks::<10>().0.iter().flat_map(|s| [s[0], s[1], s[2]]).collect();
    assert_values_close("trajectory", &trajectory, &vector.floats("trajectory"), 2e-4, 1e-4);
    assert_gradient_close("position", &run[2], &vector.floats("grad_position"));
    assert_gradient_close("velocity", &run[3], &vector.floats("grad_velocity"));
    for entry in system.layout() {
        let expected = vector.floats(&format!("grad_{}", entry.name));
        assert_gradient_close(&format!("{} {}", vector.name, entry.name), &run[1][entry.range], &expected);
    }
}
