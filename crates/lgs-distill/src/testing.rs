//! Closed-form motions and seeded noise for this crate's tests.

use crate::Trajectories;
use crate::dense::V3;
use rand::RngExt;

/// `n` points spread evenly at random in a box of these half sizes.
pub(crate) fn block(half: V3, n: usize, seed: u64) -> Vec<V3> {
    let mut rng = lgs_core::stream(seed, "block", 0);
    (0..n).map(|_| half.map(|h| h * rng.random_range(-1.0..1.0))).collect()
}

/// The same trajectories with independent normal noise of a standard deviation on every coordinate.
pub(crate) fn noisy(trajectories: &Trajectories, deviation: f32, seed: u64) -> Trajectories {
    let mut rng = lgs_core::stream(seed, "noise", 0);
    let mut out = trajectories.clone();
    for value in out.positions.iter_mut().flatten().flatten() {
        // Box–Muller; the second number of the pair is not needed.
        let (u, v): (f32, f32) = (rng.random_range(1e-7..1.0), rng.random_range(0.0..1.0));
        *value += deviation * (-2.0 * u.ln()).sqrt() * (std::f32::consts::TAU * v).cos();
    }
    out
}
