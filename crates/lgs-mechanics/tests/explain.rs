//! Motions in every kind of coordinates are explained from noisy, uneven samples with a gap.
#![allow(clippy::unwrap_used, reason = "tests")]

mod common;

use common::{hinge, law, modes, state, tilted, top, tree};
use lgs_core::stream;
use lgs_mechanics::bands::Verdict;
use lgs_mechanics::choose::candidates;
use lgs_mechanics::coordinates::{Coordinates, Inertia, InertiaForm, Port, Rolling, Slider, State};
use lgs_mechanics::explain::{Explanation, Options, explain};
use lgs_mechanics::{Edit, Law, MechanicsError, System};
use rand_distr::{Distribution, StandardNormal};

/// Times from 0.2 to 1.2 that lie unevenly apart and have a gap.
fn uneven() -> Vec<f64> {
    let bent = |k: i32| 0.2 + f64::from(k) / 80.0 + 0.003 * f64::from(k % 3);
    (0..80).map(bent).filter(|time| !(0.6..0.68).contains(time)).collect()
}

/// Samples of a law that starts at 0.2, with white noise.
fn samples(law: &Law, start: &State, times: &[f64], noise: f64) -> Vec<Vec<f64>> {
    let since: Vec<f64> = times.iter().map(|time| time - 0.2).collect();
    let states = System::new(law, Edit::NONE).states(start, &since).unwrap();
    let mut stream = stream(3, "explanations", 0);
    let mut draw = || -> f64 { StandardNormal.sample(&mut stream) };
    states
        .iter()
        .map(|state| {
            let change: Vec<f64> = state.v.iter().map(|_| noise * draw()).collect();
            law.coordinates.retract(&state.x, &change)
        })
        .collect()
}

/// Explains samples of a law and compares its forecast for half a window with the truth: the names of the
/// terms found, and the explanation.
fn explained(law: &Law, start: &State, noise: f64) -> (Vec<String>, Explanation) {
    let times = uneven();
    let x = samples(law, start, &times, noise);
    let list = candidates(&law.coordinates);
    let found = explain(&list, &times, &x, &Options::default()).unwrap();
    let later = System::new(law, Edit::NONE).states(start, &[1.5]).unwrap();
    let error = found.distance(&later[0], &found.start_at(1.7).unwrap());
    let terms = &found.law().terms;
    let names = terms.iter().map(|term| format!("{}@{}", term.kind.name(), term.port.name())).collect();
    let radius = found.radius(&[1.7])[0];
    let told = format!("{names:?}: {error} within {radius}, path {}, {:?}", found.path, found.forecasts);
    assert!(found.choice.describes(), "{told}");
    assert!(error <= 0.02 * found.path && error <= 2.0 * radius, "{told}");
    assert_eq!(found.verdict, Verdict::Explained, "{told}, trusted {:?}", found.trusted);
    (names, found)
}

#[test]
fn a_pendulum() {
    let law = law(hinge(), &[], &[("fourier", Port::Whole, &[30.0, 0.4])]);
    let (names, found) = explained(&law, &state(&[1.9], &[1.0]), 0.003);
    assert_eq!(names, ["fourier@whole"]);
    let value = found.law().parameters[0].hypot(found.law().parameters[1]);
    assert!((value - 30.0_f64.hypot(0.4)).abs() < 0.3, "{value}");
}

#[test]
fn a_fan_that_is_spun_up_and_one_that_runs_down() {
    let driven = law(hinge(), &[], &[("constant-drive", Port::Whole, &[7.0])]);
    let (names, found) = explained(&driven, &state(&[0.0], &[1.0]), 0.003);
    assert_eq!(names, ["constant-drive@whole"]);
    assert!(found.law().is_driven());
    let damped = law(hinge(), &[], &[("linear-drag", Port::Whole, &[1.2])]);
    assert_eq!(explained(&damped, &state(&[0.0], &[9.0]), 0.003).0, ["linear-drag@whole"]);
}

#[test]
fn a_torsion_spring_with_damping() {
    let law =
        law(hinge(), &[], &[("spring", Port::Whole, &[90.0, 0.5]), ("linear-drag", Port::Whole, &[0.8])]);
    assert_eq!(explained(&law, &state(&[1.4], &[0.0]), 0.003).0, ["spring@whole", "linear-drag@whole"]);
}

#[test]
fn a_slider_on_a_slope_and_a_ball_that_rolls_out() {
    let slider = Coordinates::Slider(Slider { direction: [1.0, 0.0, 0.0] });
    let field = law(slider, &[], &[("uniform-field", Port::Whole, &[-3.0])]);
    assert_eq!(explained(&field, &state(&[0.0], &[1.0]), 0.001).0, ["uniform-field@whole"]);
    let axes = ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
    let rolling = Rolling { direction: axes.0, axis: axes.1, radius: 0.2, center: [0.0, 0.0, 0.2] };
    let slows = law(Coordinates::Rolling(rolling), &[], &[("linear-drag", Port::Whole, &[0.9])]);
    assert_eq!(explained(&slows, &state(&[0.0], &[2.0]), 0.001).0, ["linear-drag@whole"]);
}

#[test]
fn a_body_that_tumbles_while_it_falls() {
    let inertia =
        Inertia { form: InertiaForm::Prior, frame: [1.0, 0.0, 0.0, 0.0], moments: [0.05, 0.08, 0.11] };
    let gravity: (&str, Port, &[f64]) = ("uniform-field", Port::Center, &[0.0, 0.0, -4.0]);
    let law = law(Coordinates::Rigid(inertia), &[], &[gravity]);
    let start = state(&[&tilted()[..], &[0.1, 0.2, 0.3]].concat(), &[3.0, -4.0, 2.0, 1.0, 0.5, 2.0]);
    let (names, found) = explained(&law, &start, 0.003);
    assert_eq!(names, ["uniform-field@center"]);
    assert!(found.law().coordinates.inertia().unwrap().form != InertiaForm::Isotropic);
    assert!((found.law().parameters.last().unwrap() + 4.0).abs() < 0.04);
}

#[test]
fn a_ball_whose_spin_is_damped() {
    let terms: [(&str, Port, &[f64]); 2] =
        [("linear-drag", Port::Center, &[0.5]), ("linear-drag", Port::Spin, &[0.9])];
    let law = law(Coordinates::Rigid(Inertia::ball(0.04)), &[], &terms);
    let start = state(&[&tilted()[..], &[0.1, 0.2, 0.3]].concat(), &[3.0, -4.0, 2.0, 1.0, 0.5, 2.0]);
    assert_eq!(explained(&law, &start, 0.003).0, ["linear-drag@center", "linear-drag@spin"]);
}

#[test]
fn a_top_under_gravity() {
    let law = law(top(), &[0.1, -0.2], &[("uniform-field", Port::Arm, &[0.0, 0.0, -9.0])]);
    let (names, _) = explained(&law, &state(&tilted(), &[1.0, -2.0, 20.0]), 0.003);
    assert_eq!(names, ["uniform-field@arm"]);
}

#[test]
fn modes_that_vibrate_and_fade() {
    let terms: [(&str, Port, &[f64]); 2] = [
        ("spring-positive", Port::Whole, &[9.0, 1.0, 14.0, 0.1, -0.2]),
        ("linear-drag", Port::Whole, &[0.5]),
    ];
    let law = law(modes(), &[], &terms);
    let (names, _) = explained(&law, &state(&[0.9, -0.4], &[0.5, 3.0]), 0.002);
    assert_eq!(names, ["spring-positive@whole", "linear-drag@whole"]);
}

#[test]
fn two_balls_joined_by_a_spring() {
    let terms: [(&str, Port, &[f64]); 2] =
        [("uniform-field", Port::Both, &[0.0, 0.0, -5.0]), ("spring-length", Port::Between, &[40.0, 0.7])];
    let law = law(Coordinates::Pair, &[1.7, 0.05, -0.03, 0.02], &terms);
    let start = state(&[0.5, -0.2, 0.3, -0.4, 0.1, 0.2], &[1.0, 0.4, 2.7, -1.0, 0.3, 1.5]);
    let (names, found) = explained(&law, &start, 0.001);
    assert_eq!(names, ["uniform-field@both", "spring-length@between"]);
    assert!((found.law().parameters[0] - 1.7).abs() < 0.05, "{:?}", found.law().parameters);
}

#[test]
fn a_double_pendulum() {
    let terms: [(&str, Port, &[f64]); 2] =
        [("fourier", Port::First, &[30.0, 0.0]), ("fourier", Port::Second, &[12.0, 0.0])];
    let law = law(tree(), &[0.4, 0.6, 0.0], &terms);
    let (names, _) = explained(&law, &state(&[1.0, -0.3], &[1.0, -1.0]), 0.002);
    assert_eq!(names, ["fourier@first", "fourier@second"]);
}

#[test]
fn a_path_without_a_law_is_outside() {
    let times = uneven();
    let wander = |t: &f64| vec![(7.0 * t).sin(), (11.0 * t).cos() * t, (5.0 * t * t).sin()];
    let x: Vec<Vec<f64>> = times.iter().map(wander).collect();
    let found = explain(&candidates(&Coordinates::Point), &times, &x, &Options::default()).unwrap();
    assert_eq!(found.verdict, Verdict::Outside);
}

#[test]
fn faults_are_named() {
    let list = candidates(&Coordinates::Point);
    let rows = |count: usize| -> (Vec<f64>, Vec<Vec<f64>>) {
        (0..count).map(|k| (k as f64, vec![k as f64, 0.0, 1.0])).unzip()
    };
    let fault = |times: &[f64], x: &[Vec<f64>]| -> String {
        let error: MechanicsError = explain(&list, times, x, &Options::default()).unwrap_err();
        error.to_string()
    };
    let (times, mut x) = rows(4);
    assert_eq!(fault(&times, &x), "times of a track: 5 values expected, 4 found");
    let (mut times, good) = rows(8);
    assert!(fault(&times[..7], &good).starts_with("configurations of a track"));
    x = good.clone();
    x[3].pop();
    assert_eq!(fault(&times, &x), "coordinates of a track: 3 values expected, 2 found");
    x[3].push(f64::NAN);
    assert!(fault(&times, &x).starts_with("a number of a track is NaN"));
    times.swap(2, 3);
    assert!(fault(&times, &good).starts_with("a time of a track is 2"));
}
