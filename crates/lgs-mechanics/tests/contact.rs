//! Bodies that fall on a plane: impacts, friction, rest, the way back, and faults of the file.
#![allow(clippy::unwrap_used, reason = "tests")]

mod common;

use common::{law, state};
use lgs_core::stream;
use lgs_mechanics::bands::Verdict;
use lgs_mechanics::collisions::{Bounced, fit};
use lgs_mechanics::contact::{Contact, Impact, Origin, Plane, extreme_points, impacts, pieces};
use lgs_mechanics::coordinates::{Coordinates, Inertia, InertiaForm, Port, State};
use lgs_mechanics::{Candidate, Edit, Law, System};
use rand_distr::{Distribution, StandardNormal};

const GRAVITY: f64 = 9.81;
const HALF: f64 = 0.05;

fn floor(restitution: f64, friction: f64) -> Contact {
    Contact {
        plane: Plane { normal: [0.0, 0.0, 1.0], offset: 0.0 },
        walls: Vec::new(),
        points: vec![[0.0; 3]],
        radius: 0.1,
        restitution,
        friction,
        resting_speed: Contact::resting_speed(GRAVITY, 1e-4),
        deviations: [0.0; 2],
        origin: Origin::Given,
    }
}

/// A ball of radius 0.1 under gravity.
fn ball(restitution: f64) -> Law {
    let mut ball = law(Coordinates::Point, &[], &[("uniform-field", Port::Whole, &[0.0, 0.0, -GRAVITY])]);
    ball.contact = Some(floor(restitution, 0.2));
    ball
}

fn corners() -> Vec<[f64; 3]> {
    let sign = |bit: usize| if bit == 0 { -HALF } else { HALF };
    (0..8).map(|k| [sign(k & 1), sign(k & 2), sign(k & 4)]).collect()
}

/// A cube under gravity.
fn cube(restitution: f64, friction: f64) -> Law {
    let inertia = Inertia { form: InertiaForm::Prior, ..Inertia::ball(2.0 / 3.0 * HALF * HALF) };
    let terms: [(&str, Port, &[f64]); 1] = [("uniform-field", Port::Center, &[0.0, 0.0, -GRAVITY])];
    let mut cube = law(Coordinates::Rigid(inertia), &[], &terms);
    cube.step = 1.0 / 150.0;
    cube.contact = Some(Contact { points: corners(), radius: 0.0, ..floor(restitution, friction) });
    cube
}

fn thrown_cube() -> State {
    let q = glam::DQuat::from_euler(glam::EulerRot::XYZ, 0.5, -0.4, 0.9);
    state(&[q.w, q.x, q.y, q.z, 0.0, 0.0, 0.3], &[4.0, -7.0, 3.0, 0.8, 0.1, 0.3])
}

/// Height of the lowest corner.
fn lowest(state: &State) -> f64 {
    let q = glam::DQuat::from_xyzw(state.x[1], state.x[2], state.x[3], state.x[0]);
    let height = |corner: [f64; 3]| state.x[6] + (q * glam::DVec3::from(corner)).z;
    corners().into_iter().map(height).fold(f64::INFINITY, f64::min)
}

#[test]
fn a_ball_bounces_to_the_height_that_restitution_leaves() {
    let law = ball(0.8);
    let start = state(&[0.0, 0.0, 1.1], &[0.5, 0.0, 0.0]);
    let system = System::new(&law, Edit::NONE);
    let first = (2.0 / GRAVITY).sqrt();
    let impacts = system.impacts(&start, 1.2).unwrap();
    let expected = [first, first * (1.0 + 2.0 * 0.8)];
    for (impact, expected) in impacts.iter().zip(expected) {
        assert!((impact.time - expected).abs() < 1e-6, "{impacts:?} for {expected:?}");
    }
    let top = first * 1.8;
    let height = system.states(&start, &[top]).unwrap()[0].x[2] - 0.1;
    assert!((height - 0.64).abs() < 1e-5, "{height}");
    let times: Vec<f64> = (0..2000).map(|k| f64::from(k) * 0.01).collect();
    let states = system.states(&start, &times).unwrap();
    assert!(states.iter().all(|state| state.x[2] >= 0.1 - 1e-9));
    let last = &states[1999];
    assert!((last.x[2] - 0.1).abs() < 1e-9 && last.v.iter().all(|v| v.abs() < 1e-9), "{last:?}");
}

#[test]
fn a_ball_between_two_walls_and_a_floor_keeps_within_them() {
    let mut law = ball(0.8);
    let wall = |normal: [f64; 3]| Plane { normal, offset: -0.5 };
    law.contact.iter_mut().for_each(|contact| {
        contact.walls = vec![wall([1.0, 0.0, 0.0]), wall([-1.0, 0.0, 0.0])];
        contact.friction = 0.0;
    });
    let start = state(&[0.0, 0.0, 1.1], &[1.5, 0.3, 0.0]);
    let system = System::new(&law, Edit::NONE);
    let changes: Vec<Vec<f64>> =
        system.impacts(&start, 0.6).unwrap().into_iter().map(|impact| impact.change).collect();
    let [wall, floor] = [&changes[0], &changes[1]];
    assert!((wall[0] + 1.8 * 1.5).abs() < 1e-6 && wall[2].abs() < 1e-12, "{wall:?}");
    assert!(floor[0].abs() < 1e-12 && floor[2] > 0.0, "{floor:?}");
    let times: Vec<f64> = (0..1000).map(|k| f64::from(k) * 0.01).collect();
    for at in system.states(&start, &times).unwrap() {
        assert!(at.x[0].abs() <= 0.4 + 1e-9 && at.x[2] >= 0.1 - 1e-9, "{at:?}");
    }
}

#[test]
fn a_cube_in_a_corner_comes_to_rest_against_floor_and_wall() {
    // It slides down the ground until the wall stops it.
    let mut law = cube(0.2, 0.1);
    law.contact.iter_mut().for_each(|contact| {
        contact.plane.normal = [0.6, 0.0, 0.8];
        contact.walls = vec![Plane { normal: [-0.8, 0.0, 0.6], offset: -0.5 }];
    });
    let start = state(&[1.0, 0.0, 0.0, 0.0, -0.1, 0.0, 0.4], &[0.0, 0.0, 0.0, 0.2, 0.0, 0.0]);
    let times: Vec<f64> = (0..500).map(|k| f64::from(k) * 0.01).collect();
    let states = System::new(&law, Edit::NONE).states(&start, &times).unwrap();
    let contact = law.contact.as_ref().unwrap();
    let deepest = states.iter().map(|at| contact.gap(&at.x)).fold(f64::INFINITY, f64::min);
    assert!(deepest > -1e-3, "{deepest}");
    let moved = law.coordinates.difference(&states[400].x, &states[499].x);
    assert!(moved.iter().all(|d| d.abs() < 1e-4), "{moved:?}");
    assert!(contact.planes().all(|plane| contact.gap_to(plane, &states[499].x) < 1e-3));
}

#[test]
fn weaker_gravity_meets_the_same_plane() {
    let law = ball(0.5);
    let start = state(&[0.0, 0.0, 1.1], &[0.0; 3]);
    let system = System::new(&law, Edit { potential: 0.25, ..Edit::NONE });
    let impacts = system.impacts(&start, 1.0).unwrap();
    assert!((impacts[0].time - 2.0 * (2.0 / GRAVITY).sqrt()).abs() < 1e-6, "{impacts:?}");
}

#[test]
fn a_cube_comes_to_rest_on_a_face_and_stays() {
    for (restitution, friction) in [(0.0, 0.2), (0.3, 0.3), (0.5, 0.8)] {
        let law = cube(restitution, friction);
        let times: Vec<f64> = (0..400).map(|k| f64::from(k) * 0.01).collect();
        let states = System::new(&law, Edit::NONE).states(&thrown_cube(), &times).unwrap();
        let deepest = states.iter().map(lowest).fold(f64::INFINITY, f64::min);
        assert!(deepest > -1e-3, "{deepest} at e {restitution}");
        for pair in states.windows(2) {
            let [before, after] = [0, 1].map(|k| law.energy(&pair[k]));
            assert!(after <= before + 1e-4 * before.abs(), "{before} to {after}");
        }
        let [rest, last] = [&states[300], &states[399]];
        assert!((last.x[6] - HALF).abs() < 1e-4, "height {}", last.x[6]);
        let moved = law.coordinates.difference(&rest.x, &last.x);
        assert!(moved.iter().all(|d| d.abs() < 1e-5), "{moved:?}");
    }
}

#[test]
fn a_cube_slides_as_far_as_friction_lets_it() {
    let law = cube(0.0, 0.25);
    let start = state(&[1.0, 0.0, 0.0, 0.0, 0.0, 0.0, HALF], &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0]);
    let last = System::new(&law, Edit::NONE).states(&start, &[2.0]).unwrap().swap_remove(0);
    let expected = 1.0 / (2.0 * 0.25 * GRAVITY);
    assert!((last.x[4] / expected - 1.0).abs() < 0.01, "{} for {expected}", last.x[4]);
    assert!((last.x[6] - HALF).abs() < 1e-6 && last.v.iter().all(|v| v.abs() < 1e-6), "{last:?}");
}

#[test]
fn the_way_back_past_an_impact_needs_its_record() {
    let mut law = ball(0.8);
    let start = state(&[0.0, 0.0, 1.1], &[0.5, 0.0, 0.0]);
    let met = System::new(&law, Edit::NONE).impacts(&start, 0.7).unwrap();
    let later = System::new(&law, Edit::NONE).states(&start, &[0.7]).unwrap().swap_remove(0);
    let fault = System::new(&law, Edit::NONE).states(&later, &[-0.7]).unwrap_err().to_string();
    assert!(fault.starts_with("the motion is not determined beyond time -0.2"), "{fault}");
    law.impacts = met;
    law.impacts[0].time -= 0.7;
    let back = System::new(&law, Edit::NONE).states(&later, &[-0.7]).unwrap().swap_remove(0);
    let apart = back.x.iter().zip(&start.x).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(apart < 1e-6, "{back:?}");
}

#[test]
fn impacts_are_found_in_a_track() {
    let law = ball(0.7);
    let times: Vec<f64> = (0..90).map(|k| f64::from(k) / 60.0).collect();
    let start = state(&[0.0, 0.0, 1.1], &[0.5, 0.0, 0.0]);
    let system = System::new(&law, Edit::NONE);
    let states = system.states(&start, &times).unwrap();
    let noise = |k: usize, axis: usize| 0.001 * ((k * 7919 + axis * 104_729) as f64 * 0.61).sin();
    let noisy: Vec<[f64; 3]> =
        (0..90).map(|k| [0, 1, 2].map(|axis| states[k].x[axis] + noise(k, axis))).collect();
    let truth: Vec<f64> = system.impacts(&start, 1.4).unwrap().iter().map(|impact| impact.time).collect();
    let found = impacts(&times, &noisy);
    assert_eq!(found.len(), truth.len(), "{found:?} for {truth:?}");
    for (found, truth) in found.iter().zip(&truth) {
        assert!((found.time - truth).abs() < 1.0 / 60.0, "{found:?} for {truth}");
    }
    assert_eq!(pieces(&times, &found).len(), truth.len() + 1);
    let smooth: Vec<[f64; 3]> = times.iter().map(|t| [(9.0 * t).sin(), (7.0 * t).cos(), t * t]).collect();
    assert!(impacts(&times, &smooth).is_empty());
}

/// A law fitted to samples of another with small errors, from a contact without restitution and friction.
fn refitted(law: &Law, start: &State, until: f64, error: f64) -> Bounced {
    let times: Vec<f64> = (0..90).map(|k| 0.3 + until * f64::from(k) / 89.0).collect();
    let since: Vec<f64> = times.iter().map(|time| time - 0.3).collect();
    let states = System::new(law, Edit::NONE).states(start, &since).unwrap();
    let mut stream = stream(1, "bounces", 0);
    let mut noise = || -> f64 { StandardNormal.sample(&mut stream) };
    let spoiled = |state: &State| {
        let change: Vec<f64> = state.v.iter().map(|_| error * noise()).collect();
        law.coordinates.retract(&state.x, &change)
    };
    let x: Vec<Vec<f64>> = states.iter().map(spoiled).collect();
    let candidate = Candidate::new(law.coordinates.clone(), law.terms.clone()).unwrap();
    let contact = Contact { restitution: 0.0, friction: 0.0, ..law.contact.clone().unwrap() };
    fit(&candidate, &times, &x, &contact).unwrap()
}

#[test]
fn restitution_of_a_ball_is_found() {
    let ball = ball(0.73);
    let start = state(&[0.0, 0.0, 1.1], &[4.0, 0.0, 0.0]);
    let found = refitted(&ball, &start, 1.3, 0.001);
    let contact = found.law.contact.as_ref().unwrap();
    assert!(
        (contact.restitution / 0.73 - 1.0).abs() < 0.02,
        "{} ± {:?}",
        contact.restitution,
        found.deviations
    );
    assert!((contact.friction / 0.2 - 1.0).abs() < 0.1, "{} ± {:?}", contact.friction, found.deviations);
    let truth = System::new(&ball, Edit::NONE).impacts(&start, 1.3).unwrap();
    assert_eq!(found.law.impacts.len(), truth.len());
    let late = |(a, b): (&Impact, &Impact)| (a.time - b.time).abs() > 0.5 * 1.3 / 89.0;
    assert!(!found.law.impacts.iter().zip(&truth).any(late), "{:?} for {truth:?}", found.law.impacts);
    let (verdict, trusted) = found.verdict(0.04, 0).unwrap();
    let told = format!("{verdict:?} until {trusted}, {} and {}", found.chi_square, found.error);
    assert!(verdict == Verdict::Explained && trusted > 2.2, "{told}");
    let later = System::new(&ball, Edit::NONE).states(&start, &[1.6]).unwrap();
    let error = found.distance(&later[0], &found.states(&[1.9]).unwrap()[0]);
    assert!(error < 2.0 * found.radius(&[1.9], 0).unwrap()[0], "{error}");
}

#[test]
fn restitution_and_friction_of_a_cube_are_found() {
    let found = refitted(&cube(0.4, 0.25), &thrown_cube(), 0.5, 0.0003);
    let contact = found.law.contact.as_ref().unwrap();
    let told = format!(
        "{} {} ± {:?}, error {}",
        contact.restitution, contact.friction, found.deviations, found.error
    );
    assert!((contact.restitution - 0.4).abs() < 0.05 && (contact.friction - 0.25).abs() < 0.05, "{told}");
    assert!((found.law.parameters[2] + GRAVITY).abs() < 0.02 * GRAVITY, "{:?}", found.law.parameters);
    let rest = found.states(&[6.0]).unwrap().swap_remove(0);
    assert!((rest.x[6] - HALF).abs() < 1e-4, "{told}, rest {rest:?}");
}

#[test]
fn planes_and_corners_are_found() {
    let table: Vec<[f64; 3]> = (0..25).map(|k| [f64::from(k % 5), f64::from(k / 5), 0.5]).collect();
    let plane = Plane::through(&table, [2.0, 2.0, 3.0]).unwrap();
    assert!((plane.offset - 0.5).abs() < 1e-12 && (plane.normal[2] - 1.0).abs() < 1e-12, "{plane:?}");
    assert!(Plane::through(&table[..5], [0.0; 3]).is_none());
    let mut points = corners();
    points.extend(corners().iter().map(|corner| corner.map(|c| 0.5 * c)));
    assert_eq!(extreme_points(&points), corners());
}

#[test]
fn faults_of_contacts_and_impacts_are_named() {
    let mut good = cube(0.3, 0.2);
    good.impacts = System::new(&good, Edit::NONE).impacts(&thrown_cube(), 1.0).unwrap();
    assert!(good.impacts.len() > 1);
    let text = serde_json::to_string(&good).unwrap();
    assert_eq!(serde_json::from_str::<Law>(&text).unwrap(), good);
    let fault = |spoil: &dyn Fn(&mut Law)| {
        let mut law = good.clone();
        spoil(&mut law);
        let text = serde_json::to_string(&law).unwrap();
        serde_json::from_str::<Law>(&text).unwrap_err().to_string()
    };
    let order = fault(&|law| law.impacts.swap(0, 1));
    assert!(order.starts_with("impact 1 of a law is at time"), "{order}");
    let size = fault(&|law| law.impacts[0].change.truncate(3));
    assert_eq!(size, "change of velocity of impact 0: 6 values expected, 3 found");
    let elastic = fault(&|law| law.contact.as_mut().unwrap().restitution = 1.5);
    assert!(elastic.starts_with("a value of a contact is -0.5"), "{elastic}");
    let tilted = fault(&|law| law.contact.as_mut().unwrap().plane.normal = [0.0, 1.0, 1.0]);
    assert!(tilted.starts_with("length of a plane's normal is 1.4"), "{tilted}");
    let empty = fault(&|law| law.contact.as_mut().unwrap().points.clear());
    assert_eq!(empty, "points of a contact: 1 values expected, 0 found");
    let mut hinge = law(common::hinge(), &[], &[]);
    hinge.contact = Some(floor(0.5, 0.5));
    assert!(hinge.check().unwrap_err().to_string().contains("`contact` cannot act on `plane` of hinge"));
}
