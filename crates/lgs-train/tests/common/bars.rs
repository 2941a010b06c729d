//! A bar that turns, its images, and what stages 2 and 3 train on.

#![allow(dead_code, reason = "each test uses a part")]

use lgs_core::linear::{add, cross, mat_vec, matrix_from_quat, quat_mul};
use lgs_core::{Camera, Exposure, GaussianCloud};
use lgs_data::dataset::Frame;
use lgs_dynamics::testing::quadratic;
use lgs_dynamics::{Edit, Reversal, Supports, VelocityPolicy};
use lgs_mechanics::Law;
use lgs_mechanics::bands::Known;
use lgs_mechanics::coordinates::{Bodies, Coordinates, Hinge, Port, State};
use lgs_mechanics::terms::Term;
use lgs_model::{
    Dynamics, GeneralisedDynamics, LagrangianScene, Motion, MotionConfig, ObjectModel, ParticleDynamics,
};
use lgs_render::{Splats, rasterize};
use lgs_train::device::Device;
use lgs_train::stages::TrainingData;

/// Angular velocity of the bar.
pub(crate) const SPIN: [f32; 3] = [0.0, 0.0, 1.5];

/// A bar of coloured blobs that turns about the vertical axis beside the origin, free of forces.
pub(crate) fn turning_bar() -> LagrangianScene {
    bar_in([0.0; 3])
}

/// The turning bar in a uniform field.
pub(crate) fn bar_in(gravity: [f32; 3]) -> LagrangianScene {
    let means: Vec<[f32; 3]> =
        (0..24).map(|i| [0.15 * (i % 8) as f32 - 0.5, 0.12 * (i / 8) as f32, 0.1 * (i % 3) as f32]).collect();
    let mut dynamic_gaussians = GaussianCloud::isotropic(means.clone(), 0.07, [0.5; 3], 0.9);
    for (i, color) in dynamic_gaussians.sh.iter_mut().enumerate() {
        *color = ((i * 37) % 11) as f32 / 5.0 - 1.0;
    }
    let system = quadratic(gravity.map(|g| -g), [0.0; 6]);
    let supports = Supports::from_rows((0..24 * 24).map(|i| i % 24).collect(), 24).expect("supports of all");
    LagrangianScene {
        velocities: means.iter().map(|&q| cross(SPIN, q)).collect(),
        dynamic_gaussians,
        objects: vec![ObjectModel {
            members: 0..24,
            recording: None,
            dynamics: Dynamics::Particles(ParticleDynamics {
                system,
                supports: Some(supports.into()),
                velocity_policy: VelocityPolicy::Rigid,
            }),
        }],
        ..LagrangianScene::still(
            GaussianCloud::default(),
            MotionConfig { dt: 0.02, time_window: 0.4 },
            [1.0; 3],
        )
    }
}

/// Images of a scene by three cameras, in turns.
pub(crate) fn images(scene: &LagrangianScene) -> Vec<Frame> {
    let mut motion = Motion::new(scene, Edit::default(), Reversal::Exact);
    let eyes = [[0.0, -3.0, 1.0], [2.5, 1.5, 1.5], [-2.0, 2.0, 2.0]];
    let frame = |i: usize, motion: &mut Motion| {
        let (camera, time) = (Camera::look_at(eyes[i % 3], [0.0; 3], 0.7, 40, 40), 0.4 * i as f32 / 14.0);
        let drawn = rasterize(
            &Splats::from(&scene.cloud_at(&motion.state_at(time), time)),
            &camera,
            scene.background,
        )
        .to_image();
        let pixel = |p: &[f32; 3]| [p[0], p[1], p[2], 1.0].map(|v| (255.0 * v.clamp(0.0, 1.0)).round() as u8);
        Frame {
            name: String::new(),
            camera_id: i % 3,
            camera,
            time,
            exposure: Exposure::IDENTITY,
            pixels: drawn.pixels.iter().flat_map(pixel).collect::<Vec<u8>>().into(),
        }
    };
    (0..15).map(|i| frame(i, &mut motion)).collect()
}

/// What a stage trains on.
pub(crate) fn data<'a>(frames: &'a [Frame], device: &'a Device) -> TrainingData<'a> {
    TrainingData { frames, viewing_distance: 4.0, seed: 0, device }
}

/// A scene whose object begins turned and shifted.
pub(crate) fn displaced(truth: &LagrangianScene) -> LagrangianScene {
    let mut wrong = truth.clone();
    let turn = [0.04_f32.cos(), 0.0, 0.0, 0.04_f32.sin()];
    let moved = |q: [f32; 3]| add(mat_vec(&matrix_from_quat(turn), q), [0.01, -0.02, 0.02]);
    wrong.dynamic_gaussians.means.iter_mut().for_each(|q| *q = moved(*q));
    wrong.velocities = wrong.dynamic_gaussians.means.iter().map(|&q| cross(SPIN, q)).collect();
    wrong.dynamic_gaussians.rotations.iter_mut().for_each(|r| *r = quat_mul(turn, *r));
    wrong
}

/// The same bar on a hinge beside it, with a constant torque.
pub(crate) fn bar_on_a_hinge(axis: [f64; 3], pivot: [f64; 3], torque: f64) -> LagrangianScene {
    let terms = vec![Term::named("constant-drive", Port::Whole).expect("a term")];
    let coordinates = Coordinates::Hinge(Hinge { axis, pivot });
    let law = Law::new(coordinates, terms, vec![torque], 0.01).expect("a law");
    let start = State { x: vec![0.0], v: vec![1.5] };
    let dynamics = GeneralisedDynamics { law, bodies: Bodies::default(), start, known: Known::default() };
    let mut scene = turning_bar();
    scene.velocities = dynamics.start_velocities(&scene.dynamic_gaussians.means, Edit::default());
    scene.objects[0].dynamics = Dynamics::Generalised(dynamics);
    scene
}
