//! The blend of nodes against its twin, against finite differences, against numbers worked out by hand, and
//! on several threads.

use burn::tensor::{Device, Tensor, TensorData};
use lgs_core::testing::{assert_gradient_close, assert_values_close};

use super::blend::{BlendGradients, BlendInput, blend, blend_vjp};
use super::neighbors::Neighbors;
use super::node::{FEATURES, NODE, Node};
use super::{reference, tensor};
use crate::source::config::DELTAS;
use crate::source::testing::{gaussians, weights};

/// Nodes, their poses, Gaussians and whom they follow.
struct Scene {
    nodes: Vec<[f32; NODE]>,
    poses: Vec<[f32; DELTAS]>,
    means: Vec<[f32; 3]>,
    rotations: Vec<[f32; 4]>,
    features: Vec<[f32; FEATURES]>,
    neighbors: Neighbors,
}

fn wave(i: usize, f: f32) -> f32 {
    (i as f32 * f).sin()
}

impl Scene {
    fn new(nodes: usize, gaussian_count: usize, followed: usize) -> Self {
        let node = |i: usize| Node {
            position: [wave(i, 1.7), wave(i, 0.9), wave(i, 2.3)],
            log_radius: -0.7 + 0.3 * wave(i, 0.4),
            logit: wave(i, 3.1),
            features: [wave(i, 0.8), wave(i, 1.3), 0.2],
        };
        let pose = |i: usize| {
            let quaternion = [wave(i, 0.31) + 0.3, wave(i, 0.77), wave(i, 0.53), 0.8 * wave(i, 1.9)];
            let [a, b, c, d] = quaternion.map(|v| v * (1.0 + 0.3 * wave(i, 0.2)));
            [wave(i, 1.6), wave(i, 1.1), wave(i, 2.1), a, b, c, d, 0.0, 0.0, 0.0]
        };
        let (means, rotations) = gaussians(gaussian_count);
        let features: Vec<[f32; 3]> =
            (0..gaussian_count).map(|i| [wave(i, 0.9), wave(i, 0.3), 0.1 * wave(i, 1.4)]).collect();
        let (nodes, poses): (Vec<_>, Vec<_>) = (0..nodes).map(|i| (node(i).row(), pose(i))).unzip();
        let neighbors = Neighbors::search(&nodes, &means, &features, followed);
        Self { nodes, poses, means, rotations, features, neighbors }
    }

    fn input(&self) -> BlendInput<'_> {
        let Self { nodes, poses, means, rotations, features, neighbors } = self;
        BlendInput { nodes, poses, means, rotations, features, neighbors }
    }

    /// Values and the gradients of five inputs, by an operation on tensors.
    fn tensors(&self, run: impl Fn([Tensor<2>; 5]) -> Tensor<2>) -> [Vec<f32>; 6] {
        let device = Device::flex().autodiff();
        let leaf = |values: &[f32], width: usize| {
            let shape = [values.len() / width, width];
            Tensor::<2>::from_data(TensorData::new(values.to_vec(), shape), &device).require_grad()
        };
        let leaves = [
            leaf(self.nodes.as_flattened(), NODE),
            leaf(self.poses.as_flattened(), DELTAS),
            leaf(self.means.as_flattened(), 3),
            leaf(self.rotations.as_flattened(), 4),
            leaf(self.features.as_flattened(), FEATURES),
        ];
        let out = run(leaves.clone());
        let n = self.means.len();
        let cotangents = Tensor::<2>::from_data(TensorData::new(weights(n), [n, DELTAS]), &device);
        let gradients = (out.clone() * cotangents).sum().backward();
        let values = |tensor: Tensor<2>| tensor.into_data().try_to_vec::<f32>().expect("f32");
        let mut found = vec![values(out)];
        found.extend(leaves.iter().map(|leaf| {
            let gradient = leaf.grad(&gradients).expect("a gradient");
            gradient.into_data().try_to_vec::<f32>().expect("f32")
        }));
        found.try_into().expect("six")
    }
}

#[test]
fn the_fused_blend_agrees_with_its_twin() {
    for (nodes, n, followed) in [(3, 2, 2), (5, 40, 3), (40, 2500, 4), (40, 300, 8)] {
        let scene = Scene::new(nodes, n, followed);
        let fused = scene.tensors(|[nodes, poses, means, rotations, features]| {
            let followers = tensor::Followers { means, rotations, features };
            tensor::blend(nodes, poses, followers, &scene.neighbors)
        });
        let plain = scene.tensors(|[nodes, poses, means, rotations, features]| {
            let neighbors = &scene.neighbors;
            reference::blend(reference::ReferenceInput {
                nodes,
                poses,
                means,
                rotations,
                features,
                neighbors,
            })
        });
        assert_values_close("poses", &fused[0], &plain[0], 1e-5, 1e-5);
        for (i, name) in ["nodes", "node poses", "means", "rotations", "features"].into_iter().enumerate() {
            assert_gradient_close(name, &fused[i + 1], &plain[i + 1]);
        }
    }
}

#[test]
fn gradients_are_those_of_finite_differences() {
    let scene = Scene::new(6, 9, 3);
    let cotangents = weights(9);
    let BlendGradients { nodes, poses, rotations, features, .. } =
        blend_vjp(scene.input(), cotangents.as_chunks().0);
    let loss = |scene: &Scene| -> f64 {
        let rows = blend(scene.input());
        rows.as_flattened().iter().zip(&cotangents).map(|(a, b)| f64::from(*a) * f64::from(*b)).sum()
    };
    let check = |name: &str, exact: &[f32], change: &dyn Fn(&mut Scene, usize, f32)| {
        for (i, &exact) in exact.iter().enumerate() {
            let shifted = |h: f32| {
                let mut scene = Scene::new(6, 9, 3);
                change(&mut scene, i, h);
                loss(&scene)
            };
            let numeric = (shifted(2e-3) - shifted(-2e-3)) / 4e-3;
            let bound = 3e-3 * (1.0 + f64::from(exact).abs());
            assert!((numeric - f64::from(exact)).abs() < bound, "{name} {i}: {numeric} {exact}");
        }
    };
    check("rotations", rotations.as_flattened(), &|s, i, h| s.rotations.as_flattened_mut()[i] += h);
    check("features", features.as_flattened(), &|s, i, h| s.features.as_flattened_mut()[i] += h);
    check("node poses", poses.as_flattened(), &|s, i, h| s.poses.as_flattened_mut()[i] += h);
    let attributes: Vec<f32> = nodes.iter().flat_map(|row| row[3..].to_vec()).collect();
    check("nodes", &attributes, &|s, i, h| s.nodes[i / (NODE - 3)][3 + i % (NODE - 3)] += h);
    assert!(nodes.iter().all(|row| row[..3] == [0.0; 3]), "positions of nodes are constants");
}

#[test]
fn a_gaussian_between_two_nodes_is_where_they_carry_it_on_average() {
    let node = |x: f32| Node { position: [x, 0.0, 0.0], log_radius: 0.0, logit: 0.0, features: [0.0; 3] };
    // The first node turns a quarter about z, given as the opposite quaternion; the second moves up by 2.
    let half = 0.5_f32.sqrt();
    let turned = [-1.0, 0.0, 0.0, -half, 0.0, 0.0, -half, 0.0, 0.0, 0.0];
    let lifted = [1.0, 0.0, 2.0, 3.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    let nodes = [node(-1.0).row(), node(1.0).row()];
    let neighbors = Neighbors::search(&nodes, &[[0.0; 3]], &[[0.0; 3]], 2);
    let rows = blend(BlendInput {
        nodes: &nodes,
        poses: &[turned, lifted],
        means: &[[0.0; 3]],
        rotations: &[[2.0, 0.0, 0.0, 0.0]],
        features: &[[0.0; 3]],
        neighbors: &neighbors,
    });
    // (-1, 1, 0) and (0, 0, 2), half each; an eighth of a turn, of the sign of the first.
    let (cos, sin) = (std::f32::consts::FRAC_PI_8.cos(), std::f32::consts::FRAC_PI_8.sin());
    let expected = [-0.5, 0.5, 1.0, -cos, 0.0, 0.0, -sin, 0.0, 0.0, 0.0];
    assert!(rows[0].iter().zip(expected).all(|(a, b): (&f32, f32)| (a - b).abs() < 1e-6), "{:?}", rows[0]);
}

#[test]
fn nodes_of_one_rigid_motion_carry_everything_rigidly() {
    let mut scene = Scene::new(12, 50, 4);
    let quaternion = [0.8, 0.0, 0.6, 0.0];
    let matrix = lgs_core::linear::matrix_from_quat(quaternion);
    let moved = |p: [f32; 3]| lgs_core::linear::add(lgs_core::linear::mat_vec(&matrix, p), [0.3, -1.0, 0.5]);
    for (pose, node) in scene.poses.iter_mut().zip(&scene.nodes) {
        let [x, y, z] = moved(Node::of(node).position);
        *pose = [x, y, z, 0.8, 0.0, 0.6, 0.0, 0.0, 0.0, 0.0];
    }
    for (row, &mean) in blend(scene.input()).iter().zip(&scene.means) {
        assert!((0..3).all(|i| (row[i] - moved(mean)[i]).abs() < 1e-5), "{row:?}");
    }
}

#[test]
fn the_same_bytes_come_from_any_number_of_threads() {
    let scene = Scene::new(64, 5000, 4);
    let cotangents = weights(5000);
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("pool");
        pool.install(|| (blend(scene.input()), blend_vjp(scene.input(), cotangents.as_chunks().0)))
    };
    let one = run(1);
    assert_eq!(one, run(2));
    assert_eq!(one, run(3));
}

#[test]
fn without_nodes_gaussians_stay_and_none_of_them_give_nothing() {
    let mut scene = Scene::new(0, 7, 4);
    let rows = blend(scene.input());
    assert!(rows.iter().zip(&scene.means).all(|(row, mean)| row[..3] == mean[..]));
    let gradients = blend_vjp(scene.input(), weights(7).as_chunks().0);
    assert!(gradients.nodes.is_empty() && gradients.means[0] == weights(7)[..3]);
    scene = Scene::new(3, 0, 4);
    assert!(blend(scene.input()).is_empty());
    assert!(blend_vjp(scene.input(), &[]).poses.iter().flatten().all(|v| *v == 0.0));
}
