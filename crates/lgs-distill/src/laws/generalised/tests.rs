//! Joints, centres of mass and laws of bodies whose motion is known.

use super::geometry::{center_of_mass, pivot};
use super::turning::Turning;
use super::{Laws, PartSearch, Surroundings, find_law};
use crate::motion::pose::{Pose, PoseKind};
use crate::motion::shared_motion::SharedMotion;
use crate::testing::block;
use glam::DVec3;
use lgs_core::geometry::rotation_by;
use lgs_mechanics::coordinates::{Coordinates, Embedding, Port, State, Tree};
use lgs_mechanics::terms::Term;
use lgs_mechanics::{Edit, Law, System};
use rand::RngExt;

const SAMPLES: usize = 61;

fn times() -> Vec<f64> {
    (0..SAMPLES).map(|i| 0.75 * i as f64 / (SAMPLES - 1) as f64).collect()
}

fn motion(pose: impl Fn(f64) -> Pose) -> SharedMotion {
    let shape = block([0.3, 0.2, 0.1], 64, 5);
    let weights = vec![1.0 / 64.0; 64];
    let poses = times().into_iter().map(pose).collect();
    SharedMotion {
        kind: PoseKind::Rigid,
        times: times(),
        poses,
        shape,
        weights,
        deviations: Vec::new(),
        residual: 0.0,
    }
}

/// A body that turns about an axis through a pivot by an angle.
fn turned(axis: DVec3, pivot: DVec3, angle: f64) -> Pose {
    let linear = rotation_by(axis * angle);
    Pose { linear, shift: pivot + linear * DVec3::new(0.4, 0.1, -0.2) }
}

#[test]
fn an_axis_and_a_pivot_are_read_off_the_poses() {
    let (axis, point) = (DVec3::new(0.6, 0.0, 0.8), DVec3::new(0.2, -0.3, 1.0));
    let angle = |t: f64| 9.0 * t * t - 1.0;
    let poses = motion(|t| turned(axis, point, angle(t))).poses;
    let turning = Turning::about_one_axis(&poses).expect("an axis");
    assert!(turning.axis.cross(axis).length() < 1e-9);
    let total = turning.angles[SAMPLES - 1] - turning.angles[0];
    assert!((total.abs() - 9.0 * 0.75 * 0.75).abs() < 1e-6, "{total}");
    let (found, _) = pivot(&poses).expect("a pivot");
    assert!((found - point).cross(axis).length() < 1e-6, "{found}");
}

#[test]
fn the_centre_of_mass_of_a_thrown_body_is_found_where_its_path_is_a_parabola() {
    let offset = DVec3::new(0.05, -0.02, 0.0);
    let thrown = |t: f64| {
        let linear = rotation_by(DVec3::new(0.0, 0.0, 4.0 * t));
        let center = DVec3::new(0.5 * t, 0.0, t - 0.6 * t * t);
        Pose { linear, shift: center - linear * offset }
    };
    let found = center_of_mass(&motion(thrown).poses, &times(), 3).expect("a centre");
    assert!(found.truncate().distance(offset.truncate()) < 1e-6, "{found}");
    let law = find_law(&[&motion(thrown)], (Laws::All, Surroundings::default()), 0.0, 1).expect("a law").law;
    assert_eq!(law.terms.iter().map(|term| term.kind.name()).collect::<Vec<_>>(), ["uniform-field"]);
    let field = DVec3::from_slice(&law.parameters[law.range(0)]);
    assert!(field.distance(DVec3::new(0.0, 0.0, -1.2)) < 1e-3, "{field}");
}

#[test]
fn a_body_that_falls_and_hardly_turns_does_not_roll() {
    let falling = |t: f64| {
        let fallen = 1.1 * t * t;
        Pose { linear: rotation_by(DVec3::Y * (0.03 * fallen)), shift: DVec3::new(0.2, 0.0, 1.0 - fallen) }
    };
    let law = find_law(&[&motion(falling)], (Laws::All, Surroundings::default()), 0.0, 1).expect("a law").law;
    assert!(!matches!(law.coordinates, Coordinates::Rolling(_)), "{law:?}");
}

#[test]
fn a_constant_torque_on_a_hinge_is_a_drive_and_is_left_out_where_only_potentials_are_admitted() {
    let body = motion(|t| turned(DVec3::Z, DVec3::ZERO, 0.4 * t + 3.0 * t * t));
    let terms = |laws: Laws| -> Vec<&str> {
        let law = find_law(&[&body], (laws, Surroundings::default()), 0.0, 1).expect("a law").law;
        assert!(matches!(law.coordinates, Coordinates::Hinge(_)), "{law:?}");
        law.terms.iter().map(|term| term.kind.name()).collect()
    };
    assert_eq!(terms(Laws::All), ["constant-drive"]);
    assert!(!terms(Laws::Conservative).contains(&"constant-drive"));
}

/// The motions of two bodies by a law, each with noise of its own, in the order of its coordinates; what is
/// seen of them at the start is centred on two places.
fn two_by(law: &Law, start: &State, places: [DVec3; 2]) -> [SharedMotion; 2] {
    let states = System::new(law, Edit::NONE).states(start, &times()).expect("a motion");
    let embedding = Embedding::new(&law.coordinates, &start.x);
    let mut rng = lgs_core::stream(3, "noise of couples", 0);
    let mut draw = || DVec3::from([(); 3].map(|()| 2e-4 * rng.sample::<f64, _>(rand_distr::StandardNormal)));
    [0, 1].map(|body| {
        let place = places[body];
        let pose = |state: &State| {
            let placed = embedding.placements(&state.x)[body];
            Pose { linear: rotation_by(draw()) * placed.linear, shift: placed.apply(place) + draw() }
        };
        SharedMotion { poses: states.iter().map(pose).collect(), ..motion(|t| turned(DVec3::Z, place, t)) }
    })
}

fn couple(coordinates: Coordinates, own: &[f64], terms: &[(&str, Port, &[f64])]) -> Law {
    let placed = terms.iter().map(|(name, port, _)| Term::named(name, *port).expect("a term")).collect();
    let values = terms.iter().flat_map(|(_, _, values)| values.iter().copied());
    let values = own.iter().copied().chain(values).collect();
    Law::new(coordinates, placed, values, 0.005).expect("a law")
}

#[test]
fn two_bodies_on_a_spring_are_told_from_two_that_fall_side_by_side() {
    let field: (&str, Port, &[f64]) = ("uniform-field", Port::Both, &[0.0, 0.0, -1.0]);
    let spring: (&str, Port, &[f64]) = ("spring-length", Port::Between, &[20.0, 0.8]);
    let start = State { x: vec![-0.5, 0.0, 0.0, 0.6, 0.1, 0.0], v: vec![0.1, -0.4, 0.5, 0.1, 0.3, 0.5] };
    let found = |terms: &[(&str, Port, &[f64])]| {
        let law = couple(Coordinates::Pair, &[1.4, 0.0, 0.0, 0.0], terms);
        let [a, b] = two_by(&law, &start, [DVec3::new(-0.5, 0.02, 0.0), DVec3::new(0.6, 0.1, 0.04)]);
        find_law(&[&a, &b], (Laws::All, Surroundings::default()), 0.0, 1)
    };
    let law = found(&[field, spring]).expect("a law").law;
    assert_eq!(law.coordinates, Coordinates::Pair);
    let near = |at: usize, truth: f64| (law.parameters[at] / truth - 1.0).abs() < 0.02;
    assert!(near(0, 1.4) && near(6, -1.0) && near(7, 20.0), "{law:?}");
    assert!(found(&[field]).is_none(), "nothing acts between them");
}

#[test]
fn a_pendulum_on_a_pendulum_has_two_hinges_whichever_comes_first() {
    let [axis, pivot, link, arm] = [[0.0, 1.0, 0.0], [0.1, 0.0, 0.5], [0.0, 0.1, -0.6], [0.0, 0.0, -0.5]];
    let terms: [(&str, Port, &[f64]); 2] =
        [("fourier", Port::First, &[12.0, 0.0]), ("fourier", Port::Second, &[5.0, 0.0])];
    let law = couple(Coordinates::Tree(Tree { axis, pivot, link, arm }), &[0.4, 0.6, 0.0], &terms);
    let start = State { x: vec![0.8, -0.5], v: vec![0.5, -1.0] };
    let [upper, lower] = two_by(&law, &start, [DVec3::new(0.1, 0.0, -0.4), DVec3::new(0.2, 0.1, -0.9)]);
    let found = find_law(&[&lower, &upper], (Laws::All, Surroundings::default()), 0.0, 1).expect("a law");
    assert_eq!(found.order, [1, 0], "the upper body hangs in the world");
    let Coordinates::Tree(tree) = found.law.coordinates else { panic!("{:?}", found.law) };
    let (axis, pivot) = (DVec3::from(tree.axis), DVec3::from(tree.pivot));
    assert!(axis.y.abs() > 0.999 && (pivot - DVec3::new(0.1, pivot.y, 0.5)).length() < 0.01, "{tree:?}");
    let later = System::new(&law, Edit::NONE).states(&start, &[1.5]).expect("a motion").remove(0);
    let forecast = System::new(&found.law, Edit::NONE).states(&found.start, &[1.5]).expect("one").remove(0);
    let turn = |now: f64, then: f64| (now - then).abs();
    let turns =
        |body: usize| turn(forecast.x[body], found.start.x[body]) - turn(later.x[body], start.x[body]);
    assert!([0, 1].iter().all(|&body| turns(body).abs() < 0.02), "{forecast:?} for {later:?}");
}

#[test]
fn what_is_let_go_in_the_window_has_a_law_of_its_end_and_what_is_grabbed_one_of_its_beginning() {
    let noise = |t: f64| 1e-4 * DVec3::new((4001.0 * t).sin(), (5003.0 * t).sin(), (6007.0 * t).sin());
    let at = |shift: DVec3| Pose { linear: glam::DMat3::IDENTITY, shift };
    let swing = |t: f64| DVec3::new((9.0 * t).sin(), (7.0 * t).cos() - 1.0, (11.0 * t).sin()) * 0.2;
    let fall = |t: f64| -1.5 * t * t * DVec3::Z;
    let released = motion(|t| at(swing(t.min(0.3)) + fall((t - 0.3).max(0.0)) + noise(t)));
    let search = PartSearch { laws: Laws::All, resolution: 1e-4, slow_error: 0.0, impacts: &[], seed: 1 };
    let last = search.last(&released).expect("a law of the end");
    assert!(last.samples.end == SAMPLES && times()[last.samples.start] > 0.29, "{:?}", last.samples);
    let terms = |law: &Law| law.terms.iter().map(|term| term.kind.name()).collect::<Vec<_>>();
    assert_eq!(terms(&last.law.law), ["uniform-field"]);
    assert!((last.law.law.parameters[2] + 3.0).abs() < 0.1, "{:?}", last.law.law);
    let grabbed = motion(|t| at(fall(t.min(0.45)) + swing((t - 0.45).max(0.0)) + noise(t)));
    let first = search.first(&grabbed).expect("a law of the beginning");
    assert!(first.samples.start == 0 && times()[first.samples.end - 1] < 0.46, "{:?}", first.samples);
    assert_eq!(terms(&first.law.law), ["uniform-field"]);
}
