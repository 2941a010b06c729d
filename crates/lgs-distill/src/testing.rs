//! Closed-form motions and seeded noise for this crate's tests.

use crate::motion::pose::Pose;
use crate::trajectories::Trajectories;
use glam::DVec3;
use lgs_core::geometry::{narrow, rotation_by};
use rand::RngExt;
use rand_distr::{Distribution, Normal};

/// `n` points spread evenly at random in a box of these half sizes.
pub(crate) fn block(half: [f64; 3], n: usize, seed: u64) -> Vec<DVec3> {
    let mut rng = lgs_core::stream(seed, "block", 0);
    (0..n).map(|_| DVec3::from(half.map(|h| h * rng.random_range(-1.0..1.0)))).collect()
}

/// The trajectories of a body's points, which have this pose at a time.
pub(crate) fn moved(body: &[DVec3], times: Vec<f32>, pose: impl Fn(f64) -> Pose) -> Trajectories {
    let at = |&t: &f32| {
        let pose = pose(f64::from(t));
        body.iter().map(|&b| narrow(pose.apply(b))).collect()
    };
    let positions = times.iter().map(at).collect();
    Trajectories::unweighted(times, positions)
}

/// The same trajectories with independent normal noise of a standard deviation on every coordinate.
pub(crate) fn noisy(trajectories: &Trajectories, deviation: f32, seed: u64) -> Trajectories {
    let mut rng = lgs_core::stream(seed, "noise", 0);
    let normal = Normal::new(0.0, deviation).expect("a standard deviation");
    let mut out = trajectories.clone();
    out.positions.iter_mut().flatten().flatten().for_each(|x| *x += normal.sample(&mut rng));
    out
}

/// A block that tumbles as it falls, with noise.
pub(crate) fn tumbling(noise: f32) -> Trajectories {
    let times: Vec<f32> = (0..76).map(|i| 0.01 * i as f32).collect();
    let pose = |t: f64| Pose {
        linear: rotation_by(DVec3::new(2.0 * t, 0.5 * t, -t)),
        shift: DVec3::new(t, 0.0, 1.0 - t * t),
    };
    noisy(&moved(&block([0.3, 0.2, 0.1], 300, 5), times, pose), noise, 3)
}
