//! Stage 2 against images of a known motion: an object that begins turned and shifted, with a wrong law, is
//! brought to where the images show it.

#[path = "common/bars.rs"]
mod bars;

use bars::{bar_in, bar_on_a_hinge, data, displaced, images, turning_bar};
use lgs_core::linear::{add, norm, sub};
use lgs_dynamics::Edit;
use lgs_mechanics::Law;
use lgs_mechanics::bands::Known;
use lgs_mechanics::coordinates::{Bodies, Coordinates, Port, State};
use lgs_mechanics::terms::Term;
use lgs_model::{Dynamics, GeneralisedDynamics, LagrangianScene};
use lgs_train::stages::{FitDynamics, FitDynamicsConfig, TuneDynamics, TuneDynamicsConfig};
use lgs_train::{DeviceName, SceneTrainer, Trainer};

/// Largest distance of a mean from where it belongs.
fn distance(scene: &LagrangianScene, truth: &LagrangianScene) -> f32 {
    let pairs = scene.dynamic_gaussians.means.iter().zip(&truth.dynamic_gaussians.means);
    pairs.map(|(&a, &b)| norm(sub(a, b))).fold(0.0, f32::max)
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
