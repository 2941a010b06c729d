//! Cotangents of a node, summed over the Gaussians that follow it.

use super::mixture::Carrier;
use super::node::{FEATURES, NODE};
use crate::source::config::DELTAS;

/// Sums of cotangents of a node over Gaussians.
#[derive(Clone, Copy, Default)]
pub(super) struct NodeSums {
    pub(super) matrix: [[f32; 3]; 3],
    pub(super) moved: [f32; 3],
    pub(super) turn: [f32; 4],
    pub(super) log_radius: f32,
    pub(super) logit: f32,
    pub(super) features: [f32; FEATURES],
}

impl NodeSums {
    pub(super) fn add(&mut self, other: &Self) {
        for i in 0..3 {
            for j in 0..3 {
                self.matrix[i][j] += other.matrix[i][j];
            }
            self.moved[i] += other.moved[i];
            self.features[i] += other.features[i];
        }
        self.turn.iter_mut().zip(other.turn).for_each(|(a, b)| *a += b);
        self.log_radius += other.log_radius;
        self.logit += other.logit;
    }

    /// Cotangents of the node's row and of its pose.
    pub(super) fn rows(&self, carrier: &Carrier) -> ([f32; NODE], [f32; DELTAS]) {
        let from_matrix = matrix_vjp(carrier.turn, &self.matrix);
        let v_turn: [f32; 4] = std::array::from_fn(|i| self.turn[i] + from_matrix[i]);
        let [a, b, c, d] = unit_vjp(carrier.turn, carrier.length, v_turn);
        let ([x, y, z], [f, g, h]) = (self.moved, self.features);
        ([0.0, 0.0, 0.0, self.log_radius, self.logit, f, g, h], [x, y, z, a, b, c, d, 0.0, 0.0, 0.0])
    }
}

/// The cotangent of a vector that was divided by its length, given that of the unit vector.
pub(super) fn unit_vjp(unit: [f32; 4], length: f32, v: [f32; 4]) -> [f32; 4] {
    let along: f32 = (0..4).map(|i| unit[i] * v[i]).sum();
    std::array::from_fn(|i| (v[i] - unit[i] * along) / length)
}

/// The cotangent of a unit quaternion, given that of its rotation matrix.
fn matrix_vjp([w, x, y, z]: [f32; 4], v: &[[f32; 3]; 3]) -> [f32; 4] {
    let odd = [v[2][1] - v[1][2], v[0][2] - v[2][0], v[1][0] - v[0][1]];
    let even = [v[2][1] + v[1][2], v[0][2] + v[2][0], v[1][0] + v[0][1]];
    [
        2.0 * (x * odd[0] + y * odd[1] + z * odd[2]),
        2.0 * (w * odd[0] + y * even[2] + z * even[1] - 2.0 * x * (v[1][1] + v[2][2])),
        2.0 * (w * odd[1] + x * even[2] + z * even[0] - 2.0 * y * (v[0][0] + v[2][2])),
        2.0 * (w * odd[2] + x * even[1] + y * even[0] - 2.0 * z * (v[0][0] + v[1][1])),
    ]
}
