//! True tracks of surface points as frames of Gaussians, for judging stage 1 without images.

use super::options::TrackOptions;
use super::scenes::Scene;
use super::truth;
use crate::frames::FrameSequence;
use glam::DQuat;
use lgs_core::geometry::components;
use lgs_core::{GaussianCloud, stream};
use rand_distr::{Distribution, StandardNormal};
use serde_json::Value;

/// Times of the captured window, 0 to 0.75.
const FRAMES: usize = 61;
/// Points of every object, and of all fixed parts together.
const POINTS: usize = 160;
/// Correlation of the noise of one frame with the next, as measured on the tracks of trained sources.
const CORRELATION: f64 = 0.75;
/// Radius of a Gaussian, world units.
const RADIUS: f32 = 0.03;
/// An opacity of 0.9 before the sigmoid.
const RAW_OPACITY: f32 = 2.2;

/// The tracks of a scene: positions with noise, true rotations of rigid bodies, grey Gaussians.
pub(super) fn tracks(scene: &Scene, options: &TrackOptions) -> FrameSequence {
    let times: Vec<f64> = (0..FRAMES).map(|i| 0.75 * i as f64 / (FRAMES - 1) as f64).collect();
    let truth = truth::follow(&scene.stage, &times, POINTS, options.seed, Value::Null);
    let mut positions = truth.points;
    add_noise(&mut positions, options);
    let turned = |t: &f64| -> Vec<[f32; 4]> {
        let bodies: Vec<[f32; 4]> = scene.stage.bodies.iter().map(|body| quaternion(body, *t)).collect();
        let of = |&object: &i32| usize::try_from(object).map_or([1.0, 0.0, 0.0, 0.0], |i| bodies[i]);
        truth.object.iter().map(of).collect()
    };
    let rotations: Vec<Vec<[f32; 4]>> = times.iter().map(turned).collect();
    let count = truth.object.len();
    let gaussians = GaussianCloud {
        means: positions[0].clone(),
        rotations: rotations[0].clone(),
        log_scales: vec![[RADIUS.ln(); 3]; count],
        raw_opacities: vec![RAW_OPACITY; count],
        sh: vec![0.0; 3 * count],
        sh_degree: 0,
    };
    FrameSequence { gaussians, times: truth.times, positions, rotations }
}

/// The rotation of a rigid body, w x y z; none for one that deforms.
fn quaternion(body: &super::body::Body, t: f64) -> [f32; 4] {
    let pose = body.motion.pose(t);
    if pose.stretch != 1.0 {
        return [1.0, 0.0, 0.0, 0.0];
    }
    components(DQuat::from_mat3(&pose.linear)).map(|v| v as f32)
}

/// Normal noise of every coordinate, independent between points and correlated from frame to frame.
fn add_noise(positions: &mut [Vec<[f32; 3]>], options: &TrackOptions) {
    if options.noise == 0.0 {
        return;
    }
    let mut rng = stream(options.seed, "synthetic tracks", 0);
    let mut normal = move || -> f64 { StandardNormal.sample(&mut rng) };
    let count = 3 * positions.first().map_or(0, Vec::len);
    let mut noise: Vec<f64> = (0..count).map(|_| normal()).collect();
    for row in positions {
        for (value, noise) in row.iter_mut().flatten().zip(&mut noise) {
            *value += (options.noise * *noise) as f32;
            *noise = CORRELATION * *noise + (1.0 - CORRELATION * CORRELATION).sqrt() * normal();
        }
    }
}
