//! Laws of bodies that bounce off planes and that something else strikes: their motion, how they are found
//! from tracks, and bodies that hit each other between bounces.
#![allow(clippy::unwrap_used, reason = "tests")]

mod common;

use common::{law, round_body, state};
use lgs_core::stream;
use lgs_mechanics::collisions::{Body, Bounced, Observed, explain};
use lgs_mechanics::contact::{Contact, Ground, Impact, Plane, Surface, planes};
use lgs_mechanics::coordinates::{Coordinates, Port, State};
use lgs_mechanics::mutual_contact::{Moving, MutualContact, RoundBody};
use lgs_mechanics::{Edit, Law, MechanicsError, System};
use rand_distr::{Distribution, StandardNormal};

const FLOOR: Plane = Plane { normal: [0.0, 0.0, 1.0], offset: 0.0 };

/// A ball of radius 0.1 that falls on a floor.
fn ball() -> Law {
    let mut ball = law(Coordinates::Point, &[], &[("uniform-field", Port::Whole, &[0.0, 0.0, -4.0])]);
    let surface = Surface { points: vec![[0.0; 3]], radius: 0.1 };
    ball.contact = Some(Contact { restitution: 0.8, friction: 0.0, ..Contact::of(FLOOR, &surface, 0.02) });
    ball
}

/// The same, struck in the air.
fn struck() -> Law {
    Law { impulses: vec![Impact { time: 0.253, change: vec![-1.2, 0.3, 0.4] }], ..ball() }
}

fn start() -> State {
    state(&[0.0, 0.0, 0.7], &[0.6, 0.0, 0.0])
}

#[test]
fn an_impulse_changes_when_and_where_a_body_bounces() {
    let (free, law) = (ball(), struck());
    let impacts = |law: &Law| System::new(law, Edit::NONE).impacts(&start(), 1.0).unwrap();
    let fall = (2.0_f64 * 0.6 / 4.0).sqrt();
    assert!((impacts(&free)[0].time - fall).abs() < 1e-6, "{:?}", impacts(&free));
    // At the impulse the ball is at 0.7 - 2 t², and rises by 0.4 more.
    let (height, speed): (f64, f64) = (0.6 - 2.0 * 0.253 * 0.253, 0.4 - 4.0 * 0.253);
    let late = 0.253 + (speed + (speed * speed + 8.0 * height).sqrt()) / 4.0;
    assert!((impacts(&law)[0].time - late).abs() < 1e-6, "{:?}", impacts(&law));
    // With the record of its impacts the way back ends where it began.
    let end = System::new(&law, Edit::NONE).states(&start(), &[1.0]).unwrap().remove(0);
    let earlier = |event: Impact| Impact { time: event.time - 1.0, ..event };
    let back = Law {
        impacts: impacts(&law).into_iter().map(earlier).collect(),
        impulses: law.impulses.iter().cloned().map(earlier).collect(),
        ..law
    };
    let found = System::new(&back, Edit::NONE).states(&end, &[-1.0]).unwrap().remove(0);
    let apart = found.x.iter().zip(&start().x).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(apart < 1e-6, "{found:?}");
}

/// Points of the floor.
fn grounds() -> Vec<Ground> {
    let mut draws = stream(3, "floor", 0);
    let mut noise = |scale: f64| -> f64 {
        scale * <StandardNormal as Distribution<f64>>::sample(&StandardNormal, &mut draws)
    };
    let points: Vec<[f64; 3]> = (0..300).map(|_| [noise(1.0), noise(1.0), noise(0.001)]).collect();
    planes(&points, [0.0, 0.0, 3.0], 0.01)
}

/// What is found of a noisy track of a law, with hits of which others tell.
fn explained(law: &Law, grounds: Vec<Ground>, hits: &[f64]) -> Bounced {
    let times: Vec<f64> = (0..76).map(|k| 0.0125 * f64::from(k)).collect();
    let states = System::new(law, Edit::NONE).states(&start(), &times).unwrap();
    let mut draws = stream(5, "noise", 0);
    let mut noise = || -> f64 { StandardNormal.sample(&mut draws) };
    let x: Vec<Vec<f64>> =
        states.iter().map(|state| state.x.iter().map(|x| x + 5e-4 * noise()).collect()).collect();
    let body = Body { grounds, hits: hits.to_vec(), ..round_body() };
    explain(&body, &Observed { times: &times, x: &x, deviations: &[], least: [1e-5, 1e-5] }).unwrap()
}

#[test]
fn a_ball_that_is_struck_between_bounces_has_a_contact_and_an_impulse() {
    for hits in [&[][..], &[0.25]] {
        let found = explained(&struck(), grounds(), hits);
        let Law { contact, impacts, impulses, .. } = &found.law;
        let contact = contact.as_ref().expect("a contact");
        assert!((contact.restitution - 0.8).abs() < 0.03, "{contact:?}");
        assert!(impacts.len() == 1 && impulses.len() == 1, "{:?}", found.law);
        let truth = &struck().impulses[0];
        let apart =
            impulses[0].change.iter().zip(&truth.change).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!((impulses[0].time - truth.time).abs() < 2e-3 && apart < 0.03, "{impulses:?}");
        let forecast = found.states(&[2.0]).unwrap();
        let exact = System::new(&struck(), Edit::NONE).states(&start(), &[2.0]).unwrap();
        let radius = found.radius(&[2.0], 0).unwrap()[0];
        let off = found.distance(&forecast[0], &exact[0]);
        assert!(off < 2.0 * radius && radius < 0.2, "{off} {radius}");
    }
}

#[test]
fn a_ball_that_bounces_is_not_struck() {
    let found = explained(&ball(), grounds(), &[]);
    assert!(found.law.contact.is_some() && found.law.impulses.is_empty(), "{:?}", found.law);
    // Another body was struck in between, and this one shows nothing of it.
    let found = explained(&ball(), grounds(), &[0.3]);
    assert!(found.law.contact.is_some() && found.law.impulses.is_empty(), "{:?}", found.law);
}

#[test]
fn balls_hit_each_other_between_bounces() {
    let round = |x: f64| RoundBody { center: [x, 0.0, 0.7], radius: 0.1, mass: 1.0, hits: Vec::new() };
    let bodies = vec![round(0.0), round(0.8)];
    let contact = MutualContact { bodies, restitution: 1.0, friction: 0.0, deviations: [0.0; 2] };
    let (law, other) = (ball(), state(&[0.8, 0.0, 0.7], &[-0.6, 0.0, 0.0]));
    let start = start();
    let motions = [&start, &other].map(|start| Moving { law: &law, start, edit: Edit::NONE });
    // They fall side by side and touch at t = 0.5: both on the way down; mirrored, neither passes the other.
    let struck = contact.impulses(&motions, [0.0, 2.0]).unwrap();
    assert!(struck[0].len() == 1 && struck[1].len() == 1, "{struck:?}");
    assert!((struck[0][0].time - 0.5).abs() < 1e-6 && (struck[0][0].change[0] + 1.2).abs() < 1e-6);
    let with = Law { impulses: struck[0].clone(), ..law.clone() };
    let states = System::new(&with, Edit::NONE).states(&start, &[0.5, 1.5]).unwrap();
    assert!((states[1].x[0] + 0.3).abs() < 1e-6 && states[1].x[2] >= 0.1 - 1e-6, "{states:?}");
}

#[test]
fn impacts_need_a_plane() {
    let impact = Impact { time: 0.1, change: vec![0.0; 3] };
    let wrong = Law { impacts: vec![impact], contact: None, ..ball() };
    assert!(matches!(wrong.check(), Err(MechanicsError::Size { found: 1, .. })));
    // Files of earlier versions had one list for both.
    let file = serde_json::to_string(&struck()).unwrap().replace("impulses", "events");
    let read: Law = serde_json::from_str(&file).unwrap();
    assert!(read.impacts == struck().impulses && read.impulses.is_empty());
}
