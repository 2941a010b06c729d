//! Gaussians carried by the nodes that they follow, as one operation on slices, and back (method §3.6).
//!
//! A node k at p_k that is at p'_k and turned by A_k carries x to A_k (x − p_k) + p'_k; a Gaussian is where
//! its nodes carry it on average, and turned by the average of their quaternions, whose signs are those of
//! the heaviest node. Positions of nodes are constants, and distances in the weights see centres as
//! constants, so that gradients reach a Gaussian's centre through the nodes' frames alone.
//!
//! Gaussians run in blocks of fixed size, each with its own sums over nodes; these are added in order.

use lgs_core::linear::{add, mat_vec, quat_conjugate, quat_mul, sub};
use rayon::prelude::*;

use crate::source::config::{DELTAS, MAX_NEIGHBORS};

use super::mixture::{Carrier, Mixture};
use super::neighbors::Neighbors;
use super::node::{FEATURES, NODE};
use super::sums::{NodeSums, unit_vjp};

/// Gaussians per block.
const BLOCK: usize = 1024;

/// Nodes at a time and the Gaussians that follow them.
#[derive(Clone, Copy)]
pub struct BlendInput<'a> {
    /// Rows of nodes `[m]`.
    pub nodes: &'a [[f32; NODE]],
    /// Their poses `[x', q', unused]`, `[m]`.
    pub poses: &'a [[f32; DELTAS]],
    /// Canonical centres `[n]`, world units.
    pub means: &'a [[f32; 3]],
    /// Canonical quaternions `[n]`, of any length but zero.
    pub rotations: &'a [[f32; 4]],
    /// Features of Gaussians `[n]`.
    pub features: &'a [[f32; FEATURES]],
    /// Nodes of every Gaussian.
    pub neighbors: &'a Neighbors,
}

/// Gradients by nodes and Gaussians.
#[derive(Clone, Debug, PartialEq)]
pub struct BlendGradients {
    /// By the rows of nodes, zero by their positions.
    pub nodes: Vec<[f32; NODE]>,
    /// By their poses.
    pub poses: Vec<[f32; DELTAS]>,
    /// By centres.
    pub means: Vec<[f32; 3]>,
    /// By quaternions.
    pub rotations: Vec<[f32; 4]>,
    /// By features of Gaussians.
    pub features: Vec<[f32; FEATURES]>,
}

impl<'a> BlendInput<'a> {
    fn check(&self) {
        let n = self.means.len();
        let found = (self.rotations.len(), self.features.len(), self.neighbors.indices.len());
        assert_eq!(found, (n, n, n * self.neighbors.row), "Gaussians that follow nodes");
        assert_eq!(self.nodes.len(), self.poses.len(), "nodes and their poses");
        assert!(self.neighbors.row <= MAX_NEIGHBORS, "{} nodes of a Gaussian", self.neighbors.row);
    }

    fn carriers(&self) -> Vec<Carrier> {
        self.nodes.iter().zip(self.poses).map(|(node, pose)| Carrier::new(node, pose)).collect()
    }

    fn follower(&self, i: usize) -> Follower<'a> {
        let row = self.neighbors.row;
        Follower {
            mean: self.means[i],
            rotation: self.rotations[i],
            features: self.features[i],
            nodes: &self.neighbors.indices[i * row..(i + 1) * row],
        }
    }
}

/// Pose rows `[x', q', 0]` of Gaussians; without nodes their own.
///
/// # Panics
/// If lengths do not fit.
#[must_use]
pub fn blend(input: BlendInput<'_>) -> Vec<[f32; DELTAS]> {
    input.check();
    let carriers = input.carriers();
    (0..input.means.len())
        .into_par_iter()
        .with_min_len(BLOCK)
        .map(|i| input.follower(i).pose(&carriers))
        .collect()
}

/// Gradients of [`blend`], given those by its rows.
///
/// # Panics
/// If lengths do not fit.
#[must_use]
pub fn blend_vjp(input: BlendInput<'_>, v_poses: &[[f32; DELTAS]]) -> BlendGradients {
    input.check();
    let n = input.means.len();
    assert_eq!(v_poses.len(), n, "Gaussians and cotangents");
    let carriers = input.carriers();
    let (mut means, mut rotations, mut features) = (vec![[0.0; 3]; n], vec![[0.0; 4]; n], vec![[0.0; 3]; n]);
    let blocks = means.par_chunks_mut(BLOCK).zip(rotations.par_chunks_mut(BLOCK));
    let blocks = blocks.zip(features.par_chunks_mut(BLOCK)).zip(v_poses.par_chunks(BLOCK)).enumerate();
    let partials: Vec<Vec<NodeSums>> = blocks
        .map(|(block, (((means, rotations), features), v_poses))| {
            let mut sums = vec![NodeSums::default(); carriers.len()];
            for (j, v_pose) in v_poses.iter().enumerate() {
                let follower = input.follower(block * BLOCK + j);
                (means[j], rotations[j], features[j]) = follower.vjp(&carriers, v_pose, &mut sums);
            }
            sums
        })
        .collect();
    let mut sums = vec![NodeSums::default(); carriers.len()];
    for partial in &partials {
        sums.iter_mut().zip(partial).for_each(|(sum, part)| sum.add(part));
    }
    let (nodes, poses) = carriers.iter().zip(&sums).map(|(carrier, sums)| sums.rows(carrier)).unzip();
    BlendGradients { nodes, poses, means, rotations, features }
}

/// A Gaussian and its nodes.
struct Follower<'a> {
    mean: [f32; 3],
    rotation: [f32; 4],
    features: [f32; FEATURES],
    nodes: &'a [u32],
}

/// The average turn of a Gaussian's nodes.
struct AverageTurn {
    unit: [f32; 4],
    length: f32,
    /// Signs that the nodes' quaternions had to take.
    signs: [f32; MAX_NEIGHBORS],
}

impl Follower<'_> {
    /// Its quaternion as a unit one, and the length it had.
    fn unit(&self) -> ([f32; 4], f32) {
        let length = self.rotation.iter().map(|v| v * v).sum::<f32>().sqrt().max(1e-12);
        (self.rotation.map(|v| v / length), length)
    }

    #[inline]
    fn turn(&self, carriers: &[Carrier], mixture: &Mixture) -> AverageTurn {
        let first = carriers[self.nodes[0] as usize].turn;
        let (mut sum, mut signs) = ([0.0; 4], [1.0; MAX_NEIGHBORS]);
        for (k, &node) in self.nodes.iter().enumerate() {
            let turn = carriers[node as usize].turn;
            if (0..4).map(|i| turn[i] * first[i]).sum::<f32>() < 0.0 {
                signs[k] = -1.0;
            }
            (0..4).for_each(|i| sum[i] += mixture.weights[k] * signs[k] * turn[i]);
        }
        let length = sum.iter().map(|v| v * v).sum::<f32>().sqrt().max(1e-12);
        AverageTurn { unit: sum.map(|v| v / length), length, signs }
    }

    #[inline]
    fn pose(&self, carriers: &[Carrier]) -> [f32; DELTAS] {
        let (unit, _) = self.unit();
        let (mut x, mut q) = (self.mean, unit);
        if !self.nodes.is_empty() {
            let mixture = Mixture::new(carriers, self.nodes, self.mean, self.features);
            x = [0.0; 3];
            for (k, &node) in self.nodes.iter().enumerate() {
                let carried = carried(&carriers[node as usize], self.mean);
                (0..3).for_each(|i| x[i] += mixture.weights[k] * carried[i]);
            }
            q = quat_mul(self.turn(carriers, &mixture).unit, unit);
        }
        [x[0], x[1], x[2], q[0], q[1], q[2], q[3], 0.0, 0.0, 0.0]
    }

    /// Cotangents of centre, quaternion and features; those of the nodes are added to their sums.
    #[inline]
    fn vjp(
        &self,
        carriers: &[Carrier],
        v_pose: &[f32; DELTAS],
        sums: &mut [NodeSums],
    ) -> ([f32; 3], [f32; 4], [f32; FEATURES]) {
        let [x, y, z, a, b, c, d, ..] = *v_pose;
        let (v_x, v_q, (unit, length)) = ([x, y, z], [a, b, c, d], self.unit());
        if self.nodes.is_empty() {
            return (v_x, unit_vjp(unit, length, v_q), [0.0; FEATURES]);
        }
        let mixture = Mixture::new(carriers, self.nodes, self.mean, self.features);
        let turn = self.turn(carriers, &mixture);
        let v_sum = unit_vjp(turn.unit, turn.length, quat_mul(v_q, quat_conjugate(unit)));
        let v_rotation = unit_vjp(unit, length, quat_mul(quat_conjugate(turn.unit), v_q));
        let (mut v_mean, mut v_weights) = ([0.0; 3], [0.0; MAX_NEIGHBORS]);
        for (k, &node) in self.nodes.iter().enumerate() {
            let (carrier, sums) = (&carriers[node as usize], &mut sums[node as usize]);
            let (weight, from_node) = (mixture.weights[k], sub(self.mean, carrier.node.position));
            let place = add(mat_vec(&carrier.matrix, from_node), carrier.moved);
            let (mut by_place, mut by_turn) = (0.0, 0.0);
            for i in 0..3 {
                let v = weight * v_x[i];
                by_place += v_x[i] * place[i];
                sums.moved[i] += v;
                for j in 0..3 {
                    sums.matrix[i][j] += v * from_node[j];
                    v_mean[j] += v * carrier.matrix[i][j];
                }
            }
            for (i, v) in v_sum.iter().enumerate() {
                by_turn += v * carrier.turn[i];
                sums.turn[i] += weight * turn.signs[k] * v;
            }
            v_weights[k] = by_place + turn.signs[k] * by_turn;
        }
        (v_mean, v_rotation, self.weights_vjp(carriers, &mixture, &v_weights, sums))
    }

    /// Cotangents of the features, given those of the weights; the nodes' are added to their sums.
    #[inline]
    fn weights_vjp(
        &self,
        carriers: &[Carrier],
        mixture: &Mixture,
        v_weights: &[f32; MAX_NEIGHBORS],
        sums: &mut [NodeSums],
    ) -> [f32; FEATURES] {
        let cotangents = mixture.vjp(carriers, self.nodes, v_weights);
        let mut v_features = [0.0; FEATURES];
        for (&node, [v_radius, v_logit, v_fall]) in self.nodes.iter().zip(cotangents) {
            let (carrier, sums) = (&carriers[node as usize], &mut sums[node as usize]);
            sums.log_radius += v_radius;
            sums.logit += v_logit;
            for (i, v_feature) in v_features.iter_mut().enumerate() {
                let v = v_fall * (self.features[i] - carrier.node.features[i]);
                sums.features[i] += v;
                *v_feature -= v;
            }
        }
        v_features
    }
}

/// Where a node carries a point.
#[inline]
fn carried(carrier: &Carrier, point: [f32; 3]) -> [f32; 3] {
    add(mat_vec(&carrier.matrix, sub(point, carrier.node.position)), carrier.moved)
}
