//! Bands that hold what is not known of a joint or of modes, over many draws of the noise.

use super::kinematics::systems;
use super::known::GeneralisedLaw;
use super::observed::ObservedPoses;
use super::{Laws, Surroundings, find_law};
use crate::motion::pose::{Pose, PoseKind};
use crate::motion::shared_motion::SharedMotion;
use crate::testing::block;
use glam::{DMat3, DVec3};
use lgs_core::geometry::{outer, rotation_by};
use lgs_mechanics::coordinates::{Coordinates, Embedding};
use lgs_mechanics::{Edit, System};
use rand::RngExt;

/// Noise of angles and places of poses.
const NOISE: f64 = 1e-3;

fn shape() -> Vec<DVec3> {
    block([0.5, 0.3, 0.2], 64, 5)
}

/// A motion of which the poses at 76 times are seen with noise.
fn seen(kind: PoseKind, seed: u64, pose: &dyn Fn(f64) -> Pose) -> SharedMotion {
    let mut rng = lgs_core::stream(seed, "noise of poses", 0);
    let mut draw = || DVec3::from([(); 3].map(|()| NOISE * rng.sample::<f64, _>(rand_distr::StandardNormal)));
    let times: Vec<f64> = (0..76).map(|i| 0.01 * f64::from(i)).collect();
    let disturbed = |t: &f64| {
        let Pose { linear, shift } = pose(*t);
        let linear = match kind {
            PoseKind::Rigid => rotation_by(draw()) * linear,
            PoseKind::Affine => linear + DMat3::from_cols(draw(), draw(), draw()),
        };
        Pose { linear, shift: shift + draw() }
    };
    let poses = times.iter().map(disturbed).collect();
    SharedMotion {
        kind,
        times,
        poses,
        shape: shape(),
        weights: vec![1.0 / 64.0; 64],
        deviations: Vec::new(),
        residual: 0.0,
    }
}

/// Share of a body's true positions inside of the band of its law, from 0 to 3 windows.
fn covered(found: &GeneralisedLaw, truth: &dyn Fn(f64) -> Pose) -> f64 {
    let band = &found.known.band;
    let inside = |(time, radius): (&f64, &Option<f64>)| {
        let state =
            System::new(&found.law, Edit::NONE).states(&found.start, &[*time]).expect("a motion").remove(0);
        let placed = Embedding::new(&found.law.coordinates, &found.start.x).placements(&state.x)[0];
        let radius = radius.unwrap_or(f64::INFINITY);
        let near =
            |b: &&DVec3| placed.apply(found.bases[0].apply(**b)).distance(truth(*time).apply(**b)) <= radius;
        shape().iter().filter(near).count() as f64 / 64.0
    };
    let times = band.times.iter().zip(&band.radius).filter(|(time, _)| **time > 0.0);
    let shares: Vec<f64> = times.map(inside).collect();
    shares.iter().sum::<f64>() / shares.len().max(1) as f64
}

#[test]
fn the_band_of_a_body_on_a_hinge_holds_what_is_not_known_of_the_hinge() {
    let axis = DVec3::new(0.6, 0.0, 0.8);
    let truth = |t: f64| {
        let linear = rotation_by(axis * (0.6 + 0.9 * t));
        Pose { linear, shift: DVec3::new(0.1, 0.2, -0.1) + linear * DVec3::new(0.3, 0.8, 0.4) }
    };
    let shares = (0..10).map(|seed| {
        let body = seen(PoseKind::Rigid, seed, &truth);
        let found = find_law(&[&body], (Laws::All, Surroundings::default()), 0.0, 1).expect("a law");
        assert!(matches!(found.law.coordinates, Coordinates::Hinge(_)), "{:?}", found.law);
        covered(&found, &truth)
    });
    let mean = shares.sum::<f64>() / 10.0;
    assert!((0.8..0.995).contains(&mean), "{mean}");
}

#[test]
fn nothing_rolls_on_less_than_an_axle() {
    let advances = |along: DVec3, advance: f64| {
        let truth = |t: f64| {
            let angle = 0.6 + 6.0 * t;
            Pose { linear: rotation_by(DVec3::Z * angle), shift: along * advance * angle }
        };
        let body = seen(PoseKind::Rigid, 1, &truth);
        let systems = systems(&ObservedPoses::new(&body, Laws::All, 0.0));
        systems.iter().any(|system| matches!(system.coordinates, Coordinates::Rolling(_)))
    };
    assert_eq!(
        [0.0, 0.01, 0.02, 0.5].map(|advance| advances(DVec3::X, advance)),
        [false, false, false, true]
    );
    assert!(advances(DVec3::Z, 0.1), "a screw");
}

#[test]
fn normal_modes_that_are_not_orthogonal_are_found_each_with_its_own_damping() {
    let stretch = outer(DVec3::X, DVec3::X) - 0.4 * outer(DVec3::Y, DVec3::Y);
    let shear = outer(DVec3::Y, DVec3::X) + outer(DVec3::X, DVec3::Y) + 0.2 * outer(DVec3::X, DVec3::X);
    let swing = |t: f64, (amplitude, square, damping): (f64, f64, f64)| {
        let rate = (square - 0.25 * damping * damping).sqrt();
        amplitude * (-0.5 * damping * t).exp() * (rate * t + 0.4).cos()
    };
    let (first, second) = ((0.5, 25.0, 0.3), (0.5, 70.0, 0.9));
    let truth = |t: f64| Pose {
        linear: DMat3::IDENTITY + swing(t, first) * stretch + swing(t, second) * shear,
        shift: DVec3::ZERO,
    };
    let body = seen(PoseKind::Affine, 3, &truth);
    let found = find_law(&[&body], (Laws::All, Surroundings::default()), 0.0, 1).expect("a law");
    let terms: Vec<&str> = found.law.terms.iter().map(|term| term.kind.name()).collect();
    assert_eq!(terms, ["spring-diagonal", "damping-diagonal"]);
    let mut modes: Vec<[(f64, f64); 2]> =
        (0..2).map(|i| [i, 4 + i].map(|at| (found.law.parameters[at], found.law.deviations[at]))).collect();
    modes.sort_by(|a, b| a[0].0.total_cmp(&b[0].0));
    for ([square, damping], (_, k, d)) in modes.iter().zip([first, second]) {
        assert!((square.0 - k).abs() < 3.0 * square.1, "{modes:?}");
        assert!((damping.0 - d).abs() < 3.0 * damping.1, "{modes:?}");
    }
    let share = covered(&found, &truth);
    assert!(share > 0.8, "{share}");
}
