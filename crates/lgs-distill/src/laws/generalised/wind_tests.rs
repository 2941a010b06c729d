//! Laws whose unknowns are bound together along a curve.

use super::{Laws, Surroundings, find_law};
use crate::motion::pose::{Pose, PoseKind};
use crate::motion::shared_motion::SharedMotion;
use crate::testing::block;
use glam::{DMat3, DVec3};
use lgs_mechanics::coordinates::{Coordinates, Port, State};
use lgs_mechanics::terms::Term;
use lgs_mechanics::{Edit, Law, System};
use rand::RngExt;

const SAMPLES: usize = 46;
/// Standard deviation of a place, world units.
const NOISE: f64 = 1e-4;

/// A body that falls in a wind, and the law of it with its start.
fn blown() -> (SharedMotion, Law, State) {
    let terms = ["uniform-field", "wind-drag"].map(|name| Term::named(name, Port::Whole).expect("a term"));
    let values = vec![0.3, -0.2, -3.5, 1.6, 1.4, -0.9, 0.4];
    let law = Law::new(Coordinates::Point, terms.to_vec(), values, 2e-3).expect("a law");
    let start = State { x: vec![0.0; 3], v: vec![-1.6, 0.9, 1.8] };
    let times: Vec<f64> = (0..SAMPLES).map(|k| k as f64 / 60.0).collect();
    let states = System::new(&law, Edit::NONE).states(&start, &times).expect("a motion");
    let mut rng = lgs_core::stream(2, "noise of what the wind blows", 0);
    let mut draw = || NOISE * DVec3::from([(); 3].map(|()| rng.sample::<f64, _>(rand_distr::StandardNormal)));
    let pose = |state: &State| Pose { linear: DMat3::IDENTITY, shift: DVec3::from_slice(&state.x) + draw() };
    let motion = SharedMotion {
        kind: PoseKind::Rigid,
        times,
        poses: states.iter().map(pose).collect(),
        shape: block([0.3, 0.2, 0.1], 64, 5),
        weights: vec![1.0 / 64.0; 64],
        deviations: Vec::new(),
        residual: 0.0,
    };
    (motion, law, start)
}

#[test]
fn a_law_as_simple_as_one_that_explains_is_found_and_its_band_keeps_to_the_window() {
    let (motion, truth, start) = blown();
    let found = find_law(&[&motion], (Laws::All, Surroundings::default()), 0.0, 1).expect("a law");
    let names: Vec<&str> = found.law.terms.iter().map(|term| term.kind.name()).collect();
    assert_eq!(names, ["uniform-field", "wind-drag"], "{:?}", found.law);
    let band = &found.known.band;
    let middle = motion.duration() / 2.0;
    let radius = |time: f64| band.radius[band.times.partition_point(|t| *t < time)].expect("a radius");
    assert!(radius(middle) < 2.0 * NOISE, "{band:?}");
    // Weight and wind are hardly told apart, which the future shows, and the band says.
    let at = |law: &Law, start: &State| {
        let states = System::new(law, Edit::NONE).states(start, &[1.5]).expect("a motion");
        DVec3::from_slice(&states[0].x)
    };
    let error = at(&truth, &start).distance(at(&found.law, &found.start));
    assert!(error < 2.0 * radius(1.5) && radius(1.5) > 10.0 * radius(middle), "{error}, {band:?}");
}
