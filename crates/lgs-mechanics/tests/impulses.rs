//! Laws of bodies that something else strikes: their motion, and how they are found from tracks.
#![allow(clippy::unwrap_used, reason = "tests")]

mod common;

use common::{law, round_body, state};
use lgs_core::stream;
use lgs_mechanics::bands::{DrawnLaws, StartedLaw};
use lgs_mechanics::choose::candidates;
use lgs_mechanics::collisions::{Body, Observed, explain};
use lgs_mechanics::contact::{Impact, impacts};
use lgs_mechanics::coordinates::{Coordinates, Port, State};
use lgs_mechanics::{Edit, Law, System};
use rand_distr::{Distribution, StandardNormal};

/// A thing that flies under a weight and is struck twice.
fn struck() -> Law {
    let weight: [(&str, Port, &[f64]); 1] = [("uniform-field", Port::Whole, &[0.0, 0.0, -1.5])];
    let impulse = |time: f64, change: [f64; 3]| Impact { time, change: change.to_vec() };
    let impulses = vec![impulse(0.2531, [1.0, 0.4, 0.3]), impulse(0.5077, [-0.6, 0.9, 0.2])];
    Law { impulses, ..law(Coordinates::Point, &[], &weight) }
}

#[test]
fn impulses_act_at_their_times_and_are_taken_back_on_the_way_back() {
    let law = struck();
    let start = state(&[0.0, 0.0, 1.0], &[0.5, 0.0, 0.2]);
    let states = System::new(&law, Edit::NONE).states(&start, &[0.2, 0.4, 0.75, -0.3]).unwrap();
    let at = |x: f64, v: f64, t: f64| x + v * t;
    assert!((states[0].x[0] - at(0.0, 0.5, 0.2)).abs() < 1e-12, "before any");
    assert!((states[1].x[0] - (at(0.0, 0.5, 0.4) + 0.1469)).abs() < 1e-12, "{:?}", states[1]);
    assert!((states[2].v[0] - 0.9).abs() < 1e-12 && (states[2].v[1] - 1.3).abs() < 1e-12);
    assert!((states[3].x[0] + 0.15).abs() < 1e-12, "the past has none");
    // The motion from the end back to the start: its impulses in the other order.
    let last = 0.75;
    let mirrored = |event: &Impact| Impact { time: event.time - last, change: event.change.clone() };
    let seen_from_the_end = Law { impulses: law.impulses.iter().map(mirrored).collect(), ..law.clone() };
    let back = System::new(&seen_from_the_end, Edit::NONE).states(&states[2], &[-last]).unwrap();
    let apart = back[0].x.iter().zip(&start.x).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(apart < 1e-12, "{back:?}");
}

#[test]
fn derivatives_pass_through_impulses() {
    let law = struck();
    let start = state(&[0.0, 0.0, 1.0], &[0.5, 0.0, 0.2]);
    let found = &System::new(&law, Edit::NONE).sensitivities(&start, &[0.7]).unwrap()[0];
    let states = System::new(&law, Edit::NONE).states(&start, &[0.7]).unwrap();
    assert_eq!(found.state, states[0]);
    assert!((found.position[(0, 3)] - 0.7).abs() < 1e-12 && (found.position[(2, 8)] - 0.245).abs() < 1e-9);
}

/// A noisy track of the struck thing.
fn track(times: &[f64]) -> Vec<Vec<f64>> {
    let start = state(&[0.0, 0.0, 1.0], &[0.5, 0.0, 0.2]);
    let states = System::new(&struck(), Edit::NONE).states(&start, times).unwrap();
    let mut draws = stream(5, "noise", 0);
    let mut noise = || -> f64 { StandardNormal.sample(&mut draws) };
    states.iter().map(|state| state.x.iter().map(|x| x + 5e-4 * noise()).collect()).collect()
}

fn body(hits: &[f64]) -> Body {
    Body { hits: hits.to_vec(), ..round_body() }
}

#[test]
fn times_and_changes_of_impulses_are_found_from_a_noisy_track() {
    let (law, start) = (struck(), state(&[0.0, 0.0, 1.0], &[0.5, 0.0, 0.2]));
    let times: Vec<f64> = (0..76).map(|k| 0.01 * f64::from(k)).collect();
    let x = track(&times);
    let found = explain(&body(&[]), &Observed { times: &times, x: &x, deviations: &[], least: [1e-5, 1e-5] })
        .unwrap();
    assert!(found.law.contact.is_none() && found.law.impulses.len() == 2, "{:?}", found.law);
    for (event, truth) in found.law.impulses.iter().zip(&law.impulses) {
        let apart = event.change.iter().zip(&truth.change).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!((event.time - truth.time).abs() < 2e-3 && apart < 0.03, "{event:?} for {truth:?}");
    }
    let radius = found.radius(&[0.3, 2.25], 0).unwrap();
    let forecast = found.states(&[2.25]).unwrap();
    let exact = System::new(&law, Edit::NONE).states(&start, &[2.25]).unwrap();
    let off = found.distance(&forecast[0], &exact[0]);
    assert!(off < 2.0 * radius[1] && radius[1] < 0.2 && radius[1] > radius[0], "{off} {radius:?}");
}

#[test]
fn hits_that_others_tell_of_and_a_body_does_not_show_are_none() {
    let times: Vec<f64> = (0..76).map(|k| 0.01 * f64::from(k)).collect();
    let x = track(&times);
    let seen = Observed { times: &times, x: &x, deviations: &[], least: [1e-5, 1e-5] };
    // The last is too near to another one for a flight between them.
    for told in [[0.1, 0.25, 0.51], [0.25, 0.51, 0.53]] {
        let law = explain(&body(&told), &seen).unwrap().law;
        let near = |(event, truth): (&Impact, &Impact)| (event.time - truth.time).abs() < 2e-3;
        assert!(law.impulses.len() == 2 && law.impulses.iter().zip(&struck().impulses).all(near), "{law:?}");
    }
}

#[test]
fn drawn_laws_can_be_read_from_files_where_the_error_of_a_drag_is_larger_than_itself() {
    let drag: [(&str, Port, &[f64]); 1] = [("linear-drag", Port::Whole, &[0.3])];
    let slowed = Law { impulses: struck().impulses, ..law(Coordinates::Point, &[], &drag) };
    let start = state(&[0.0, 0.0, 1.0], &[0.5, 0.0, 0.2]);
    let times: Vec<f64> = (0..76).map(|k| 0.01 * f64::from(k)).collect();
    let states = System::new(&slowed, Edit::NONE).states(&start, &times).unwrap();
    let mut draws = stream(5, "noise", 0);
    let mut noise = || -> f64 { StandardNormal.sample(&mut draws) };
    let x: Vec<Vec<f64>> =
        states.iter().map(|state| state.x.iter().map(|x| x + 5e-3 * noise()).collect()).collect();
    let centers = candidates(&Coordinates::Point).into_iter().filter(|own| own.terms == slowed.terms);
    let body = Body { centers: centers.collect(), ..body(&[0.25, 0.51]) };
    let seen = Observed { times: &times, x: &x, deviations: &[], least: [1e-5, 1e-5] };
    let found = explain(&body, &seen).unwrap();
    let own = found.law.deviations[0];
    assert!(own > 0.5 * found.law.parameters[0], "{:?}", found.law);
    let DrawnLaws { drawn, .. } = found.drawn_laws(16, 0);
    assert_eq!(drawn.len(), 16);
    for StartedLaw { law, .. } in drawn {
        let file = serde_json::to_string(&law).unwrap();
        assert!(serde_json::from_str::<Law>(&file).is_ok(), "{file}");
    }
}

#[test]
fn dense_samples_show_an_impulse_that_hides_in_the_noise_of_few() {
    let start = state(&[0.0, 0.0, 1.0], &[0.5, 0.0, 0.2]);
    let noisy = |count: usize, deviation: f64, law: &Law| -> (Vec<f64>, Vec<[f64; 3]>) {
        let times: Vec<f64> = (0..count).map(|k| 0.75 * k as f64 / (count - 1) as f64).collect();
        let mut draws = stream(6, "noise", 0);
        let mut noise = || -> f64 { StandardNormal.sample(&mut draws) };
        let states = System::new(law, Edit::NONE).states(&start, &times).unwrap();
        let center = |state: &State| [0, 1, 2].map(|axis| state.x[axis] + deviation * noise());
        (times, states.iter().map(center).collect())
    };
    let found = |count: usize, law: &Law| {
        let (times, centers) = noisy(count, 2e-3, law);
        impacts(&times, &centers).iter().map(|impact| impact.time).collect::<Vec<f64>>()
    };
    let near = |(found, truth): (&f64, &Impact)| (found - truth.time).abs() < 0.02;
    let dense = found(181, &struck());
    assert!(dense.len() == 2 && dense.iter().zip(&struck().impulses).all(near), "{dense:?}");
    let smooth = Law { impulses: Vec::new(), ..struck() };
    assert!(found(181, &smooth).is_empty() && found(46, &smooth).is_empty());
}
