//! The laws of the scenes: what they conserve, closed forms, what the seed draws, what edits do.

use super::bounce::Wall;
use super::motion::Motion;
use super::simulation::Simulation;
use super::*;
use crate::edit::MotionEdit;
use glam::{DMat3, DVec3};
use laws::{Field, Hinge, Point};
use std::collections::BTreeSet;

const SEEDS: std::ops::Range<u64> = 0..4;

fn edit(velocity_scale: f64, potential_scale: f64, force_scale: f64) -> MotionEdit {
    MotionEdit { velocity_scale, potential_scale, force_scale }
}

/// Laws of all scenes and seeds that are simulated, each once, with their scene's name.
fn simulated_laws(edit: MotionEdit) -> Vec<(&'static str, Simulation)> {
    let mut all = Vec::new();
    for (info, seed) in scenes().into_iter().flat_map(|info| SEEDS.map(move |seed| (info, seed))) {
        let scene = find(info.name, seed).unwrap();
        if let Motion::Simulated { simulation, .. } = &scene.stage.bodies[0].motion {
            all.push((info.name, Simulation::new(simulation.law.edited(edit))));
        }
    }
    all
}

fn times() -> impl Iterator<Item = f64> {
    (-75..=225).step_by(5).map(|i| f64::from(i) / 100.0)
}

#[test]
fn without_forces_energy_is_conserved_in_both_directions() {
    let all = simulated_laws(edit(1.0, 1.0, 0.0));
    assert!(all.len() >= 12 * SEEDS.count());
    for (name, path) in all {
        let kinetic_and_potential = |t: f64| path.law.energy(&path.state(t));
        let start = kinetic_and_potential(0.0);
        let scale = start.abs().max(0.1);
        for t in times() {
            let drift = (kinetic_and_potential(t) - start).abs() / scale;
            assert!(drift < 1e-6, "{name} at {t}: {drift}");
        }
    }
}

#[test]
fn a_drag_takes_energy_and_a_torque_gives_it() {
    for (name, path) in simulated_laws(MotionEdit::default()) {
        let (start, end) = (path.law.energy(&path.state(0.0)), path.law.energy(&path.state(2.0)));
        match path.law.describe(0)["kind"].as_str().unwrap() {
            "dissipative" => assert!(end < start - 1e-3, "{name}: {start} {end}"),
            "driven" => assert!(end > start + 1e-3, "{name}: {start} {end}"),
            // Pushed on or held back, by what it does at the time.
            "forced" => {}
            _ => assert!((end - start).abs() < 1e-6 * start.abs().max(0.1), "{name}: {start} {end}"),
        }
    }
}

/// The simulation of a scene's first body, and its constants.
fn simulation(scene: &str, seed: u64) -> (std::sync::Arc<Simulation>, impl Fn(&str) -> f64) {
    let motion = find(scene, seed).unwrap().stage.bodies[0].motion.clone();
    let Motion::Simulated { simulation, .. } = motion else { panic!("{scene} is simulated") };
    let constants = simulation.law.describe(0)["constants"].clone();
    (simulation, move |name: &str| constants[name].as_f64().unwrap())
}

#[test]
fn free_bodies_keep_their_momentum_and_angular_momentum() {
    for seed in SEEDS {
        let (pair, constant) = simulation("spring-pair", seed);
        let momentum = |t: f64| {
            let s = pair.state(t);
            let (u, v) = (DVec3::new(s[6], s[7], s[8]), DVec3::new(s[9], s[10], s[11]));
            u + constant("mass_ratio") * v + (1.0 + constant("mass_ratio")) * constant("g") * t * DVec3::Z
        };
        let (body, ratio) = simulation("tumbling", seed);
        let inertia = DVec3::new(ratio("inertia_ratio_xz"), ratio("inertia_ratio_yz"), 1.0);
        let angular = |t: f64| {
            let s = body.state(t);
            body.pose(0, t).linear * (inertia * DVec3::new(s[4], s[5], s[6]))
        };
        for t in times() {
            assert!(momentum(t).abs_diff_eq(momentum(0.0), 1e-9), "{t}");
            assert!(angular(t).abs_diff_eq(angular(0.0), 1e-8), "{t}");
        }
    }
}

#[test]
fn a_hinge_of_small_amplitude_has_the_period_of_its_constants() {
    let free = Hinge::about(DVec3::Y, DMat3::IDENTITY);
    let small = Hinge { angle: 1e-3, gravity: 9.0, stiffness: 7.0, ..free };
    let path = Simulation::new(Box::new(small));
    let period = std::f64::consts::TAU / 4.0;
    assert!((path.state(period)[0] - 1e-3).abs() < 1e-9 && path.state(0.25 * period)[0].abs() < 1e-9);
}

#[test]
fn a_point_in_gravity_flies_a_parabola_also_backwards_and_beyond_what_is_kept() {
    let (start, velocity) = (DVec3::new(0.1, 0.2, 0.3), DVec3::new(1.0, -0.5, 0.8));
    let law = Point { law: "", kind: "", start, velocity, fields: vec![Field::Gravity(1.3)] };
    let path = Simulation::new(Box::new(law));
    for t in [-1.1, -0.31234, 0.0, 0.777, 3.3] {
        let expected = start + velocity * t - 0.65 * t * t * DVec3::Z;
        assert!(path.pose(0, t).position.abs_diff_eq(expected, 1e-10), "{t}");
    }
}

#[test]
fn a_kepler_orbit_closes_after_its_period() {
    let (simulation, constant) = simulation("kepler", 3);
    let k = constant("k");
    let axis = -0.5 * k / simulation.law.energy(&simulation.state(0.0));
    let period = std::f64::consts::TAU * (axis.powi(3) / k).sqrt();
    let (start, end) = (simulation.pose(0, 0.0).position, simulation.pose(0, period).position);
    assert!(period < 2.6 && start.abs_diff_eq(end, 1e-6), "{period}: {start} {end}");
}

#[test]
fn a_ball_bounces_at_its_impacts_with_its_restitution_and_never_below_the_floor() {
    for seed in SEEDS {
        let motion = find("bounce", seed).unwrap().stage.bodies[0].motion.clone();
        let Motion::Bounce(bounce) = &motion else { panic!("bounce bounces") };
        let impacts = bounce.impacts(2.25);
        assert!((0.3..0.5).contains(&impacts[0]), "{impacts:?}");
        let speed = |t: f64| (bounce.pose(t + 1e-6).position.z - bounce.pose(t).position.z) / 1e-6;
        for &t in &impacts[..2] {
            assert!(bounce.pose(t).position.z.abs() < 1e-9);
            let ratio = -speed(t + 1e-6) / speed(t - 2e-6);
            assert!((ratio - bounce.restitution).abs() < 1e-3, "{ratio} for {}", bounce.restitution);
        }
        for changed in [MotionEdit::default(), edit(0.5, 1.0, 1.0), edit(1.0, 2.0, 1.0)] {
            let path = motion.edited(changed).unwrap();
            assert!((0..=900).all(|i| path.pose(f64::from(i) / 400.0).position.z > -1e-9));
        }
    }
}

#[test]
fn every_scene_draws_its_constants_from_the_seed() {
    for info in scenes() {
        let laws: BTreeSet<String> = SEEDS
            .map(|seed| {
                let scene = find(info.name, seed).unwrap();
                law(&scene, &SynthOptions::default())["objects"].to_string()
            })
            .collect();
        assert_eq!(laws.len(), SEEDS.count(), "{}", info.name);
        let points = |seed| ground_truth(info.name, &[0.0, 0.5], 50, seed).unwrap().points;
        assert_eq!(points(2), points(2), "{}", info.name);
        let centers = |seed: u64| -> Vec<DVec3> {
            let stage = find(info.name, seed).unwrap().stage;
            let moved = |b: &body::Body| {
                let (a, z) = (b.motion.pose(0.0), b.motion.pose(0.5));
                z.linear * DVec3::ONE + z.position - a.linear * DVec3::ONE - a.position
            };
            stage.bodies.iter().map(moved).collect()
        };
        let apart = centers(1).iter().zip(centers(2)).map(|(a, b)| a.distance(b)).fold(0.0, f64::max);
        assert!(apart > 5e-3, "{}: seeds differ by {apart}", info.name);
    }
}

#[test]
fn every_moving_body_moves_by_several_tenths_of_its_size_in_the_window() {
    for (info, seed) in scenes().into_iter().flat_map(|info| SEEDS.map(move |seed| (info, seed))) {
        let window: Vec<f64> = (0..=15).map(|i| 0.05 * f64::from(i)).collect();
        let truth = ground_truth(info.name, &window, 100, seed).unwrap();
        for object in truth.objects() {
            let rows = truth.trajectories(object);
            let n = rows[0].len() as f32;
            let mean = rows[0].iter().map(|&p| glam::Vec3::from(p)).sum::<glam::Vec3>() / n;
            let size = 2.0 * rows[0].iter().map(|&p| glam::Vec3::from(p).distance(mean)).sum::<f32>() / n;
            let moved = |row: &Vec<[f32; 3]>| {
                let pairs = rows[0].iter().zip(row);
                pairs.map(|(&a, &b)| glam::Vec3::from(a).distance(b.into())).sum::<f32>() / n
            };
            let most = rows.iter().map(moved).fold(0.0, f32::max);
            assert!(most > 0.2 * size, "{} seed {seed}, {object}: {most} of {size}", info.name);
        }
    }
}

#[test]
fn an_edit_scales_the_start_the_potential_and_the_force() {
    let velocity = |motion: &Motion| {
        let (a, b) = (motion.pose(-1e-5), motion.pose(1e-5));
        let turning = (b.linear - a.linear).to_cols_array();
        (b.position - a.position, DVec3::new(turning[0], turning[4], turning[5]))
    };
    for (info, seed) in scenes().into_iter().flat_map(|info| SEEDS.map(move |seed| (info, seed))) {
        let stage = find(info.name, seed).unwrap().stage;
        for body in &stage.bodies {
            let Some(slow) = body.motion.edited(edit(0.5, 1.0, 1.0)) else {
                assert!(!info.explained, "{}", info.name);
                continue;
            };
            assert!(info.explained, "{}", info.name);
            let ((p, q), (u, v)) = (velocity(&body.motion), velocity(&slow));
            let scale = 1e-6 * 0.1;
            assert!((0.5 * p).abs_diff_eq(u, scale) && (0.5 * q).abs_diff_eq(v, scale), "{}", info.name);
            let same = body.motion.edited(MotionEdit::default()).unwrap().pose(1.0);
            assert!(same.position.abs_diff_eq(body.motion.pose(1.0).position, 1e-12));
        }
    }
}

#[test]
fn potentials_and_forces_are_scaled_apart() {
    let at = |scene: &str, changed: MotionEdit| {
        let stage = find(scene, 1).unwrap().stage.edited(changed).unwrap();
        stage.bodies[0].motion.pose(1.0)
    };
    let (own, half, none) = (MotionEdit::default(), edit(1.0, 0.5, 1.0), edit(1.0, 1.0, 0.0));
    let moved = |scene: &str, changed| {
        let (a, b) = (at(scene, own), at(scene, changed));
        (a.position - b.position).length()
            + (a.linear - b.linear).to_cols_array().iter().map(|v| v.abs()).sum::<f64>()
    };
    for scene in ["falling-ball", "large-pendulum", "kepler", "double-well", "spring-pair", "top", "bounce"] {
        assert!(moved(scene, half) > 1e-2 && moved(scene, none) == 0.0, "{scene}");
    }
    for scene in ["sled", "spun-up-fan", "rolling-ball"] {
        assert!(moved(scene, none) > 1e-2 && moved(scene, half) == 0.0, "{scene}");
    }
    for scene in ["torsion-spring", "quadratic-drag", "vibration"] {
        assert!(moved(scene, none) > 1e-3 && moved(scene, half) > 1e-3, "{scene}");
    }
    for scene in ["fan", "tumbling"] {
        assert!(
            moved(scene, none) == 0.0 && moved(scene, half) == 0.0,
            "{scene}: constraints are not scaled"
        );
    }
}

#[test]
fn a_ball_stays_between_floor_and_walls_under_every_edit() {
    for (scene, seed) in ["wall", "corner"].into_iter().flat_map(|name| SEEDS.map(move |seed| (name, seed))) {
        let motion = find(scene, seed).unwrap().stage.bodies[0].motion.clone();
        let Motion::Bounce(bounce) = &motion else { panic!("{scene} bounces") };
        for changed in [MotionEdit::default(), edit(0.5, 1.0, 1.0), edit(1.0, 2.0, 1.0)] {
            let path = motion.edited(changed).unwrap();
            for position in (0..=900).map(|i| path.pose(f64::from(i) / 400.0).position) {
                let over = |wall: &Wall| wall.normal.dot(position) - wall.offset;
                let lowest = bounce.walls.iter().map(over).fold(position.z, f64::min);
                assert!(lowest > -1e-9, "{scene} {seed}: {position}");
            }
        }
        let turns = bounce.walls.iter().map(|wall| wall.normal.dot(bounce.pose(0.75).position) - wall.offset);
        assert!(
            turns.clone().all(|far| far > 0.01),
            "{scene} {seed} has turned back at every wall: {turns:?}"
        );
    }
}
