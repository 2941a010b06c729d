//! Local rigid alignment on a device of Vulkan, Metal or DX12 (feature `gpu`), against the processor and the
//! conformance vectors.
#![cfg(feature = "gpu")]

mod support;

use std::sync::Arc;

use burn::tensor::Device;
use lgs_core::testing::{assert_gradient_close, assert_values_close};
use lgs_dynamics::Supports;
use lgs_tensor::cube::device_for_tests;
use support::devices::{aligned, assert_close};
use support::rollouts::weights;
use support::{random_points, vectors};

#[test]
fn alignment_passes_conformance() {
    let Some(device) = device_for_tests() else { return };
    for vector in vectors("local_rigid_alignment") {
        let (indices, k) = vector.indices("neighbours");
        let supports = Arc::new(Supports::from_rows(indices, k).unwrap());
        let weights = ["loss_weight_aligned", "loss_weight_rotation"].map(|name| vector.floats(name));
        let [position, candidate] = ["position", "candidate"].map(|name| vector.points(name));
        let run = aligned([&position, &candidate], &supports, weights.each_ref().map(|w| &w[..]), &device);
        assert_values_close("aligned", &run[0], &vector.floats("aligned"), 2e-4, 1e-5);
        assert_values_close("rotation", &run[1], &vector.floats("rotation"), 2e-4, 1e-5);
        assert_gradient_close("position", &run[2], &vector.floats("grad_position"));
        assert_gradient_close("candidate", &run[3], &vector.floats("grad_candidate"));
    }
}

/// Points turned about an axis through a place by an angle, and shaken a little.
fn turned(points: &[[f32; 3]], angle: f32, shaken: f32) -> Vec<[f32; 3]> {
    let (s, c) = angle.sin_cos();
    let shakes = random_points(points.len(), shaken, 5);
    let turn = |(&[x, y, z], shake): (&[f32; 3], &[f32; 3])| {
        [c * x - s * y + shake[0] + 0.3, s * x + c * y + shake[1], z + shake[2] - 0.1]
    };
    points.iter().zip(&shakes).map(turn).collect()
}

#[test]
fn supports_that_turn_by_any_angle_are_those_of_the_processor() {
    let Some(device) = device_for_tests() else { return };
    for (n, k, size) in [(1, 1, 1.0), (90, 12, 1.0), (90, 90, 1.0), (90, 12, 1e-5)] {
        let points: Vec<[f32; 3]> = random_points(n, 0.5 * size, 1);
        let supports = Arc::new(Supports::nearest(&points, k));
        let weights = [weights(3 * n, 3), weights(9 * n, 4)];
        for angle in [0.0, 0.2, 1.6, 2.5, 3.1] {
            let candidates = turned(&points, angle, 0.02 * size);
            let on = |device: &Device| {
                aligned([&points, &candidates], &supports, weights.each_ref().map(|w| &w[..]), device)
            };
            let (name, found) = (format!("{n} particles, {k} members, {size}, {angle}"), on(&device));
            assert_close(&name, &found, &on(&Device::flex()), 2);
            assert!(found == on(&device), "{name}: the same bytes twice");
        }
    }
}

/// A name, positions and candidates.
type Case = (&'static str, Vec<[f32; 3]>, Vec<[f32; 3]>);

/// Flat, reflected, collinear and coincident supports.
fn degenerate() -> Vec<Case> {
    let points = random_points(24, 0.5, 1);
    let flat: Vec<_> = points.iter().map(|&[x, y, _]| [x, y, 0.2]).collect();
    let mirrored = points.iter().map(|&[x, y, z]| [x, y, -z]).collect();
    let line: Vec<_> = (0..24).map(|i| [0.04 * i as f32, 0.02 * i as f32, 0.1]).collect();
    let one = vec![[0.3, 0.1, -0.2]; 24];
    vec![
        ("flat", flat.clone(), turned(&flat, 0.4, 0.0)),
        ("reflected", points.clone(), mirrored),
        ("collinear", line.clone(), turned(&line, 0.4, 0.0)),
        ("collinear, far", line.clone(), turned(&line, 2.9, 0.0)),
        ("coincident", one.clone(), one.clone()),
        ("coincident, spread", one, points),
    ]
}

#[test]
fn degenerate_supports_are_those_of_the_processor() {
    let Some(device) = device_for_tests() else { return };
    for (name, points, candidates) in degenerate() {
        let supports = Arc::new(Supports::from_rows((0..24).collect::<Vec<u32>>().repeat(24), 24).unwrap());
        let weights = [weights(72, 3), weights(216, 4)];
        let on = |device: &Device| {
            aligned([&points, &candidates], &supports, weights.each_ref().map(|w| &w[..]), device)
        };
        assert_close(name, &on(&device), &on(&Device::flex()), 2);
    }
}

#[test]
fn thin_supports_are_aligned_as_on_the_processor() {
    let Some(device) = device_for_tests() else { return };
    for width in [1e-1, 1e-2, 1e-3] {
        let points = random_points(40, 0.5, 1);
        let thin: Vec<_> = points.iter().map(|&[x, y, z]| [x + 20.0, width * y, width * z]).collect();
        let candidates = turned(&thin, 0.3, 0.0);
        let supports = Arc::new(Supports::nearest(&thin, 12));
        let weights = [weights(120, 3), weights(360, 4)];
        let on = |device: &Device| {
            aligned([&thin, &candidates], &supports, weights.each_ref().map(|w| &w[..]), device)
        };
        assert_close(&format!("width {width}"), &on(&device), &on(&Device::flex()), 2);
    }
}

#[test]
fn a_particle_that_left_the_numbers_leaves_the_others_alone() {
    let Some(device) = device_for_tests() else { return };
    let mut points = random_points(12, 0.5, 1);
    let mut candidates = turned(&points, 0.3, 0.0);
    let supports = Arc::new(
        Supports::from_rows([[0, 1, 2, 3]; 11].concat().into_iter().chain([11; 4]).collect(), 4).unwrap(),
    );
    let weights = [weights(36, 3), weights(108, 4)];
    let on = |points: &[[f32; 3]], candidates: &[[f32; 3]]| {
        aligned([points, candidates], &supports, weights.each_ref().map(|w| &w[..]), &device)
    };
    let expected = on(&points, &candidates);
    (points[11], candidates[11]) = ([f32::NAN; 3], [f32::INFINITY; 3]);
    let found = on(&points, &candidates);
    for (found, expected) in found.iter().zip(&expected) {
        let others = found.len() / 12 * 11;
        assert!(found[..others] == expected[..others]);
    }
}
