//! The distiller alone on ground-truth trajectories: error at three times the window as a part of the path,
//! with and without noise, and with the kind of error that a source model trained from images makes.
#![expect(clippy::unwrap_used, reason = "a test stops at what it did not expect")]

use lgs_data::synth;
use lgs_distill::{Alignment, DistillConfig, Distilled, SharedMotionKind, TargetKind, Trajectories, distill};
use lgs_dynamics::{ForceKind, VelocityPolicy};
use rand_distr::{Distribution, Normal};

const WINDOW: usize = 76;
const STEPS: usize = 225;

fn truth(scene: &str) -> Vec<Vec<[f32; 3]>> {
    let times: Vec<f64> = (0..=STEPS).map(|i| 0.01 * i as f64).collect();
    synth::ground_truth(scene, &times, 400, 0).unwrap().points
}

fn window(points: &[Vec<[f32; 3]>], error: impl FnMut(usize, usize, usize) -> f32) -> Trajectories {
    let mut error = error;
    let mut positions = points[..WINDOW].to_vec();
    for (sample, row) in positions.iter_mut().enumerate() {
        for (particle, p) in row.iter_mut().enumerate() {
            for (axis, x) in p.iter_mut().enumerate() {
                *x += error(sample, particle, axis);
            }
        }
    }
    Trajectories::unweighted((0..WINDOW).map(|i| 0.01 * i as f32).collect(), positions)
}

fn normal(deviation: f32) -> impl FnMut(usize, usize, usize) -> f32 {
    let mut rng = lgs_core::stream(11, "noise", 0);
    let normal = Normal::new(0.0, deviation).unwrap();
    move |_, _, _| normal.sample(&mut rng)
}

fn run(seen: &Trajectories) -> Distilled {
    distill(seen, &DistillConfig::default(), 3, &mut |_| {}).unwrap()
}

fn error_at_end(found: &Distilled, truth: &[Vec<[f32; 3]>]) -> f64 {
    let states = found.rolled(0.01, STEPS);
    let distance = |a: &[[f32; 3]], b: &[[f32; 3]]| -> f64 {
        a.iter().zip(b).map(|(&p, &q)| f64::from(lgs_core::linear::norm(lgs_core::linear::sub(p, q)))).sum()
    };
    distance(&states[STEPS], &truth[STEPS])
        / truth.windows(2).map(|pair| distance(&pair[0], &pair[1])).sum::<f64>()
}

/// Noise-free and noisy bounds of the project; measured values are 2 to 100 times smaller (see the example
/// `distill_ground_truth`).
#[test]
fn laws_extrapolate_to_three_windows() {
    for (scene, clean, noisy) in [
        ("falling-ball", 0.005, 0.03),
        ("fan", 0.002, 0.01),
        ("sled", 0.02, 0.06),
        ("projectile", 0.03, 0.04),
        ("spring", 0.002, 0.01),
    ] {
        let truth = truth(scene);
        let error = error_at_end(&run(&window(&truth, |_, _, _| 0.0)), &truth);
        assert!(error <= clean, "{scene} without noise: {error}");
        let error = error_at_end(&run(&window(&truth, normal(0.004))), &truth);
        assert!(error <= noisy, "{scene} with noise: {error}");
    }
}

#[test]
fn what_was_seen_to_be_rigid_keeps_its_shape_and_its_law() {
    let truth = truth("fan");
    let found = run(&window(&truth, normal(0.004)));
    let states = found.rolled(0.01, STEPS);
    let apart =
        |q: &[[f32; 3]], i: usize| f64::from(lgs_core::linear::norm(lgs_core::linear::sub(q[i], q[i + 200])));
    for i in 0..200 {
        let (first, last) = (apart(&states[0], i), apart(&states[STEPS], i));
        assert!((last - first).abs() < 1e-3 * first + 1e-4, "{first} {last}");
    }
    let law = &found.report().generalised.as_ref().unwrap().law;
    assert_eq!(law.coordinates.name(), "hinge");
    let Distilled::Generalised(found) = &found else { panic!("{:?}", found.report()) };
    let start = &found.start;
    assert!((start.v[0].abs() - 2.4).abs() < 0.01 * 2.4, "{start:?}");
}

#[test]
fn smooth_errors_shared_by_neighbours_and_floaters_do_not_invent_forces() {
    for (scene, bound) in [("falling-ball", 0.15), ("fan", 0.06), ("spring", 0.03)] {
        let truth = truth(scene);
        let mut jitter = normal(0.001);
        let start = truth[0].clone();
        let seen = window(&truth, |sample, particle, axis| {
            let (t, p) = (0.01 * sample as f32, start[particle]);
            let wave = (5.0 * t + 3.0 * p[0] - 2.0 * p[1] + 2.0 * p[2] + axis as f32).sin();
            let floater = if particle % 40 == 7 { 0.3 * t } else { 0.0 };
            0.003 * wave + floater + jitter(sample, particle, axis)
        });
        let found = run(&seen);
        let error = error_at_end(&found, &truth);
        println!("{scene}: {error:.4} {:?}", found.report());
        assert!(error <= bound, "{scene}: {error}, {:?}", found.report());
    }
}

#[test]
fn the_result_depends_on_the_input_alone() {
    let seen = window(&truth("fan"), normal(0.004));
    let (a, b) = (run(&seen), run(&seen));
    assert_eq!(a.report(), b.report());
    assert_eq!((a.q0(), a.v0()), (b.q0(), b.v0()));
}

#[test]
fn particles_in_another_order_move_as_before() {
    let truth = truth("fan");
    let found = run(&window(&truth, |_, _, _| 0.0));
    let order = lgs_core::spatial_order(found.q0());
    let in_order: Vec<Vec<[f32; 3]>> =
        truth.iter().map(|points| order.iter().map(|&i| points[i as usize]).collect()).collect();
    let reordered = found.clone().in_order(&order);
    assert_ne!(reordered.q0(), found.q0());
    let (error, before) = (error_at_end(&reordered, &in_order), error_at_end(&found, &truth));
    assert!((error - before).abs() < 1e-4 && error <= 0.002, "{error}, {before} before");
}

/// The paper's networks, small and short, for a scene's first particles with this noise.
fn networks(scene: &str, noise: f32, change: impl FnOnce(&mut DistillConfig)) -> Distilled {
    let truth: Vec<_> = truth(scene).into_iter().map(|row| row[..60].to_vec()).collect();
    let alignment = Some(Alignment { support: 20, velocity_policy: VelocityPolicy::Keep });
    let mut config = DistillConfig { hidden: 16, alignment, ..DistillConfig::networks() };
    config.rollout.steps = 150;
    change(&mut config);
    distill(&window(&truth, normal(noise)), &config, 3, &mut |_| {}).unwrap()
}

#[test]
fn networks_alone_learn_a_fall_from_raw_trajectories() {
    let found = networks("falling-ball", 0.002, |_| ());
    let report = found.report();
    assert!(report.networks && report.law.is_none() && report.generalised.is_none());
    assert!(report.window_error < 0.3 * report.displacement, "{report:?}");
    let short = networks("falling-ball", 0.002, |config| config.rollout.steps = 1).report().window_error;
    assert!(report.window_error < 0.5 * short, "{report:?} after one step {short}");
    let again = networks("falling-ball", 0.002, |_| ());
    assert_eq!((found.q0(), found.v0()), (again.q0(), again.v0()), "the seed decides");
}

#[test]
fn variants_of_the_networks_add_one_thing_each() {
    let plain = networks("fan", 0.004, |_| ());
    let denoised = networks("fan", 0.004, |config| {
        config.rollout.targets = TargetKind::Denoised;
        config.shared_motion = SharedMotionKind::Auto;
    });
    let apart = |found: &Distilled| {
        let [truth, q0] = [truth("fan")[0].clone(), found.q0().to_vec()];
        q0.iter().zip(&truth).map(|(&a, &b)| lgs_core::linear::norm(lgs_core::linear::sub(a, b))).sum::<f32>()
    };
    assert!(apart(&denoised) < 0.5 * apart(&plain), "{} and {}", apart(&denoised), apart(&plain));
    let matched = networks("fan", 0.0, |config| config.matching.steps = 300);
    assert!(matched.report().window_error < networks("fan", 0.0, |_| ()).report().window_error);
    let conservative = networks("fan", 0.0, |config| config.force = ForceKind::None);
    assert_eq!(conservative.report().force_ratio, 0.0);
}

#[test]
fn a_moving_object_of_three_particles_is_no_special_case() {
    let truth: Vec<_> = truth("falling-ball").into_iter().map(|row| row[..3].to_vec()).collect();
    let found = run(&window(&truth, |_, _, _| 0.0));
    assert!(error_at_end(&found, &truth) < 0.01, "{:?}", found.report());
}
