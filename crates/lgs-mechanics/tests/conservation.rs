//! Conserved quantities over a hundred windows, and edits.
#![allow(clippy::unwrap_used, reason = "tests")]

mod common;

use common::{asymmetric, hinge, law, state, tilted, top, tree};
use glam::{DQuat, DVec3};
use lgs_mechanics::coordinates::{Coordinates, Inertia, InertiaForm, Port, State};
use lgs_mechanics::{Edit, Law, System};

/// A window, and a hundred of them.
const WINDOW: f64 = 0.75;
const MANY: [f64; 3] = [30.0 * WINDOW, 60.3 * WINDOW, 100.0 * WINDOW];

/// A step as laws have them: its error within three windows is a ten-thousandth of the path.
fn resolved(law: Law, start: &State) -> Law {
    law.resolved(start, 3.0 * WINDOW, 1e-4).unwrap()
}

fn assert_energy_kept(law: Law, start: &State) {
    let law = resolved(law, start);
    let before = law.energy(start);
    let scale = law.kinetic_energy(start).max(before.abs());
    for state in System::new(&law, Edit::NONE).states(start, &MANY).unwrap() {
        let drift = (law.energy(&state) - before).abs() / scale;
        assert!(drift < 1e-3, "{}: {drift} with a step of {}", law.coordinates.name(), law.step);
    }
}

#[test]
fn an_edited_motion_has_a_step_of_its_own() {
    let terms: [(&str, Port, &[f64]); 1] = [("central-inverse-square", Port::Whole, &[12.7, 0.0, 0.0, 0.0])];
    let (orbit, start) = (law(Coordinates::Point, &[], &terms), state(&[0.58, 0.0, 0.0], &[0.0, 4.7, 0.0]));
    let slower = Edit { velocity: 0.5, ..Edit::NONE };
    let own = resolved(orbit.clone(), &start);
    let edited = orbit.resolved_under(slower, &start, 3.0 * WINDOW, 1e-4).unwrap();
    let fine = Law { step: edited.step / 16.0, ..edited.clone() };
    let [by_own, by_edited, truth] = [own, edited, fine].map(|law| {
        let end = System::new(&law, slower).states(&start, &[3.0 * WINDOW]).unwrap().remove(0);
        DVec3::from_slice(&end.x)
    });
    assert!(by_edited.distance(truth) < 1e-3, "{by_edited} {truth}");
    assert!(by_own.distance(truth) > 0.1, "{by_own}: the step of the motion itself is too long");
}

#[test]
fn a_motion_that_falls_into_a_centre_is_resolved_until_then() {
    let terms: [(&str, Port, &[f64]); 1] = [("central-inverse-square", Port::Whole, &[1.0, 0.0, 0.0, 0.0])];
    // It takes π / √8 to fall.
    let (falling, start) = (law(Coordinates::Point, &[], &terms), state(&[1.0, 0.0, 0.0], &[0.0, 1e-9, 0.0]));
    let resolved = falling.clone().resolved(&start, 2.0, 1e-4).unwrap();
    assert!(resolved.step > falling.step / 100.0, "{} of {}", resolved.step, falling.step);
    let place = System::new(&resolved, Edit::NONE).states(&start, &[1.0]).unwrap().remove(0).x[0];
    // Time since it was at rest at 1, where it is now.
    let time = ((place * (1.0 - place)).sqrt() + place.sqrt().acos()) / 2.0_f64.sqrt();
    assert!((time - 1.0).abs() < 1e-3, "{place}: {time}");
}

#[test]
fn a_motion_that_an_edit_stops_keeps_its_step() {
    let inertia = Inertia { form: InertiaForm::Isotropic, ..asymmetric() };
    let terms: [(&str, Port, &[f64]); 1] = [("uniform-field", Port::Center, &[0.0, 0.0, -9.0])];
    let body = law(Coordinates::Rigid(inertia), &[], &terms);
    let turned = [0.14949829055136096, -0.47438513504008406, 0.182849223134069, 0.8480419602675858];
    let start = state(&[&turned[..], &[0.0, 0.0, 1.0]].concat(), &[0.4, -0.6, 2.5, -1.6, -1.5, 0.7]);
    let stopped = Edit { velocity: 0.0, potential: 0.0, ..Edit::NONE };
    let under = body.under(stopped, &start, 3.0 * WINDOW);
    assert_eq!(under.step, body.step, "what is left of it is rounding alone");
}

#[test]
fn conservative_motions_keep_their_energy() {
    let spring: [(&str, Port, &[f64]); 2] = [
        ("spring-full", Port::Whole, &[90.0, 5.0, -3.0, 70.0, 2.0, 110.0, 0.1, 0.2, -0.1]),
        ("uniform-field", Port::Whole, &[0.0, 0.0, -9.81]),
    ];
    assert_energy_kept(law(Coordinates::Point, &[], &spring), &state(&[0.5, -0.2, 0.3], &[1.0, 0.4, -0.7]));
    let orbit =
        law(Coordinates::Point, &[], &[("central-inverse-square", Port::Whole, &[1.3, 0.0, 0.0, 0.0])]);
    assert_energy_kept(orbit, &state(&[0.9, 0.1, 0.0], &[0.2, 1.0, 0.3]));
    let pendulum = law(hinge(), &[], &[("fourier", Port::Whole, &[40.0, 0.0])]);
    assert_energy_kept(pendulum, &state(&[2.4], &[0.5]));
    let double: [(&str, Port, &[f64]); 2] =
        [("fourier", Port::First, &[19.6, 0.0]), ("fourier", Port::Second, &[4.0, 0.0])];
    assert_energy_kept(law(tree(), &[0.25, 0.6, 0.0], &double), &state(&[1.4, -0.6], &[0.3, 1.0]));
    let spinning = law(top(), &[0.0, 0.0], &[("uniform-field", Port::Arm, &[0.0, 0.0, -9.81])]);
    assert_energy_kept(spinning, &state(&tilted(), &[0.5, 0.0, 40.0]));
    let tied =
        law(Coordinates::Pair, &[2.5, 0.1, -0.2, 0.0], &[("spring-length", Port::Between, &[60.0, 0.6])]);
    assert_energy_kept(tied, &state(&[0.0, 0.0, 0.0, 0.8, 0.1, 0.0], &[1.0, 0.5, 4.0, 0.0, -0.5, 4.0]));
}

#[test]
fn tumbling_keeps_energy_and_angular_momentum() {
    let start = state(&[tilted().as_slice(), &[0.0; 3]].concat(), &[0.1, 6.0, 0.1, 1.0, 0.0, 0.0]);
    let law = resolved(law(Coordinates::Rigid(asymmetric()), &[0.0, 0.0], &[]), &start);
    let momentum = |state: &State| {
        let moments = DVec3::new(0.05, 0.08, 0.11);
        let rotation = DQuat::from_xyzw(state.x[1], state.x[2], state.x[3], state.x[0]);
        rotation * (moments * DVec3::from_slice(&state.v))
    };
    for end in System::new(&law, Edit::NONE).states(&start, &MANY).unwrap() {
        assert!((law.energy(&end) / law.energy(&start) - 1.0).abs() < 1e-3);
        assert!((momentum(&end) - momentum(&start)).length() < 1e-9);
    }
}

#[test]
fn free_motion_and_uniform_spin_are_exact() {
    let start = state(&[1.0, 0.0, 0.0, 0.0, 0.1, 0.2, 0.3], &[1.0, 2.0, -0.5, 1.0, -2.0, 0.5]);
    let law = law(Coordinates::Rigid(Inertia::ball(0.1)), &[], &[]);
    for (end, time) in System::new(&law, Edit::NONE).states(&start, &MANY).unwrap().iter().zip(MANY) {
        assert!((0..3).all(|i| (end.v[i] - start.v[i]).abs() < 1e-11));
        assert!((4..7).all(|i| (end.x[i] - start.x[i] - time * start.v[i - 1]).abs() < 1e-9));
        let turned = lgs_core::geometry::exp(DVec3::new(1.0, 2.0, -0.5) * time);
        let found = DQuat::from_xyzw(end.x[1], end.x[2], end.x[3], end.x[0]);
        assert!(found.dot(turned).abs() > 1.0 - 1e-12);
    }
}

#[test]
fn edits_scale_what_they_say() {
    let drag: [(&str, Port, &[f64]); 2] =
        [("uniform-field", Port::Whole, &[0.0, 0.0, -2.0]), ("linear-drag", Port::Whole, &[0.5])];
    let start = state(&[0.0; 3], &[1.0, 0.0, 3.0]);
    let edited = |field: f64, rate: f64, velocity: f64| {
        let law = law(
            Coordinates::Point,
            &[],
            &[(drag[0].0, Port::Whole, &[0.0, 0.0, -2.0 * field]), (drag[1].0, Port::Whole, &[0.5 * rate])],
        );
        let start = State { v: start.v.iter().map(|v| v * velocity).collect(), ..start.clone() };
        System::new(&law, Edit::NONE).states(&start, &[0.6, -0.2]).unwrap()
    };
    let law = law(Coordinates::Point, &[], &drag);
    let edit = Edit { velocity: 0.5, potential: 2.0, force: 0.0 };
    let states = System::new(&law, edit).states(&start, &[0.6, -0.2]).unwrap();
    assert_eq!(states, edited(2.0, 0.0, 0.5));
}
