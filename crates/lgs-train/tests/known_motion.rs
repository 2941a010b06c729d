//! Stages 2 and 3 against images of a known motion: an object that begins turned and shifted, with a wrong
//! law, is brought to where the images show it, and one under a rigid constraint keeps its motion while its
//! Gaussians are refined.

use lgs_core::linear::{add, cross, mat_vec, matrix_from_quat, norm, quat_mul, sub};
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
use lgs_train::stages::{
    FitDynamics, FitDynamicsConfig, TrainingData, TuneDynamics, TuneDynamicsConfig, TuneGaussians,
    TuneGaussiansConfig,
};
use lgs_train::{DeviceName, SceneTrainer, Trainer};

const SPIN: [f32; 3] = [0.0, 0.0, 1.5];

/// A bar of coloured blobs that turns about the vertical axis beside the origin, free of forces.
fn turning_bar() -> LagrangianScene {
    bar_in([0.0; 3])
}

/// The turning bar in a uniform field.
fn bar_in(gravity: [f32; 3]) -> LagrangianScene {
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

fn images(scene: &LagrangianScene) -> Vec<Frame> {
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

fn data<'a>(frames: &'a [Frame], device: &'a Device) -> TrainingData<'a> {
    TrainingData { frames, viewing_distance: 4.0, seed: 0, device }
}

/// Largest distance of a mean from where it belongs.
fn distance(scene: &LagrangianScene, truth: &LagrangianScene) -> f32 {
    let pairs = scene.dynamic_gaussians.means.iter().zip(&truth.dynamic_gaussians.means);
    pairs.map(|(&a, &b)| norm(sub(a, b))).fold(0.0, f32::max)
}

/// A scene whose object begins turned and shifted.
fn displaced(truth: &LagrangianScene) -> LagrangianScene {
    let mut wrong = truth.clone();
    let turn = [0.04_f32.cos(), 0.0, 0.0, 0.04_f32.sin()];
    let moved = |q: [f32; 3]| add(mat_vec(&matrix_from_quat(turn), q), [0.01, -0.02, 0.02]);
    wrong.dynamic_gaussians.means.iter_mut().for_each(|q| *q = moved(*q));
    wrong.velocities = wrong.dynamic_gaussians.means.iter().map(|&q| cross(SPIN, q)).collect();
    wrong.dynamic_gaussians.rotations.iter_mut().for_each(|r| *r = quat_mul(turn, *r));
    wrong
}

/// Largest difference of initial velocities.
fn velocity_error(scene: &LagrangianScene, truth: &LagrangianScene) -> f32 {
    scene.velocities.iter().zip(&truth.velocities).map(|(&a, &b)| norm(sub(a, b))).fold(0.0, f32::max)
}

#[test]
fn a_wrong_start_and_a_wrong_law_are_fitted_to_the_images() {
    let truth = bar_in([0.1, 0.0, -1.0]);
    let (frames, device) = (images(&truth), DeviceName::Cpu.device());
    let mut wrong = displaced(&truth);
    wrong.objects = bar_in([0.1, 0.0, -1.2]).objects;
    wrong.velocities.iter_mut().for_each(|v| *v = add(*v, [0.05, 0.0, 0.02]));
    let config = FitDynamicsConfig { steps: 4, frames: 0 };
    let mut stage = FitDynamics::new(wrong.clone(), data(&frames, &device), &config);
    let mut psnr = Vec::new();
    while !stage.is_finished() {
        psnr.push(stage.step().figures().psnr);
    }
    assert!(psnr[3] > psnr[0] + 10.0, "{psnr:?}");
    let found = stage.scene();
    assert!(distance(&found, &truth) < 0.05 * distance(&wrong, &truth), "{}", distance(&found, &truth));
    assert!(velocity_error(&found, &truth) < 0.02, "{}", velocity_error(&found, &truth));
    let gravity = |scene: &LagrangianScene| {
        let particles = scene.objects[0].dynamics.particles().expect("particles");
        particles.system.accelerations(&[[0.0; 3]], &[[0.0; 3]], &Edit::default())[0]
    };
    assert!(norm(sub(gravity(&found), gravity(&truth))) < 0.03, "{:?}", gravity(&found));
}

#[test]
fn a_wrong_pose_at_the_start_is_found_from_the_images() {
    let truth = turning_bar();
    let (frames, device) = (images(&truth), DeviceName::Cpu.device());
    let wrong = displaced(&truth);
    let begun = distance(&wrong, &truth);
    let tuned = |pose_learning_rate: f64| {
        let config = TuneDynamicsConfig {
            iterations: 60,
            frames_per_step: 3,
            pose_learning_rate,
            ..TuneDynamicsConfig::default()
        };
        let mut stage = TuneDynamics::new(wrong.clone(), data(&frames, &device), &config);
        while !stage.is_finished() {
            stage.step();
        }
        stage.scene()
    };
    assert_eq!(distance(&tuned(0.0), &truth), begun, "the pose stays unless it is tuned");
    let found = tuned(4e-3);
    assert!(distance(&found, &truth) < 0.3 * begun, "{} of {begun}", distance(&found, &truth));
    assert!(velocity_error(&found, &truth) < 0.05, "{}", velocity_error(&found, &truth));
}

#[test]
fn refined_gaussians_leave_the_motion_under_a_rigid_constraint_as_it_is() {
    let truth = turning_bar();
    let (frames, device) = (images(&truth), DeviceName::Cpu.device());
    let mut begun = truth.clone();
    let particles = begun.objects[0].dynamics.particles_mut().expect("particles");
    particles.supports = Supports::from_rows([0, 5, 10, 15, 20, 23].repeat(24), 6).ok().map(Into::into);
    begun.dynamic_gaussians.means.iter_mut().enumerate().for_each(|(i, q)| q[2] += 0.02 * (i as f32).sin());
    begun.velocities = begun.dynamic_gaussians.means.iter().map(|&q| cross(SPIN, q)).collect();
    let config = TuneGaussiansConfig {
        iterations: 30,
        means_learning_rate: 2e-3,
        refresh_every: 10,
        ..TuneGaussiansConfig::default()
    };
    let mut stage = TuneGaussians::new(begun.clone(), data(&frames, &device), &config);
    while !stage.is_finished() {
        stage.step();
    }
    let refined = stage.scene();
    let end = |scene: &LagrangianScene| Motion::new(scene, Edit::default(), Reversal::Exact).state_at(0.4);
    let (before, after) = (end(&begun), end(&refined));
    assert_eq!(
        (before.q[5], before.rotation[5]),
        (after.q[5], after.rotation[5]),
        "one that supports the constraint"
    );
    let turned =
        before.rotation.iter().flatten().zip(after.rotation.iter().flatten()).map(|(a, b)| (a - b).abs());
    assert!(turned.fold(0.0, f32::max) < 1e-5, "the others turn with it");
    let moved = |i: usize| norm(sub(begun.dynamic_gaussians.means[i], refined.dynamic_gaussians.means[i]));
    assert!((1..5).all(|i| moved(i) > 1e-3), "the others are refined");
}

/// The same bar on a hinge beside it, with a constant torque.
fn bar_on_a_hinge(axis: [f64; 3], pivot: [f64; 3], torque: f64) -> LagrangianScene {
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

#[test]
fn a_hinge_that_is_a_little_wrong_is_put_right_by_the_images() {
    let truth = bar_on_a_hinge([0.0, 0.0, 1.0], [0.1, -0.2, 0.0], 4.0);
    let (frames, device) = (images(&truth), DeviceName::Cpu.device());
    let wrong = bar_on_a_hinge([0.0, 0.05, 0.05_f64.mul_add(-0.05, 1.0).sqrt()], [0.13, -0.18, 0.0], 3.4);
    let config = FitDynamicsConfig { steps: 5, frames: 0 };
    let mut stage = FitDynamics::new(wrong, data(&frames, &device), &config);
    while !stage.is_finished() {
        stage.step();
    }
    let found = stage.scene();
    let law = &found.objects[0].dynamics.generalised().expect("a law").law;
    let Coordinates::Hinge(hinge) = &law.coordinates else { panic!("{law:?}") };
    let off = (hinge.pivot[0] - 0.1).hypot(hinge.pivot[1] + 0.2);
    assert!(off < 0.012 && hinge.axis[1].abs() < 0.015, "{hinge:?}");
    assert!((law.parameters[0] - 4.0).abs() < 0.2, "{law:?}");
}

/// The bar cut in two, of which a spring draws the second half to the first one.
fn halves_on_a_spring(stiffness: f64, away: f64) -> LagrangianScene {
    let terms = vec![Term::named("spring-length", Port::Between).expect("a term")];
    let parameters = vec![1.5, 0.0, 0.0, 0.0, stiffness, 0.5];
    let law = Law::new(Coordinates::Pair, terms, parameters, 0.01).expect("a law");
    let start =
        State { x: vec![-0.2, 0.1, 0.1, 0.5 + away, 0.1, 0.1], v: vec![0.0, 0.2, 0.0, 0.1, -0.3, 0.2] };
    let bodies = Bodies::of_sizes(&[12, 12]);
    let dynamics = GeneralisedDynamics { law, bodies, start, known: Known::default() };
    let mut scene = turning_bar();
    scene.dynamic_gaussians.means[12..].iter_mut().for_each(|q| q[0] += 0.3 + away as f32);
    scene.velocities = dynamics.start_velocities(&scene.dynamic_gaussians.means, Edit::default());
    scene.objects[0].dynamics = Dynamics::Generalised(dynamics);
    scene
}

#[test]
fn a_law_of_two_bodies_is_put_right_by_the_images_of_both() {
    let truth = halves_on_a_spring(30.0, 0.0);
    let (frames, device) = (images(&truth), DeviceName::Cpu.device());
    let config = FitDynamicsConfig { steps: 5, frames: 0 };
    let mut stage = FitDynamics::new(halves_on_a_spring(24.0, 0.02), data(&frames, &device), &config);
    while !stage.is_finished() {
        stage.step();
    }
    let found = stage.scene();
    let law = &found.objects[0].dynamics.generalised().expect("a law").law;
    assert!((law.parameters[4] - 30.0).abs() < 1.5, "{law:?}");
    assert!(distance(&found, &truth) < 0.01, "{}", distance(&found, &truth));
}

#[test]
fn gaussians_are_not_refined_to_a_motion_that_slips() {
    let truth = turning_bar();
    let (frames, device) = (images(&truth), DeviceName::Cpu.device());
    let mut slipping = truth.clone();
    slipping.velocities.iter_mut().for_each(|v| *v = v.map(|x| 0.8 * x));
    let config = TuneGaussiansConfig { iterations: 300, ..TuneGaussiansConfig::default() };
    let mut stage = TuneGaussians::refinement(slipping, data(&frames, &device), &config);
    while !stage.is_finished() {
        stage.step();
    }
    let refined = stage.scene();
    let drawn = LagrangianScene { dynamic_gaussians: refined.dynamic_gaussians, ..truth };
    let drawn_images = images(&drawn);
    let mse = drawn_images.iter().zip(&frames).map(|(a, b)| {
        let pairs =
            a.composited(drawn.background).pixels.into_iter().zip(b.composited(drawn.background).pixels);
        pairs.map(|(a, b)| norm(sub(a, b)).powi(2) / 3.0).sum::<f32>() / 1600.0
    });
    let psnr = -10.0 * (mse.sum::<f32>() / frames.len() as f32).log10();
    // 64 dB; 41 where the body may not be displaced.
    assert!(psnr > 55.0, "the true motion of the refined Gaussians: {psnr} dB");
}
