//! Figures of scenes whose motion is known in closed form.

mod common;

use std::collections::BTreeMap;

use common::{GRAVITY, block, fallen, falling, scene, truth};
use lgs_core::{Camera, Exposure};
use lgs_data::dataset::{Dataset, Frame, Pixels};
use lgs_data::synth::GroundTruth;
use lgs_dynamics::testing::quadratic;
use lgs_dynamics::{Edit, Reversal};
use lgs_eval::{EvalOptions, Metrics, Subject, evaluate, render};
use lgs_model::{LagrangianScene, Motion};

/// One and a half radians by the end of the window; after whole half turns the kicks at both ends would
/// cancel.
const OMEGA: f32 = 2.0;

fn turning() -> LagrangianScene {
    let w2 = OMEGA * OMEGA;
    scene(
        block([1.0, 0.0, 0.0]),
        |q| [-OMEGA * q[1], OMEGA * q[0], 0.0],
        quadratic([0.0; 3], [w2, w2, 0.0, 0.0, 0.0, 0.0]),
        0,
    )
}

/// A pixel as an image with alpha stores it, either opaque or just below half so, such that it looks the same
/// over white.
fn straight_alpha(pixel: [f32; 3], opacity: f32) -> [u8; 4] {
    let alpha = if opacity > 0.5 { 255_u8 } else { 127 };
    let a = f32::from(alpha) / 255.0;
    let [r, g, b] = pixel.map(|c| (255.0 * (c - (1.0 - a)) / a + 0.5).clamp(0.0, 255.0) as u8);
    [r, g, b, alpha]
}

/// A dataset whose true images are the scene's own renders.
fn own_images(scene: &LagrangianScene, splits: &[(&str, &[f32])]) -> Dataset {
    let mut motion = Motion::new(scene, Edit::default(), Reversal::Exact);
    let cameras =
        [[0.0, -9.0, 1.0], [7.0, 5.0, 2.0]].map(|eye| Camera::look_at(eye, [0.0, 0.0, -1.0], 1.2, 48, 40));
    let mut frame = |camera_id: usize, time: f32| {
        let rendered =
            render(&scene.cloud_at(&motion.state_at(time), time), &cameras[camera_id], scene.background);
        let rgba: Vec<u8> = rendered
            .image
            .pixels
            .iter()
            .zip(rendered.opacity())
            .flat_map(|(&pixel, o)| straight_alpha(pixel, o))
            .collect();
        Frame {
            name: format!("v{camera_id}_{time}"),
            camera_id,
            camera: cameras[camera_id],
            time,
            exposure: Exposure::IDENTITY,
            pixels: Pixels::from(rgba),
        }
    };
    let splits: BTreeMap<String, Vec<Frame>> = splits
        .iter()
        .map(|(name, times)| {
            (
                (*name).to_owned(),
                times.iter().flat_map(|&t| [(0, t), (1, t)]).map(|(c, t)| frame(c, t)).collect(),
            )
        })
        .collect();
    Dataset { root: "memory".into(), splits, ..Dataset::none([1.0; 3]) }
}

fn physics_of(scene: &LagrangianScene, truth: Option<&GroundTruth>) -> Metrics {
    evaluate(
        &Subject { scene, source: None, dataset: None, truth, laws: &[] },
        &EvalOptions::default(),
        &|_, _| {},
    )
}

#[test]
fn a_fall_has_the_cycle_error_of_theory() {
    let scene = falling(0);
    let physics = physics_of(&scene, None).physics;
    let cycle = physics.cycle_error;
    let (h, t) = (0.01, 0.75);
    let predicted = 2.0 * h / (t + h);
    assert!((cycle.negated_step.expect("cycle") - predicted).abs() < 0.02 * predicted, "{cycle:?}");
    assert!(cycle.exact_without_alignment.expect("cycle") < 1e-4, "{cycle:?}");
    assert!(physics.energy_drift.expect("drift") < 0.006, "{:?}", physics.energy_drift);
    assert_eq!(physics.force_ratio, Some(0.0));
}

#[test]
fn a_fall_from_rest_has_the_exponent_of_theory() {
    // Half a kick behind, the integrator is at rest at t = 0 and on the parabola at every step.
    let mut scene = falling(0);
    scene.velocities.fill([0.0, 0.0, 0.5 * scene.motion.dt * GRAVITY]);
    let fall = physics_of(&scene, None).physics.fall_time_exponent;
    assert!((fall.slope.expect("slope") + 0.5).abs() < 1e-3 && fall.r.expect("r") > 0.999_99, "{fall:?}");
    let mut quartered =
        Motion::new(&scene, Edit { potential_scale: 0.25, ..Edit::default() }, Reversal::Exact);
    let drop = scene.dynamic_gaussians.means[0][2] - quartered.state_at(1.0).q[0][2];
    assert!((drop - 0.125 * GRAVITY).abs() < 1e-4, "{drop}");
}

#[test]
fn a_rotation_has_the_cycle_error_of_theory_and_does_not_fall() {
    let physics = physics_of(&turning(), None).physics;
    let cycle = physics.cycle_error;
    assert!((cycle.negated_step.expect("cycle") - 0.013).abs() < 0.002, "{cycle:?}");
    assert!(cycle.exact.expect("cycle") < 1e-4, "{cycle:?}");
    assert_eq!(physics.fall_time_exponent.slope, None);
    assert!(physics.energy_drift.expect("drift") < 0.05);
}

#[test]
fn the_trajectory_error_is_that_of_the_integrator() {
    let scene = falling(12);
    // Points beside the Gaussians: the offset is carried along and does not count as an error.
    let start: Vec<[f32; 3]> =
        scene.dynamic_gaussians.means.iter().map(|q| [q[0] + 0.03, q[1], q[2] - 0.01]).collect();
    let truth = truth(&start, fallen);
    let physics = physics_of(&scene, Some(&truth)).physics;
    // Semi-implicit Euler is ahead by ½ g h t: relative to ½ g t², h/t.
    let at_end = physics.trajectory_error["2.25"].expect("error");
    assert!((at_end - 0.01 / 2.25).abs() < 2e-4, "{at_end}");
    assert!((physics.trajectory_detail["2.25"].path - 0.5 * 2.0 * 2.25 * 2.25).abs() < 1e-3);
    let against = physics.extent_against_truth;
    for ratio in [against.spread_max, against.spread_min, against.reach, against.reach_p99] {
        assert!((ratio.expect("ratio") - 1.0).abs() < 0.02, "{against:?}");
    }
    assert!(physics.trajectory_error["-0.75"].expect("past") < 0.02, "{:?}", physics.trajectory_error);
}

#[test]
fn a_truth_that_ends_early_leaves_later_times_open() {
    let scene = falling(0);
    let mut truth = truth(&scene.dynamic_gaussians.means, fallen);
    truth.times.truncate(200);
    truth.points.truncate(200);
    let errors = physics_of(&scene, Some(&truth)).physics.trajectory_error;
    assert!(errors["1.0"].is_some() && errors["2.25"].is_none(), "{errors:?}");
}

#[test]
fn its_own_images_score_full_marks_in_every_split() {
    let scene = falling(0);
    let dataset = own_images(&scene, &[("test", &[0.8, 0.9]), ("past", &[-0.5])]);
    let subject = Subject { scene: &scene, source: None, dataset: Some(&dataset), truth: None, laws: &[] };
    let metrics = evaluate(&subject, &EvalOptions::default(), &|_, _| {});
    let test = metrics.splits["test"].lagrangian.expect("scores");
    // Half-transparent pixels lose a level when stored.
    assert!(test.psnr.expect("psnr") > 45.0 && test.ssim.expect("ssim") > 0.999, "{test:?}");
    assert_eq!((test.frames, metrics.frames["past"].len()), (4, 2));
    assert_eq!(metrics.splits["test"].source, None);
    let ratio = metrics.physics.extent_against_truth.pixels_max.expect("pixels");
    assert!((ratio - 1.0).abs() < 1e-9, "{ratio}");
    let text = serde_json::to_string(&metrics).expect("json");
    let back: Metrics = serde_json::from_str(&text).expect("parse");
    assert_eq!(back, metrics);
    assert!(text.contains("\"lpips_vgg\":null"));
}

#[test]
fn a_diverging_scene_has_no_figures_instead_of_wrong_ones() {
    let scene =
        scene(block([1.0, 0.0, 0.0]), |_| [0.0; 3], quadratic([0.0; 3], [-1e9, -1e9, 0.0, 0.0, 0.0, 0.0]), 0);
    let truth = truth(&scene.dynamic_gaussians.means, fallen);
    let physics = physics_of(&scene, Some(&truth)).physics;
    assert_eq!(physics.cycle_error.negated_step, None);
    assert_eq!(physics.trajectory_error["2.25"], None);
    assert_eq!(physics.extent_against_truth.reach, None);
    assert_eq!(physics.energy_drift, None);
}

#[test]
fn a_scene_without_movers_has_images_but_no_motion() {
    let mut scene = falling(0);
    scene.static_gaussians = std::mem::take(&mut scene.dynamic_gaussians);
    scene.velocities.clear();
    scene.objects.clear();
    let dataset = own_images(&scene, &[("val", &[0.0, 0.5])]);
    let subject = Subject { scene: &scene, source: None, dataset: Some(&dataset), truth: None, laws: &[] };
    let metrics = evaluate(&subject, &EvalOptions::default(), &|_, _| {});
    assert!(metrics.splits["val"].lagrangian.is_some());
    assert_eq!(metrics.physics.cycle_error.negated_step, None);
    assert_eq!(metrics.physics.extent_ratio_max, None, "what has no object keeps its size");
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let scene = falling(8);
    let dataset = own_images(&scene, &[("test", &[0.8, 0.9, 1.0, 1.5, 2.0])]);
    let truth = truth(&scene.dynamic_gaussians.means, fallen);
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("pool");
        let subject =
            Subject { scene: &scene, source: None, dataset: Some(&dataset), truth: Some(&truth), laws: &[] };
        pool.install(|| evaluate(&subject, &EvalOptions::default(), &|_, _| {}))
    };
    assert_eq!(run(1), run(3));
}

#[test]
fn what_a_mask_leaves_out_is_not_scored() {
    let scene = falling(8);
    let mut dataset = own_images(&scene, &[("test", &[0.8, 0.9])]);
    let psnr = |dataset: &Dataset, half_resolution: bool| {
        let subject = Subject { scene: &scene, source: None, dataset: Some(dataset), truth: None, laws: &[] };
        let options = EvalOptions { half_resolution, ..EvalOptions::default() };
        evaluate(&subject, &options, &|_, _| {}).splits["test"]
            .lagrangian
            .as_ref()
            .and_then(|s| s.psnr)
            .expect("PSNR")
    };
    let whole = psnr(&dataset, false);
    for frame in dataset.splits.values_mut().flatten() {
        let mut picture = (*frame.picture()).clone();
        let is_spoilt = |i: usize| i.is_multiple_of(5);
        picture.rgba.as_chunks_mut::<4>().0.iter_mut().step_by(5).for_each(|p| *p = [255, 0, 255, 255]);
        picture.mask = Some((0..frame.camera.pixels()).map(|i| u8::from(!is_spoilt(i))).collect());
        frame.pixels = Pixels::of(picture);
    }
    assert!(psnr(&dataset, false) > whole - 1.0, "{} dB of {whole}", psnr(&dataset, false));
    assert!(psnr(&dataset, true) > 40.0);
}
