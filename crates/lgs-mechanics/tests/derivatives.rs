//! Sensitivities are the derivatives of the motion, and motions reverse, in all coordinates.

#![allow(clippy::unwrap_used, reason = "tests")]

mod common;

use lgs_mechanics::coordinates::State;
use lgs_mechanics::{Edit, Law, System};

const TIMES: [f64; 3] = [0.2, 0.537, -0.31];

fn moved(law: &Law, start: &State, column: usize, by: f64) -> Vec<State> {
    let n = start.v.len();
    let (mut law, mut start) = (law.clone(), start.clone());
    if column < n {
        let mut change = vec![0.0; n];
        change[column] = by;
        start.x = law.coordinates.retract(&start.x, &change);
    } else if column < 2 * n {
        start.v[column - n] += by;
    } else {
        law.parameters[column - 2 * n] += by;
    }
    System::new(&law, edit()).states(&start, &TIMES).unwrap()
}

fn edit() -> Edit {
    Edit { velocity: 0.9, potential: 1.2, force: 0.7 }
}

fn assert_close(found: f64, expected: f64, tolerance: f64, what: &str) {
    let apart = (found - expected).abs();
    assert!(apart < tolerance * (1.0 + expected.abs()), "{what}: {found}, not {expected}");
}

#[test]
fn sensitivities_are_the_derivatives_of_states() {
    const STEP: f64 = 1e-6;
    for (law, start) in common::examples() {
        let n = start.v.len();
        let found = System::new(&law, edit()).sensitivities(&start, &TIMES).unwrap();
        let plain = System::new(&law, edit()).states(&start, &TIMES).unwrap();
        for column in 0..2 * n + law.parameters.len() {
            let (ahead, behind) = (moved(&law, &start, column, STEP), moved(&law, &start, column, -STEP));
            for time in 0..TIMES.len() {
                let turned = law.coordinates.difference(&behind[time].x, &ahead[time].x);
                let kicked = ahead[time].v.iter().zip(&behind[time].v).map(|(a, b)| a - b);
                let what = format!("{} column {column}", law.coordinates.name());
                for (row, (x, v)) in turned.iter().zip(kicked).enumerate() {
                    assert_close(found[time].position[(row, column)], x / (2.0 * STEP), 2e-7, &what);
                    assert_close(found[time].velocity[(row, column)], v / (2.0 * STEP), 2e-6, &what);
                }
            }
        }
        for (sensitivity, state) in found.iter().zip(&plain) {
            let change = law.coordinates.difference(&sensitivity.state.x, &state.x);
            assert!(change.iter().all(|change| change.abs() < 1e-14));
        }
    }
}

#[test]
fn a_motion_there_and_back_ends_where_it_began() {
    for (law, start) in common::examples() {
        for sign in [1.0, -1.0] {
            let time = sign * 0.75;
            let end = System::new(&law, Edit::NONE).states(&start, &[time]).unwrap().remove(0);
            let back = System::new(&law, Edit::NONE).states(&end, &[-time]).unwrap().remove(0);
            let apart = law.coordinates.difference(&start.x, &back.x);
            assert!(apart.iter().all(|d| d.abs() < 1e-10), "{} {apart:?}", law.coordinates.name());
            assert!(start.v.iter().zip(&back.v).all(|(a, b)| (a - b).abs() < 1e-9));
        }
    }
}
