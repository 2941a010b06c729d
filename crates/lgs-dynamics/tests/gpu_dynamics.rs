//! Accelerations and rollouts on a device of Vulkan, Metal or DX12 (feature `gpu`), against the processor and
//! the conformance vectors.
#![cfg(feature = "gpu")]

mod support;

use std::sync::Arc;

use burn::tensor::Device;
use lgs_core::testing::{assert_gradient_close, assert_values_close};
use lgs_dynamics::tensor::RolloutCall;
use lgs_dynamics::{Edit, ForceKind, PotentialKind, Supports, System, SystemConfig};
use lgs_tensor::cube::device_for_tests;
use support::devices::{accelerated, assert_close, rolled};
use support::rollouts::{Case, EDIT, call_of, cases, free_call, weights};
use support::{Vector, lively_system, random_points, system_of, vectors};

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
    for (hidden, hidden_layers) in [(1, 1), (6, 4), (33, 1), (130, 2)] {
        let lively = lively_system(PotentialKind::QuadraticMlp, ForceKind::Mlp);
        let config = SystemConfig { hidden, hidden_layers, ..lively.config };
        let params = weights(config.parameters(), 7);
        let system = System { config, params };
        let on = |device: &Device| accelerated(&system, [&q, &v], EDIT, &weight, device);
        assert_close(&format!("{hidden_layers} of {hidden}"), &on(&device), &on(&Device::flex()), 1);
    }
}

#[test]
fn rollouts_are_those_of_the_processor() {
    let Some(device) = device_for_tests() else { return };
    let (q, v) = (random_points(70, 0.6, 1), random_points(70, 0.5, 2));
    let weight = weights(6 * 70 * 10, 9);
    // Beside the others, one support that all share.
    let shared = Some(Arc::new(Supports::shared(&[0, 3, 5, 8, 13, 21], q.len())));
    let cases = cases(&q);
    let of_shared = [1, 5].map(|i: usize| Case { supports: shared.clone(), ..cases[i].clone() });
    for case in cases.iter().chain(&of_shared) {
        let (name, system) = (case.name(), lively_system(case.potential, case.force));
        let call = case.call(&system);
        let on = |device: &Device| rolled(&system, [&q, &v], &call, &weight, device);
        let found = on(&device);
        assert_close(&name, &found, &on(&Device::flex()), 1);
        assert!(found == on(&device), "{name}: the same bytes twice");
    }
}

#[test]
fn more_particles_than_are_evaluated_at_a_time_are_those_of_the_processor() {
    let Some(device) = device_for_tests() else { return };
    let (n, normalisation) = (4101, lively_system(PotentialKind::Mlp, ForceKind::Mlp).config.normalisation);
    let config = SystemConfig { hidden: 64, hidden_layers: 16, normalisation, ..SystemConfig::paper() };
    let params = weights(config.parameters(), 7).into_iter().map(|value| 0.2 * value).collect();
    let system = System { config, params };
    let (q, v, weight) = (random_points(n, 0.6, 1), random_points(n, 0.5, 2), weights(2 * n * 10, 9));
    for supports in [None, Some(Arc::new(Supports::nearest(&q, 8)))] {
        let call = RolloutCall { supports, ..free_call(&system, 1) };
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
        let call = free_call(&system, steps);
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
    let a = accelerated(&system, [&q, &v], Edit::default(), &vec![1.0; 3 * q.len()], device);
    assert_values_close("acceleration", &a[0], &vector.floats("acceleration"), 2e-4, 1e-5);
    let call = call_of(vector, &system);
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
