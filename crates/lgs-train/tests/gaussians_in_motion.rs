//! Stage 3 against images of a known motion: Gaussians are refined without the motion of a body under a rigid
//! constraint, in one round or more, in the harmonics that turn with it, and beside displacements.

#[path = "common/bars.rs"]
mod bars;

use std::path::Path;

use bars::{SPIN, bar_on_a_hinge, data, displaced, images, turning_bar};
use lgs_core::linear::{cross, norm, sub};
use lgs_dynamics::{Edit, Reversal, Supports};
use lgs_model::{LagrangianScene, Motion, scene_from_tensors};
use lgs_train::stages::{TuneGaussians, TuneGaussiansConfig};
use lgs_train::{DeviceName, SceneTrainer, Trainer};

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

#[test]
fn another_round_of_stage_3_goes_on_from_its_checkpoint() {
    let truth = bar_on_a_hinge([0.0, 0.0, 1.0], [0.1, -0.2, 0.0], 4.0);
    let (frames, device) = (images(&truth), DeviceName::Cpu.device());
    let data = data(&frames, &device);
    let config = TuneGaussiansConfig { iterations: 6, refresh_every: 4, ..TuneGaussiansConfig::default() };
    let to_the_end = |stage: &mut TuneGaussians<'_>| {
        while !stage.is_finished() {
            stage.step();
        }
    };
    let mut first = TuneGaussians::again(displaced(&truth), data, &config, None);
    to_the_end(&mut first);
    let mut second = TuneGaussians::again(first.scene(), data, &config, Some(&first));
    assert_eq!((second.round(), second.step_index(), second.status().steps), (2, 6, 12));
    (0..3).for_each(|_| drop(second.step()));
    let (checkpoint, step) = (second.checkpoint(), second.step_index());
    to_the_end(&mut second);
    let scene = scene_from_tensors(&checkpoint, Path::new("checkpoint")).expect("a scene");
    let mut resumed = TuneGaussians::again(scene, data, &config, None);
    resumed.restore(&checkpoint, step).expect("restore");
    assert_eq!((resumed.round(), resumed.step_index()), (2, 9));
    to_the_end(&mut resumed);
    assert_eq!(resumed.scene().dynamic_gaussians, second.scene().dynamic_gaussians);
}

#[test]
fn the_harmonics_of_a_body_are_tuned_as_they_are_drawn() {
    let mut truth = bar_on_a_hinge([0.0, 0.0, 1.0], [0.1, -0.2, 0.0], 4.0);
    truth.static_gaussians.sh_degree = 1;
    let cloud = &mut truth.dynamic_gaussians;
    cloud.sh_degree = 1;
    let color = |i: usize| (((i * 37) % 11) as f32 - 5.0) / if i % 12 < 3 { 5.0 } else { 20.0 };
    cloud.sh = (0..24 * 12).map(color).collect();
    let (frames, device) = (images(&truth), DeviceName::Cpu.device());
    let config = TuneGaussiansConfig { iterations: 1, ..TuneGaussiansConfig::default() };
    let mut stage = TuneGaussians::new(truth, data(&frames, &device), &config);
    // What is left is what eight bits leave.
    let psnr = stage.step().figures().psnr;
    assert!(psnr > 55.0, "{psnr}");
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
