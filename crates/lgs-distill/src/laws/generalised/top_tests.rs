//! A top of which particles show neither the axis nor the centre of mass.

use super::{GeneralisedLaw, Laws, Surroundings, find_law};
use crate::motion::pose::{Pose, PoseKind};
use crate::motion::shared_motion::SharedMotion;
use crate::testing::block;
use glam::{DMat3, DVec3};
use lgs_core::geometry::{quaternion, rotation_by};
use lgs_mechanics::bands::Verdict;
use lgs_mechanics::coordinates::{Ball, Coordinates, Embedding, Inertia, InertiaForm, Port, State};
use lgs_mechanics::terms::Term;
use lgs_mechanics::{Edit, Law, System};
use rand::RngExt;

/// A round body about a fixed tip, with its start.
fn top() -> (Law, State) {
    let inertia = Inertia { form: InertiaForm::Round, ..Inertia::ball(0.2) };
    let coordinates = Coordinates::Ball(Ball { pivot: [0.0; 3], arm: [0.0, 0.0, 0.45], inertia });
    let weight = vec![Term::named("uniform-field", Port::Arm).expect("a term")];
    let tilted = vec![-0.5, 0.08, -0.05, 0.0, 0.0, -1.6];
    let law = Law::new(coordinates, weight, tilted, 0.005).expect("a law");
    let x = [0.98, 0.2, 0.0, 0.0].map(|x| x / 0.98_f64.hypot(0.2)).to_vec();
    (law, State { x, v: vec![0.4, -0.3, 7.0] })
}

/// Its poses at 76 times, with noise of a deviation, of a body whose particles are not round about its axis.
fn observed((law, start): (&Law, &State), deviation: f64) -> SharedMotion {
    let times: Vec<f64> = (0..76).map(|i| 0.01 * f64::from(i)).collect();
    let states = System::new(law, Edit::NONE).states(start, &times).expect("a motion");
    let mut rng = lgs_core::stream(5, "noise of a top", 0);
    let mut draw =
        || DVec3::from([(); 3].map(|()| deviation * rng.sample::<f64, _>(rand_distr::StandardNormal)));
    let pose = |state: &State| {
        let linear = rotation_by(draw()) * DMat3::from_quat(quaternion(&state.x));
        Pose { linear, shift: linear * DVec3::new(0.01, 0.01, 0.42) + draw() }
    };
    let poses: Vec<Pose> = states.iter().map(pose).collect();
    let shape = block([0.5, 0.5, 0.1], 64, 5);
    SharedMotion {
        kind: PoseKind::Rigid,
        times,
        poses,
        shape,
        weights: vec![1.0 / 64.0; 64],
        deviations: Vec::new(),
        residual: 0.0,
    }
}

/// Largest entry by which the rotation of a found law's body is off at a time, under an edit.
fn off(found: &GeneralisedLaw, (law, start): (&Law, &State), edit: Edit, time: f64) -> f64 {
    let later = System::new(law, edit).states(start, &[time]).expect("a motion").remove(0);
    let forecast = System::new(&found.law, edit).states(&found.start, &[time]).expect("one").remove(0);
    let placed = Embedding::new(&found.law.coordinates, &found.start.x).placements(&forecast.x)[0];
    let off = placed.linear * found.bases[0].linear - DMat3::from_quat(quaternion(&later.x));
    off.to_cols_array().iter().fold(0.0, |most, entry| entry.abs().max(most))
}

#[test]
fn a_tops_axis_and_centre_of_mass_are_found_from_its_motion() {
    let (law, start) = top();
    let motion = observed((&law, &start), 2e-4);
    let found = find_law(&[&motion], (Laws::All, Surroundings::default()), 0.0, 1).expect("a law");
    assert!(matches!(found.law.coordinates, Coordinates::Ball(_)), "{:?}", found.law);
    assert_eq!(found.known.verdict, Verdict::Explained, "{:?}", found.known);
    // The top turns by ten radians until then.
    let off = off(&found, (&law, &start), Edit::NONE, 1.5);
    assert!(off < 0.1, "{off}");
}

#[test]
fn a_top_that_is_known_roughly_has_its_weight_upright_and_obeys_edits() {
    let (law, start) = top();
    let motion = observed((&law, &start), 2e-3);
    let found = find_law(&[&motion], (Laws::All, Surroundings::default()), 0.0, 1).expect("a law");
    let field = DVec3::from_slice(&found.law.parameters[found.law.range(0)]);
    assert!(field.angle_between(DVec3::NEG_Z) < 0.05, "{field}");
    let half = Edit { velocity: 0.5, ..Edit::NONE };
    let off = off(&found, (&law, &start), half, 0.75);
    assert!(off < 0.1, "{off}");
}
