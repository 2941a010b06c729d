//! A top of which particles show neither the axis nor the centre of mass.

use super::{Laws, find_law};
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

#[test]
fn a_tops_axis_and_centre_of_mass_are_found_from_its_motion() {
    let inertia = Inertia { form: InertiaForm::Round, ..Inertia::ball(0.2) };
    let coordinates = Coordinates::Ball(Ball { pivot: [0.0; 3], arm: [0.0, 0.0, 0.45], inertia });
    let weight = vec![Term::named("uniform-field", Port::Arm).expect("a term")];
    let tilted = vec![-0.5, 0.08, -0.05, 0.0, 0.0, -1.6];
    let law = Law::new(coordinates, weight, tilted, 0.005).expect("a law");
    let start = State { x: vec![0.98, 0.2, 0.0, 0.0], v: vec![0.4, -0.3, 7.0] };
    let start = State { x: start.x.iter().map(|x| x / 0.98_f64.hypot(0.2)).collect(), ..start };
    let times: Vec<f64> = (0..76).map(|i| 0.01 * f64::from(i)).collect();
    let states = System::new(&law, Edit::NONE).states(&start, &times).expect("a motion");
    let mut rng = lgs_core::stream(5, "noise of a top", 0);
    let mut draw = || DVec3::from([(); 3].map(|()| 2e-4 * rng.sample::<f64, _>(rand_distr::StandardNormal)));
    let pose = |state: &State| {
        let linear = rotation_by(draw()) * DMat3::from_quat(quaternion(&state.x));
        Pose { linear, shift: linear * DVec3::new(0.01, 0.01, 0.42) + draw() }
    };
    let poses: Vec<Pose> = states.iter().map(pose).collect();
    let shape = block([0.5, 0.5, 0.1], 64, 5);
    let weights = vec![1.0 / 64.0; 64];
    let motion = SharedMotion { kind: PoseKind::Rigid, times, poses, shape, weights, residual: 0.0 };
    let found = find_law(&[&motion], (Laws::All, &[]), 0.0, 1).expect("a law");
    assert!(matches!(found.law.coordinates, Coordinates::Ball(_)), "{:?}", found.law);
    assert_eq!(found.known.verdict, Verdict::Explained, "{:?}", found.known);
    let later = System::new(&law, Edit::NONE).states(&start, &[1.5]).expect("a motion").remove(0);
    let forecast = System::new(&found.law, Edit::NONE).states(&found.start, &[1.5]).expect("one").remove(0);
    let placed = Embedding::new(&found.law.coordinates, &found.start.x).placements(&forecast.x)[0];
    let off = placed.linear * found.bases[0].linear - DMat3::from_quat(quaternion(&later.x));
    // The top turns by ten radians until then.
    assert!(off.to_cols_array().iter().all(|entry| entry.abs() < 0.1), "{off:?}");
}
