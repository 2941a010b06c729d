//! The weak form finds the laws of exact motions, and embeddings move as their rates say.
#![allow(clippy::unwrap_used, reason = "tests")]

mod common;

use glam::DVec3;
use lgs_mechanics::coordinates::{AffineMode, Coordinates, Embedding, Modal, State};
use lgs_mechanics::terms::Scales;
use lgs_mechanics::{Candidate, Edit, Law, System};
use nalgebra::{DMatrix, DVector};

/// Times between which velocities are differenced.
const NEAR: f64 = 1e-4;

/// States along a motion, each with its acceleration by central differences.
fn observed(law: &Law, start: &State) -> Vec<(State, Vec<f64>)> {
    let times: Vec<f64> =
        (0..40).flat_map(|i| [-NEAR, 0.0, NEAR].map(|near| 0.02 * f64::from(i) + near)).collect();
    let states = System::new(law, Edit::NONE).states(start, &times).unwrap();
    let rate = |triple: &[State]| {
        let change = triple[2].v.iter().zip(&triple[0].v);
        (triple[1].clone(), change.map(|(after, before)| (after - before) / (2.0 * NEAR)).collect())
    };
    states.chunks(3).map(rate).collect()
}

#[test]
fn regression_on_an_exact_motion_finds_its_law() {
    for (law, start) in common::examples() {
        let candidate = Candidate::new(law.coordinates.clone(), law.terms.clone()).unwrap();
        let (mut rows, mut right) = (Vec::new(), Vec::new());
        let mut columns = 0;
        for (state, acceleration) in observed(&law, &start) {
            let design = candidate.design().at(&law.parameters, &state);
            columns = design.ncols();
            rows.extend(design.transpose().iter().copied());
            right.extend(candidate.inertial_force(&law.parameters, &state, &acceleration));
        }
        let design = DMatrix::from_row_slice(right.len(), columns, &rows);
        let right = DVector::from_vec(right);
        let coefficients = design.clone().svd(true, true).solve(&right, 1e-9).unwrap();
        let name = law.coordinates.name();
        let left = (&design * &coefficients - &right).amax();
        assert!(left < 1e-4 * right.amax(), "{name}: {left} of {}", right.amax());
        let found = candidate.with_coefficients(&law.parameters, coefficients.as_slice());
        let found = candidate.law(found, law.step).unwrap();
        let [end, expected] =
            [&found, &law].map(|law| System::new(law, Edit::NONE).states(&start, &[0.5]).unwrap().remove(0));
        let apart = law.coordinates.difference(&expected.x, &end.x);
        assert!(apart.iter().all(|d| d.abs() < 1e-4), "{name}: {apart:?}");
    }
}

#[test]
fn starts_and_descriptions_have_the_size_of_the_law() {
    let scales = Scales { length: 0.4, time: 0.75, origin: [3.0, -2.0, 1.0], ..Scales::UNIT };
    for (law, _) in common::examples() {
        let candidate = Candidate::new(law.coordinates.clone(), law.terms.clone()).unwrap();
        let parameters = candidate.parameters(&scales);
        assert_eq!(parameters.len(), law.parameters.len());
        for start in candidate.starts(&scales) {
            for (parameter, value) in parameters.iter().zip(start) {
                let inside = (parameter.lower..=parameter.upper).contains(&value);
                assert!(inside && parameter.scale > 0.0, "{}: {value}", parameter.name);
            }
        }
    }
}

#[test]
fn placements_change_at_their_rates() {
    let point = DVec3::new(0.3, -0.4, 0.7);
    let mode = |linear: [[f64; 3]; 3], shift| AffineMode { linear, shift };
    let stretch = mode([[1.0, 0.2, 0.0], [0.0, -0.5, 0.1], [0.3, 0.0, 0.2]], [0.1, 0.0, -0.2]);
    let shear = mode([[0.0, 1.0, 0.0], [0.4, 0.0, 0.0], [0.0, 0.0, -0.6]], [0.0, 0.3, 0.0]);
    let modal = Coordinates::Modal(Modal { affine: vec![stretch, shear], further: 0 });
    let mut cases = common::examples();
    cases[2].0.coordinates = modal;
    for (law, start) in cases {
        let coordinates = &law.coordinates;
        let n = start.v.len();
        let embedding = Embedding::new(coordinates, &start.x);
        let x = coordinates.retract(&start.x, &vec![0.2; n]);
        for placed in embedding.placements(&start.x) {
            assert!((placed.apply(point) - point).length() < 1e-12, "{}", coordinates.name());
        }
        let step = 1e-6;
        let moved = |sign: f64| {
            let change: Vec<f64> = start.v.iter().map(|v| sign * step * v).collect();
            embedding.placements(&coordinates.retract(&x, &change))
        };
        for ((ahead, behind), rate) in moved(1.0).iter().zip(moved(-1.0)).zip(embedding.rates(&x, &start.v)) {
            let slope = (ahead.apply(point) - behind.apply(point)) / (2.0 * step);
            assert!((slope - rate.apply(point)).length() < 1e-7, "{}", coordinates.name());
        }
    }
}
