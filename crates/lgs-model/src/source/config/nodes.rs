//! Settings of motion on sparse control nodes.

use serde::{Deserialize, Serialize};

use super::ranges::within;

/// Most nodes that a Gaussian may follow.
pub(in crate::source) const MAX_NEIGHBORS: usize = 8;

/// Control nodes: how many there are, how Gaussians follow them, and the priors of their motion
/// (method §3.6).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct NodesConfig {
    /// Nodes that the warm-up's Gaussians are given (SC-GS: 512).
    pub initial: usize,
    /// Most nodes; more are added where Gaussians of one node want to move apart.
    pub most: usize,
    /// Nodes that a Gaussian follows (SC-GS: 3).
    pub neighbors: usize,
    /// Iterations after which nodes are chosen and looked for anew.
    pub interval: usize,
    /// Nodes are chosen before this iteration; later ones would have too little time to find their place.
    pub chosen_before: usize,
    /// Weight of the mean squared relative error with which the frame of a node carries its neighbours
    /// (SC-GS: 1e-4 to 1e-5 of a sum).
    pub rigidity: f32,
    /// Factor by which that weight has fallen when nodes are chosen for the last time, log-linearly (SC-GS:
    /// 0.1; 1: it stays). Stiff at first, nodes find the motion of large parts; then the rest may follow.
    pub rigidity_decay: f32,
    /// Neighbours of a node that its frame is to carry (SC-GS: 10).
    pub rigidity_neighbors: usize,
    /// Relative error beyond which two nodes are taken to belong to two bodies and pull less and less.
    pub robust_scale: f32,
    /// Weight of the mean squared acceleration of nodes, in half extents of the scene per unit of time
    /// squared. A swinging pendulum's is about 1000: a weight of 1e-5 costs as much as the images do, and
    /// keeps the nodes from following it.
    pub acceleration: f32,
}

impl Default for NodesConfig {
    fn default() -> Self {
        Self::quick()
    }
}

impl NodesConfig {
    /// Values for a training of minutes on two CPU cores.
    #[must_use]
    pub fn quick() -> Self {
        Self {
            initial: 256,
            most: 512,
            neighbors: 4,
            interval: 100,
            chosen_before: 2000,
            rigidity: 1.0,
            rigidity_decay: 1.0,
            rigidity_neighbors: 6,
            robust_scale: 0.1,
            acceleration: 1e-7,
        }
    }

    /// The published numbers of nodes and neighbours.
    #[must_use]
    pub fn paper() -> Self {
        let (initial, most, neighbors) = (512, 512, 3);
        Self { initial, most, neighbors, chosen_before: 25_000, rigidity_neighbors: 10, ..Self::quick() }
    }

    /// Weight of the rigidity at an iteration.
    #[must_use]
    pub fn rigidity_at(&self, iteration: usize) -> f32 {
        let passed = iteration as f32 / self.chosen_before.max(1) as f32;
        self.rigidity * self.rigidity_decay.powf(passed.min(1.0))
    }

    /// Checks the values; a refusal is (field, reason).
    ///
    /// # Errors
    /// The first value out of range.
    pub fn validate(&self) -> Result<(), (&'static str, String)> {
        within(&[
            ("rigidity", self.rigidity, 0.0, f32::MAX),
            ("rigidity_decay", self.rigidity_decay, f32::MIN_POSITIVE, 1.0),
            ("robust_scale", self.robust_scale, f32::MIN_POSITIVE, f32::MAX),
            ("acceleration", self.acceleration, 0.0, f32::MAX),
        ])?;
        within(&[
            ("most", self.most, 1, 4096),
            ("initial", self.initial, 1, self.most),
            ("neighbors", self.neighbors, 1, MAX_NEIGHBORS),
            ("interval", self.interval, 1, usize::MAX),
            ("rigidity_neighbors", self.rigidity_neighbors, 1, 64),
        ])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rigidity_falls_while_nodes_are_chosen() {
        let config = NodesConfig { rigidity: 2.0, rigidity_decay: 0.1, ..NodesConfig::quick() };
        let at = |part: f32| config.rigidity_at((part * config.chosen_before as f32) as usize);
        assert_eq!(at(0.0), 2.0);
        assert!((at(0.5) - 2.0 * 0.1_f32.sqrt()).abs() < 1e-5);
        assert!((at(1.0) - 0.2).abs() < 1e-6 && at(3.0) == at(1.0));
        assert_eq!(NodesConfig::quick().rigidity_at(500), NodesConfig::quick().rigidity, "it stays");
        assert!(NodesConfig { rigidity_decay: 0.0, ..config }.validate().is_err());
    }
}
