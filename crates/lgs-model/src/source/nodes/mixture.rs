//! How a Gaussian's nodes are mixed: their weights and turns, and back.
//!
//! The weight of a node with share s = σ(logit) and radius r for a Gaussian at distance d in space and e in
//! features is u = s exp(−½ (d²/r² + e²)) + 10⁻⁷, divided by the sum over the Gaussian's nodes. The
//! distance in space is a constant.

use lgs_core::linear::{Mat3, matrix_from_quat};

use crate::source::config::{DELTAS, MAX_NEIGHBORS};

use super::node::{FEATURES, NODE, Node};

/// Weight of any node before division, so that a Gaussian far from all of them still follows.
pub(super) const LEAST_WEIGHT: f32 = 1e-7;

/// A node at a time.
#[derive(Clone, Copy, Debug)]
pub(super) struct Carrier {
    pub(super) node: Node,
    pub(super) share: f32,
    by_radius: f32,
    /// Its position at the time.
    pub(super) moved: [f32; 3],
    /// Its rotation since the canonical state, as unit quaternion and as matrix.
    pub(super) turn: [f32; 4],
    pub(super) matrix: Mat3,
    /// Length of the quaternion before it was normalised.
    pub(super) length: f32,
}

impl Carrier {
    pub(super) fn new(node: &[f32; NODE], pose: &[f32; DELTAS]) -> Self {
        let [x, y, z, a, b, c, d, ..] = *pose;
        let (node, raw) = (Node::of(node), [a, b, c, d]);
        let length = raw.iter().map(|v| v * v).sum::<f32>().sqrt().max(1e-12);
        let turn = raw.map(|v| v / length);
        Self {
            node,
            share: node.share(),
            by_radius: (-2.0 * node.log_radius).exp(),
            moved: [x, y, z],
            turn,
            matrix: matrix_from_quat(turn),
            length,
        }
    }

    /// Squared distance in space, in radii, and the fall of the weight with both distances.
    fn fall(&self, mean: [f32; 3], features: [f32; FEATURES]) -> (f32, f32) {
        let (mut in_space, mut in_features) = (0.0, 0.0);
        for i in 0..3 {
            in_space += (mean[i] - self.node.position[i]).powi(2);
            in_features += (features[i] - self.node.features[i]).powi(2);
        }
        in_space *= self.by_radius;
        (in_space, (-0.5 * (in_space + in_features)).exp())
    }
}

/// Weights of a Gaussian's nodes; entries beyond their number are zero.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Mixture {
    /// Weights, of sum 1.
    pub(super) weights: [f32; MAX_NEIGHBORS],
    /// Falls of the weights with the distance.
    falls: [f32; MAX_NEIGHBORS],
    /// Squared distances in space, in radii.
    distances: [f32; MAX_NEIGHBORS],
    /// Sum of the weights before division.
    total: f32,
}

impl Mixture {
    /// The mixture of some nodes for a Gaussian.
    #[inline]
    pub(super) fn new(
        carriers: &[Carrier],
        nodes: &[u32],
        mean: [f32; 3],
        features: [f32; FEATURES],
    ) -> Self {
        let mut mixture = Self::default();
        for (k, &node) in nodes.iter().enumerate() {
            let carrier = &carriers[node as usize];
            (mixture.distances[k], mixture.falls[k]) = carrier.fall(mean, features);
            mixture.weights[k] = carrier.share * mixture.falls[k] + LEAST_WEIGHT;
            mixture.total += mixture.weights[k];
        }
        mixture.weights.iter_mut().for_each(|weight| *weight /= mixture.total);
        mixture
    }

    /// Cotangents of (logarithm of the radius, logit, fall's argument by features) of each node, given those
    /// of the weights: the last one times the difference of features is that of a feature.
    #[inline]
    pub(super) fn vjp(
        &self,
        carriers: &[Carrier],
        nodes: &[u32],
        v_weights: &[f32; MAX_NEIGHBORS],
    ) -> [[f32; 3]; MAX_NEIGHBORS] {
        let along: f32 = self.weights.iter().zip(v_weights).map(|(w, v)| w * v).sum();
        let mut cotangents = [[0.0; 3]; MAX_NEIGHBORS];
        for (k, &node) in nodes.iter().enumerate() {
            let share = carriers[node as usize].share;
            let v = (v_weights[k] - along) / self.total * self.falls[k] * share;
            cotangents[k] = [v * self.distances[k], v * (1.0 - share), v];
        }
        cotangents
    }
}
