//! Scenes whose motion is known in closed form, and their truth.

use lgs_core::GaussianCloud;
use lgs_data::synth::GroundTruth;
use lgs_dynamics::testing::quadratic;
use lgs_dynamics::{Supports, System};
use lgs_model::LagrangianScene;
use lgs_model::testing::particles;

/// Acceleration of a fall, downward.
pub(crate) const GRAVITY: f32 = 2.0;

/// A 5×5×5 block of Gaussians around a centre.
pub(crate) fn block(center: [f32; 3]) -> Vec<[f32; 3]> {
    let at = |i: usize, c: usize| center[c] + 0.1 * (i as f32 - 2.0);
    (0..125).map(|i| [at(i % 5, 0), at(i / 5 % 5, 1), at(i / 25, 2)]).collect()
}

pub(crate) fn scene(
    means: Vec<[f32; 3]>,
    velocity: impl Fn([f32; 3]) -> [f32; 3],
    system: System,
    neighbors: usize,
) -> LagrangianScene {
    let supports = (neighbors > 0).then(|| Supports::nearest(&means, neighbors + 1));
    let velocities = means.iter().map(|&q| velocity(q)).collect();
    particles(GaussianCloud::isotropic(means, 0.04, [0.8, 0.3, 0.1], 0.95), velocities, system, supports)
}

pub(crate) fn falling(neighbors: usize) -> LagrangianScene {
    scene(block([0.0, 0.0, 1.5]), |_| [0.0; 3], quadratic([0.0, 0.0, GRAVITY], [0.0; 6]), neighbors)
}

pub(crate) fn truth(start: &[[f32; 3]], position: impl Fn([f32; 3], f32) -> [f32; 3]) -> GroundTruth {
    let times: Vec<f32> = (-75..=225).map(|i| i as f32 * 0.01).collect();
    let points = times.iter().map(|&t| start.iter().map(|&q| position(q, t)).collect()).collect();
    GroundTruth { times, points, object: vec![0; start.len()], ..GroundTruth::default() }
}

pub(crate) fn fallen(q: [f32; 3], t: f32) -> [f32; 3] {
    [q[0], q[1], q[2] - 0.5 * GRAVITY * t * t]
}
