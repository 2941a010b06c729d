//! Control nodes on a device of Vulkan, Metal or DX12 (feature `gpu`), against the processor.
#![cfg(feature = "gpu")]

use burn::tensor::{Device, Tensor, TensorData};
use lgs_core::GaussianCloud;
use lgs_core::testing::{assert_gradient_close, assert_values_close};
use lgs_model::TensorFile;
use lgs_model::source::nodes::neighbors::Neighbors;
use lgs_model::source::nodes::node::{FEATURES, NODE, Node};
use lgs_model::source::nodes::tensor::{Followers, blend};
use lgs_model::source::{
    Captured, DELTAS, DeformationConfig, InputFrame, Learned, Moment, MotionConfig, NodesConfig, SourceKind,
};
use lgs_tensor::cube::device_for_tests;

fn wave(i: usize, f: f32) -> f32 {
    (i as f32 * f).sin()
}

fn waves(count: usize, f: f32) -> Vec<f32> {
    (0..count).map(|i| wave(i, f)).collect()
}

fn leaf(values: &[f32], width: usize, device: &Device) -> Tensor<2> {
    let shape = [values.len() / width, width];
    Tensor::from_data(TensorData::new(values.to_vec(), shape), device).require_grad()
}

fn values<const D: usize>(tensor: Tensor<D>) -> Vec<f32> {
    tensor.into_data().try_to_vec::<f32>().expect("f32 values")
}

/// Some nodes with their poses, as rows.
fn nodes(count: usize) -> (Vec<[f32; NODE]>, Vec<f32>) {
    let node = |i: usize| Node {
        position: [wave(i, 1.7), wave(i, 0.9), wave(i, 2.3)],
        log_radius: -0.7 + 0.3 * wave(i, 0.4),
        logit: wave(i, 3.1),
        features: [wave(i, 0.8), wave(i, 1.3), 0.2],
    };
    ((0..count).map(|i| node(i).row()).collect(), waves(count * DELTAS, 0.77))
}

/// Pose rows of `n` Gaussians, and gradients by nodes, their poses, centres, quaternions and features.
fn run(count: usize, n: usize, followed: usize, device: &Device) -> [Vec<f32>; 6] {
    let (nodes, poses) = nodes(count);
    let (means, features) = (waves(3 * n, 0.7), waves(FEATURES * n, 0.3));
    let neighbors = Neighbors::search(&nodes, means.as_chunks().0, features.as_chunks().0, followed);
    let leaves = [
        leaf(nodes.as_flattened(), NODE, device),
        leaf(&poses, DELTAS, device),
        leaf(&means, 3, device),
        leaf(&waves(4 * n, 1.3), 4, device),
        leaf(&features, FEATURES, device),
    ];
    let [nodes, poses, means, rotations, features] = leaves.clone();
    let out = blend(nodes, poses, Followers { means, rotations, features }, &neighbors);
    let weights = Tensor::<2>::from_data(TensorData::new(waves(DELTAS * n, 0.9), [n, DELTAS]), device);
    let grads = (out.clone() * weights).sum().backward();
    let mut found = vec![values(out)];
    found.extend(leaves.iter().map(|leaf| values(leaf.grad(&grads).expect("a gradient"))));
    found.try_into().expect("six")
}

#[test]
fn the_blend_and_its_gradients_are_those_of_the_processor() {
    let Some(device) = device_for_tests() else { return };
    for (count, n, followed) in [(30, 700, 4), (12, 130, 8), (3, 33, 1), (2, 5, 3)] {
        let found = run(count, n, followed, &device.clone().autodiff());
        let expected = run(count, n, followed, &Device::flex().autodiff());
        let name = format!("{n} Gaussians that follow {followed} of {count}");
        assert_values_close(&name, &found[0], &expected[0], 1e-4, 1e-5);
        for (found, expected) in found.iter().zip(&expected).skip(1) {
            assert_gradient_close(&name, found, expected);
        }
        let again = run(count, n, followed, &device.clone().autodiff());
        assert!(found == again, "{name}: the same bytes twice");
    }
}

/// The discord that a motion of nodes has summed on a device, as it writes it to a checkpoint.
fn discord(device: &Device) -> Vec<f32> {
    let deformation = DeformationConfig::quick();
    let nodes = NodesConfig { initial: 6, most: 8, ..NodesConfig::quick() };
    let config =
        MotionConfig { deformation: &deformation, velocity: None, advection: None, nodes: Some(&nodes) };
    let captured = Captured { frame: InputFrame::IDENTITY, time_window: 1.0, seed: 3 };
    let mut motion = SourceKind::Nodes.motion(&config, captured).expect("a motion");
    let n = 60;
    let cloud = GaussianCloud::isotropic(waves(3 * n, 0.7).as_chunks().0.to_vec(), 0.1, [0.4; 3], 0.9);
    let features = motion.fresh_features(&cloud);
    let learned = Learned { cloud, features, parameters: motion.init(3) };
    motion.adapt(&learned, Moment { time: 0.2, iteration: 1, window_end: 0.5 }).expect("nodes");
    let mut file = TensorFile::new("test/1");
    for step in 0..3 {
        let gradients = waves(3 * n, 0.2 + 0.3 * step as f32);
        motion.observe(&Tensor::from_data(TensorData::new(gradients, [n, 3]), device));
        motion.insert_into(&mut file);
    }
    file.values("nodes.discord").expect("discord").1.to_vec()
}

#[test]
fn the_discord_of_nodes_is_that_of_the_processor() {
    let Some(device) = device_for_tests() else { return };
    let (found, expected) = (discord(&device), discord(&Device::flex()));
    assert!(expected.len() == 6 && expected.iter().any(|&d| d > 0.1), "{expected:?}");
    assert_values_close("discord", &found, &expected, 1e-4, 1e-5);
}
