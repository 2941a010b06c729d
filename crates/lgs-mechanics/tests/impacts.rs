//! Laws through impacts from tracks alone: planes at rest, planes that impacts tell of, surfaces of bodies.
#![allow(clippy::unwrap_used, reason = "tests")]

mod common;

use common::{law, round_body, state};
use glam::{DQuat, DVec3};
use lgs_core::stream;
use lgs_mechanics::choose::candidates;
use lgs_mechanics::collisions::{Body, Bounced, Observed, explain};
use lgs_mechanics::contact::{Contact, Ground, Plane, Surface, impacts, planes};
use lgs_mechanics::coordinates::{Ball, Coordinates, Inertia, InertiaForm, Port, State};
use lgs_mechanics::{Edit, Law, System};
use rand_distr::{Distribution, StandardNormal};

/// A floor that is tilted about the y axis.
fn tilted(angle: f64, size: f64) -> Plane {
    Plane { normal: [angle.sin(), 0.0, angle.cos()], offset: 0.02 * size }
}

/// Points of a plane with others beside it.
fn scattered(plane: &Plane, size: f64, roughness: f64) -> Vec<[f64; 3]> {
    let normal = DVec3::from(plane.normal);
    let (first, second) = normal.any_orthonormal_pair();
    let mut draws = stream(4, "table", 0);
    let mut noise = || -> f64 { StandardNormal.sample(&mut draws) };
    let mut points: Vec<[f64; 3]> = (0..300)
        .map(|_| {
            (first * noise() + second * noise() + normal * (plane.offset / size + roughness * noise())) * size
        })
        .map(|point| point.to_array())
        .collect();
    points.extend((0..60).map(|_| [noise(), noise(), 1.0 + noise().abs()].map(|c| size * c)));
    points
}

#[test]
fn planes_are_found_among_other_points_in_every_unit() {
    for size in [0.01, 1.0, 100.0] {
        let truth = tilted(0.4, size);
        let found = planes(&scattered(&truth, size, 0.003), [0.0, 0.0, 3.0 * size], 0.01 * size);
        let plane = found[0].plane;
        let angle = DVec3::from(plane.normal).angle_between(DVec3::from(truth.normal));
        assert!(angle < 2e-3 && (plane.offset - truth.offset).abs() < 1e-3 * size, "{:?}", found[0]);
        assert!((found[0].roughness / size - 0.003).abs() < 5e-4, "{:?}", found[0]);
    }
}

#[test]
fn points_cluster_about_a_plane_or_fill_a_layer() {
    let sharp = |tolerance: f64| {
        let points = scattered(&tilted(0.4, 1.0), 1.0, 0.003);
        planes(&points, [0.0, 0.0, 3.0], tolerance)[0].is_sharp
    };
    assert!(sharp(0.02) && !sharp(0.002));
}

#[test]
fn round_bodies_touch_with_a_sphere_and_others_with_their_corners() {
    let mut draws = stream(2, "ball", 0);
    let mut direction = || DVec3::from_array([0; 3].map(|_| StandardNormal.sample(&mut draws))).normalize();
    let ball: Vec<[f64; 3]> = (0..400).map(|_| (0.3 * direction() + DVec3::X).to_array()).collect();
    let found = Surface::of(&ball);
    assert!((found.radius - 0.3).abs() < 0.01 && found.points.len() == 1, "{found:?}");
    assert!((found.points[0][0] - 1.0).abs() < 0.02, "{found:?}");
    let floating = (0..10).map(|k| [2.5, 0.1 * f64::from(k), 0.3]);
    let with_others: Vec<[f64; 3]> = ball.iter().copied().chain(floating).collect();
    assert_eq!(Surface::of(&with_others), found, "what floats apart is no part of the body");
    let stick = (1..=10).map(|k| [1.3 + 0.1 * f64::from(k), 0.0, 0.0]);
    let with_stick: Vec<[f64; 3]> = ball.iter().copied().chain(stick).collect();
    assert!((Surface::of(&with_stick).extent() - 2.3).abs() < 1e-12, "a thin stick is a part of it");
    let grid = |k: i32| f64::from(k) - 1.0;
    let cube: Vec<[f64; 3]> = (0..27).map(|k| [grid(k % 3), grid(k / 3 % 3), grid(k / 9)]).collect();
    let found = Surface::of(&cube);
    assert!(found.radius == 0.0 && found.points.len() == 8, "{found:?}");
    assert!(found.points.iter().flatten().all(|c| c.abs() == 1.0), "{found:?}");
}

/// A ball of radius 0.1 under gravity across the plane's own normal or not.
fn ball(plane: Plane, restitution: f64) -> Law {
    let mut ball = law(Coordinates::Point, &[], &[("uniform-field", Port::Whole, &[0.0, 0.0, -9.81])]);
    let surface = Surface { points: vec![[0.0; 3]], radius: 0.1 };
    ball.contact = Some(Contact { restitution, friction: 0.1, ..Contact::of(plane, &surface, 0.05) });
    ball
}

/// What is found of a track of a law's motion with errors, smeared over samples on both sides.
fn explained(
    law: &Law,
    start: &State,
    body: &Body,
    (until, error, smeared): (f64, f64, i32),
) -> Option<Bounced> {
    let times: Vec<f64> = (0..75).map(|k| until * f64::from(k) / 74.0).collect();
    let step = until / 74.0;
    let system = System::new(law, Edit::NONE);
    let mut draws = stream(1, "track", 0);
    let mut noise =
        || -> f64 { error * <StandardNormal as Distribution<f64>>::sample(&StandardNormal, &mut draws) };
    let mut at = |time: &f64| -> Vec<f64> {
        let near: Vec<f64> = (-smeared..=smeared).map(|k| time + 0.5 * step * f64::from(k)).collect();
        let states = system.states(start, &near).unwrap();
        let mean = |i: usize| states.iter().map(|state| state.x[i]).sum::<f64>() / states.len() as f64;
        let middle = &states[states.len() / 2].x;
        (0..middle.len()).map(|i| if i + 3 < middle.len() { middle[i] } else { mean(i) + noise() }).collect()
    };
    let x: Vec<Vec<f64>> = times.iter().map(&mut at).collect();
    explain(body, &Observed { times: &times, x: &x, deviations: &[], least: [1e-5, 1e-6] })
}

fn ball_above(grounds: Vec<Ground>) -> Body {
    Body { grounds, ..round_body() }
}

#[test]
fn a_plane_that_nothing_shows_is_told_by_the_impacts() {
    for angle in [0.0, 0.3] {
        let truth = ball(tilted(angle, 1.0), 0.7);
        let start = state(&[0.0, 0.0, 0.6], &[0.4, 0.2, 0.0]);
        let found = explained(&truth, &start, &ball_above(Vec::new()), (1.0, 0.001, 0)).unwrap();
        let (contact, truth_of) = (found.law.contact.as_ref().unwrap(), truth.contact.as_ref().unwrap());
        let apart = DVec3::from(contact.plane.normal).angle_between(DVec3::from(truth_of.plane.normal));
        let told = format!("{contact:?}, apart {apart}, error {}", found.error);
        assert!(apart < 0.05 && (contact.restitution / 0.7 - 1.0).abs() < 0.05, "{told}");
        assert!((found.law.parameters[2] + 9.81).abs() < 0.2, "{:?}", found.law.parameters);
        let late = System::new(&truth, Edit::NONE).impacts(&start, 1.0).unwrap();
        assert_eq!(found.law.impacts.len(), late.len(), "{told}");
    }
}

#[test]
fn draws_keep_to_the_track_where_friction_is_at_its_bound() {
    let mut truth = ball(tilted(0.0, 1.0), 0.7);
    truth.contact.iter_mut().for_each(|contact| contact.friction = 0.0);
    let start = state(&[0.0, 0.0, 0.6], &[0.4, 0.2, 0.0]);
    let found = explained(&truth, &start, &ball_above(Vec::new()), (0.6, 0.002, 0)).unwrap();
    // A little friction and a plane that leans forward are much like no friction and one that does not.
    let contact = found.law.contact.as_ref().unwrap();
    assert!(contact.friction < found.deviations[1], "{contact:?} {:?}", found.deviations);
    let radius = found.radius(&[0.55], 0).unwrap()[0];
    assert!(radius < 0.002, "{radius} {contact:?}");
    let drawn = found.drawn_laws(32, 0).drawn;
    let contacts = drawn.iter().filter_map(|drawn| drawn.law.contact.as_ref());
    let most = contacts.map(|contact| contact.friction).fold(0.0, f64::max);
    assert!(most > found.deviations[1], "{most} {contact:?}");
}

#[test]
fn a_wall_that_stops_the_body_is_found_beside_the_floor() {
    let [floor, wall, other] = [
        Plane { normal: [0.0, 0.0, 1.0], offset: 0.0 },
        Plane { normal: [-1.0, 0.0, 0.0], offset: -0.6 },
        Plane { normal: [0.0, 1.0, 0.0], offset: -0.6 },
    ];
    let mut truth = ball(floor, 0.7);
    truth.contact.iter_mut().for_each(|contact| contact.walls = vec![wall]);
    let start = state(&[0.0, 0.0, 0.6], &[1.1, 0.1, 0.0]);
    let ground = |plane: Plane| {
        let middle = (plane.offset * DVec3::from(plane.normal)).to_array();
        Ground { plane, middle, roughness: 0.002, is_sharp: true }
    };
    let body = ball_above([floor, wall, other].map(ground).to_vec());
    let found = explained(&truth, &start, &body, (1.0, 0.0005, 0)).unwrap();
    let contact = found.law.contact.as_ref().unwrap();
    assert_eq!(contact.walls.len(), 1, "{contact:?}");
    let normals = [contact.plane, contact.walls[0]].map(|plane| DVec3::from(plane.normal));
    let truths = [floor, wall].map(|plane| DVec3::from(plane.normal));
    let apart = |truth: &DVec3| normals.iter().map(|n| n.angle_between(*truth)).fold(f64::MAX, f64::min);
    assert!(truths.iter().all(|truth| apart(truth) < 0.02), "{normals:?}");
    assert!((contact.restitution / 0.7 - 1.0).abs() < 0.02, "{contact:?}");
    let later =
        |law: &Law, start: &State| System::new(law, Edit::NONE).states(start, &[1.5]).unwrap().swap_remove(0);
    let [told, known] = [later(&found.law, &found.start), later(&truth, &start)];
    let apart = DVec3::from_slice(&told.x).distance(DVec3::from_slice(&known.x));
    assert!(apart < 0.03, "{apart}: {told:?} for {known:?}");
}

#[test]
fn a_plane_that_its_points_show_badly_gives_way_to_the_impact() {
    let mut truth = ball(tilted(0.0, 1.0), 0.7);
    truth.contact.iter_mut().for_each(|contact| contact.friction = 0.0);
    let start = state(&[0.0, 0.0, 0.6], &[0.4, 0.2, 0.0]);
    let ground =
        Ground { plane: tilted(0.1, 1.0), middle: [0.1, 0.0, 0.01], roughness: 0.005, is_sharp: false };
    let found = explained(&truth, &start, &ball_above(vec![ground]), (0.75, 0.0002, 0)).unwrap();
    let contact = found.law.contact.as_ref().unwrap();
    let told = format!("{contact:?} {}", found.error);
    assert!((contact.restitution / 0.7 - 1.0).abs() < 0.01 && contact.plane.normal[2] > 0.9998, "{told}");
}

#[test]
fn a_plane_that_its_points_show_well_keeps_their_tilt_and_is_as_high_as_the_track_says() {
    let mut truth = ball(tilted(0.03, 1.0), 0.7);
    truth.contact.iter_mut().for_each(|contact| contact.plane.offset += 0.004);
    let start = state(&[0.0, 0.0, 0.6], &[0.4, 0.2, 0.0]);
    let ground = Ground { plane: tilted(0.0, 1.0), middle: [0.1, 0.0, 0.0], roughness: 0.0, is_sharp: true };
    let found = explained(&truth, &start, &ball_above(vec![ground]), (0.75, 0.0002, 0)).unwrap();
    let contact = found.law.contact.as_ref().unwrap();
    let at_impact = truth.contact.as_ref().unwrap().plane.height(DVec3::new(0.15, 0.07, 0.0));
    let told = format!("{contact:?} {} {at_impact}", found.error);
    assert!(contact.plane.normal[2] > 1.0 - 1e-9, "{told}");
    assert!((contact.plane.offset + at_impact).abs() < 0.001, "{told}");
}

#[test]
fn samples_that_an_impact_smears_are_left_out() {
    let truth = ball(tilted(0.0, 1.0), 0.7);
    let start = state(&[0.0, 0.0, 0.6], &[0.4, 0.2, 0.0]);
    let ground = planes(&scattered(&tilted(0.0, 1.0), 1.0, 0.001), [0.0, 0.0, 3.0], 0.003);
    let found = explained(&truth, &start, &ball_above(ground), (0.75, 0.0005, 5)).unwrap();
    let contact = found.law.contact.as_ref().unwrap();
    assert!((contact.restitution / 0.7 - 1.0).abs() < 0.05, "{contact:?} {}", found.error);
    assert!(found.error < 0.005, "{} {}", found.chi_square, found.error);
}

#[test]
fn wiggles_of_a_learned_track_are_no_impacts() {
    let truth = ball(tilted(0.0, 1.0), 0.7);
    let start = state(&[0.0, 0.0, 0.6], &[0.4, 0.2, 0.0]);
    let times: Vec<f64> = (0..75).map(|k| 0.01 * f64::from(k)).collect();
    let states = System::new(&truth, Edit::NONE).states(&start, &times).unwrap();
    let mut x: Vec<Vec<f64>> = states.into_iter().map(|state| state.x).collect();
    // A kink at the start of the window, and the ringing of a network after the impact.
    x[..6].iter_mut().enumerate().for_each(|(k, x)| x[2] += 0.004 * (5.0 - k as f64));
    let after = times
        .iter()
        .position(|time| *time > System::new(&truth, Edit::NONE).impacts(&start, 0.5).unwrap()[0].time);
    x[after.unwrap() + 8].iter_mut().skip(2).for_each(|z| *z += 0.02);
    let centers: Vec<[f64; 3]> = x.iter().map(|x| [x[0], x[1], x[2]]).collect();
    assert!(impacts(&times, &centers).len() > 1, "jumps that are none");
    let found = explain(
        &ball_above(Vec::new()),
        &Observed { times: &times, x: &x, deviations: &[], least: [1e-5, 1e-6] },
    );
    let found = found.unwrap();
    let contact = found.law.contact.as_ref().unwrap();
    assert!((contact.restitution / 0.7 - 1.0).abs() < 0.05, "{contact:?} {}", found.error);
    assert!((found.law.parameters[2] + 9.81).abs() < 0.4, "{:?}", found.law.parameters);
    assert_eq!(found.law.impacts.len(), 1, "{:?}", found.law.impacts);
}

#[test]
fn a_box_falls_on_a_plane_at_rest_and_smooth_motion_has_no_contact() {
    let half = [0.06, 0.04, 0.03];
    let sign = |bit: usize, c: usize| if bit == 0 { -half[c] } else { half[c] };
    let corners: Vec<[f64; 3]> = (0..8).map(|k| [sign(k & 1, 0), sign(k & 2, 1), sign(k & 4, 2)]).collect();
    let moment = |a: usize, b: usize| (half[a].powi(2) + half[b].powi(2)) / 3.0;
    let moments = [moment(1, 2), moment(0, 2), moment(0, 1)];
    let inertia = Inertia { form: InertiaForm::Prior, frame: [1.0, 0.0, 0.0, 0.0], moments };
    let gravity: [(&str, Port, &[f64]); 1] = [("uniform-field", Port::Center, &[0.0, 0.0, -9.81])];
    let mut truth = law(Coordinates::Rigid(inertia), &[], &gravity);
    truth.step = 1.0 / 150.0;
    let surface = Surface::of(&corners);
    let plane = tilted(0.1, 0.1);
    truth.contact = Some(Contact { restitution: 0.3, friction: 0.3, ..Contact::of(plane, &surface, 0.1) });
    let q = DQuat::from_euler(glam::EulerRot::XYZ, 0.5, -0.4, 0.9);
    let start = state(&[q.w, q.x, q.y, q.z, 0.0, 0.0, 0.3], &[2.0, -3.0, 1.0, 0.3, 0.1, 0.0]);
    let ball = Ball { pivot: [0.0; 3], arm: [0.0; 3], inertia };
    let spins = candidates(&Coordinates::Ball(ball)).into_iter();
    let body = Body {
        coordinates: Coordinates::Rigid(inertia),
        centers: candidates(&Coordinates::Point),
        spins: spins.filter(|c| c.terms.iter().all(|term| term.port != Port::Arm)).collect(),
        surface,
        grounds: planes(&scattered(&plane, 0.1, 0.01), [0.0, 0.0, 0.3], 0.003),
        is_shell: false,
        hits: Vec::new(),
    };
    let found = explained(&truth, &start, &body, (0.35, 0.0002, 0)).unwrap();
    let rest = found.states(&[5.0]).unwrap().swap_remove(0);
    let lowest = found.law.contact.as_ref().unwrap().gap(&rest.x);
    assert!((found.law.parameters[2] + 9.81).abs() < 0.2, "{:?}", found.law.parameters);
    assert!(found.error < 0.01 && lowest.abs() < 1e-3, "{} {lowest}", found.error);
    assert!(explained(&truth, &start, &body, (0.15, 0.0002, 0)).is_none(), "no impact yet");
}
