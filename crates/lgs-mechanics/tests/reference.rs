//! Each class of motion against a Runge–Kutta integration of its equations, written out here by hand.
#![allow(clippy::unwrap_used, reason = "tests")]

mod common;

use common::{asymmetric, hinge, law, modes, state, tilted, top, tree};
use glam::{DMat3, DQuat, DVec3};
use lgs_mechanics::coordinates::{Coordinates, Port, State};
use lgs_mechanics::{Edit, Law, System};

/// Three windows.
const TIME: f64 = 2.25;

/// The classical Runge–Kutta scheme of fourth order with small steps.
fn reference(start: &[f64], rate: impl Fn(&[f64]) -> Vec<f64>) -> Vec<f64> {
    const STEPS: usize = 40_000;
    let h = TIME / STEPS as f64;
    let moved = |y: &[f64], k: &[f64], s: f64| y.iter().zip(k).map(|(y, k)| y + s * k).collect::<Vec<_>>();
    let mut y = start.to_vec();
    for _ in 0..STEPS {
        let a = rate(&y);
        let b = rate(&moved(&y, &a, 0.5 * h));
        let c = rate(&moved(&y, &b, 0.5 * h));
        let d = rate(&moved(&y, &c, h));
        (0..y.len()).for_each(|i| y[i] += h / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]));
    }
    y
}

/// Follows a law with a step that is resolved to a millionth.
fn followed(law: Law, start: &State) -> State {
    let law = law.resolved(start, TIME, 1e-6).unwrap();
    System::new(&law, Edit::NONE).states(start, &[TIME]).unwrap().remove(0)
}

fn assert_close(found: &[f64], expected: &[f64], tolerance: f64) {
    for (found, expected) in found.iter().zip(expected) {
        assert!((found - expected).abs() < tolerance, "{found}, not {expected}");
    }
}

/// A law of vector coordinates against the rates of `x` then `v`.
fn check(law: Law, start: &State, rate: impl Fn(&[f64], &[f64]) -> Vec<f64>) {
    let n = start.v.len();
    let expected =
        reference(&[start.x.as_slice(), &start.v].concat(), |y| [&y[n..], &rate(&y[..n], &y[n..])].concat());
    let end = followed(law, start);
    assert_close(&[end.x, end.v].concat(), &expected, 2e-5);
}

fn norm(v: &[f64]) -> f64 {
    v.iter().map(|v| v * v).sum::<f64>().sqrt()
}

#[test]
fn large_pendulum() {
    let terms: [(&str, Port, &[f64]); 2] =
        [("fourier", Port::Whole, &[40.0, 0.0]), ("linear-drag", Port::Whole, &[0.2])];
    let start = state(&[2.4], &[0.5]);
    check(law(hinge(), &[], &terms), &start, |x, v| vec![-40.0 * x[0].sin() - 0.2 * v[0]]);
}

#[test]
fn double_pendulum() {
    let ([m1, m2], [l1, l2], g): ([f64; 2], [f64; 2], f64) = ([1.0, 0.6], [0.5, 0.4], 9.81);
    let inertia = (m1 + m2) * l1 * l1;
    let (ratio, coupling) = (m2 * l2 * l2 / inertia, m2 * l1 * l2 / inertia);
    let terms: [(&str, Port, &[f64]); 2] =
        [("fourier", Port::First, &[g / l1, 0.0]), ("fourier", Port::Second, &[m2 * g * l2 / inertia, 0.0])];
    let law = law(tree(), &[ratio, coupling / ratio.sqrt(), 0.0], &terms);
    check(law, &state(&[1.4, -0.6], &[0.3, 1.0]), |x, v| {
        let (sine, cosine) = (x[0] - x[1]).sin_cos();
        let common = 2.0 * m1 + m2 - m2 * (2.0 * (x[0] - x[1])).cos();
        let first = -g * (2.0 * m1 + m2) * x[0].sin()
            - m2 * g * (x[0] - 2.0 * x[1]).sin()
            - 2.0 * sine * m2 * (v[1] * v[1] * l2 + v[0] * v[0] * l1 * cosine);
        let second = 2.0
            * sine
            * (v[0] * v[0] * l1 * (m1 + m2) + g * (m1 + m2) * x[0].cos() + v[1] * v[1] * l2 * m2 * cosine);
        vec![first / (l1 * common), second / (l2 * common)]
    });
}

#[test]
fn fan_with_a_torque() {
    let terms: [(&str, Port, &[f64]); 2] =
        [("constant-drive", Port::Whole, &[6.0]), ("linear-drag", Port::Whole, &[0.8])];
    check(law(hinge(), &[], &terms), &state(&[0.0], &[1.0]), |_, v| vec![6.0 - 0.8 * v[0]]);
}

#[test]
fn torsion_spring() {
    let law = law(hinge(), &[], &[("spring", Port::Whole, &[50.0, 0.3])]);
    check(law, &state(&[-1.0], &[2.0]), |x, _| vec![-50.0 * (x[0] - 0.3)]);
}

#[test]
fn rolling_ball_that_slows_and_stops() {
    let law = law(modes(), &[], &[("dry-friction", Port::Whole, &[0.9, 1e-2])]);
    check(law, &state(&[0.0, 0.0], &[1.2, 0.5]), |_, v| {
        let speed = (v[0] * v[0] + v[1] * v[1] + 1e-4).sqrt();
        vec![-0.9 * v[0] / speed, -0.9 * v[1] / speed]
    });
}

#[test]
fn kepler_orbit() {
    let terms: [(&str, Port, &[f64]); 1] = [("central-inverse-square", Port::Whole, &[1.3, 0.1, 0.0, -0.2])];
    check(law(Coordinates::Point, &[], &terms), &state(&[0.9, 0.1, 0.0], &[0.2, 1.0, 0.3]), |x, _| {
        let r = [x[0] - 0.1, x[1], x[2] + 0.2];
        r.map(|r_i| -1.3 * r_i / norm(&r).powi(3)).to_vec()
    });
}

#[test]
fn double_well() {
    let root = 4.0 * 3.0_f64.sqrt().recip();
    let terms: [(&str, Port, &[f64]); 1] =
        [("quartic-axis", Port::Whole, &[6.0, -14.0, root, root, root, 0.0, 0.0, 0.0])];
    check(law(Coordinates::Point, &[], &terms), &state(&[0.5, 0.4, 0.2], &[0.5, 0.8, -0.7]), |x, _| {
        let along = (x[0] + x[1] + x[2]) / 3.0_f64.sqrt();
        let pull = (-14.0 * along + 256.0 * along.powi(3)) / 3.0_f64.sqrt();
        x.iter().map(|x| -6.0 * x - pull).collect()
    });
}

#[test]
fn charged_ball_in_a_magnetic_field() {
    let terms: [(&str, Port, &[f64]); 2] =
        [("gyroscopic", Port::Whole, &[1.0, 2.0, 6.0]), ("uniform-field", Port::Whole, &[0.0, 0.5, -1.0])];
    check(law(Coordinates::Point, &[], &terms), &state(&[0.0; 3], &[1.0, 0.0, 0.4]), |_, v| {
        let force = DVec3::new(1.0, 2.0, 6.0).cross(DVec3::from_slice(v)) + DVec3::new(0.0, 0.5, -1.0);
        force.to_array().to_vec()
    });
}

#[test]
fn two_balls_on_a_spring() {
    let ratio = 2.5;
    let terms: [(&str, Port, &[f64]); 2] =
        [("uniform-field", Port::Both, &[0.0, 0.0, -9.81]), ("spring-length", Port::Between, &[60.0, 0.6])];
    let start = state(&[0.0, 0.0, 0.0, 0.8, 0.1, 0.0], &[1.0, 0.5, 4.0, 0.0, -0.5, 4.0]);
    check(law(Coordinates::Pair, &[ratio, 0.0, 0.0, 0.0], &terms), &start, |x, _| {
        let r: Vec<f64> = (0..3).map(|i| x[i] - x[i + 3]).collect();
        let part = -60.0 * (1.0 - 0.6 / norm(&r));
        let field = [0.0, 0.0, -9.81];
        let first = (0..3).map(|i| field[i] + part * r[i]);
        first.chain((0..3).map(|i| field[i] - part * r[i] / ratio)).collect()
    });
}

#[test]
fn vibrating_body() {
    let terms: [(&str, Port, &[f64]); 2] = [
        ("spring-full", Port::Whole, &[90.0, -20.0, 150.0, 0.05, 0.0]),
        ("linear-drag", Port::Whole, &[0.5]),
    ];
    check(law(modes(), &[], &terms), &state(&[0.2, -0.1], &[1.0, 0.0]), |x, v| {
        let x = [x[0] - 0.05, x[1]];
        vec![-90.0 * x[0] + 20.0 * x[1] - 0.5 * v[0], 20.0 * x[0] - 150.0 * x[1] - 0.5 * v[1]]
    });
}

/// Rates of a rotation matrix (by columns) and an angular velocity in body axes.
fn body_rate(y: &[f64], moments: DVec3, torque: impl Fn(DMat3) -> DVec3) -> Vec<f64> {
    let rotation = DMat3::from_cols_slice(&y[..9]);
    let spin = DVec3::from_slice(&y[9..]);
    let turning = DMat3::from_cols(DVec3::X, DVec3::Y, DVec3::Z);
    let columns = [0, 1, 2].map(|i| rotation * spin.cross(turning.col(i)));
    let faster = (torque(rotation) + (moments * spin).cross(spin)) / moments;
    columns.iter().flat_map(|c| c.to_array()).chain(faster.to_array()).collect()
}

fn check_body(law: Law, start: &State, moments: DVec3, torque: impl Fn(DMat3) -> DVec3) {
    let rotation = DMat3::from_quat(DQuat::from_xyzw(start.x[1], start.x[2], start.x[3], start.x[0]));
    let y = [rotation.to_cols_array().as_slice(), &start.v[..3]].concat();
    let expected = reference(&y, |y| body_rate(y, moments, &torque));
    let end = followed(law, start);
    let rotation = DMat3::from_quat(DQuat::from_xyzw(end.x[1], end.x[2], end.x[3], end.x[0]));
    assert_close(&rotation.to_cols_array(), &expected[..9], 5e-5);
    assert_close(&end.v[..3], &expected[9..], 5e-4);
}

#[test]
fn tumbling_asymmetric_body() {
    let start = state(&[tilted().as_slice(), &[0.0; 3]].concat(), &[0.1, 6.0, 0.1, 0.0, 0.0, 0.0]);
    let law = law(Coordinates::Rigid(asymmetric()), &[0.1, -0.2], &[]);
    let moments = DVec3::new(0.05 * 0.1_f64.exp(), 0.08, 0.11 * (-0.2_f64).exp());
    check_body(law, &start, moments, |_| DVec3::ZERO);
}

#[test]
fn top_under_gravity() {
    let law = law(top(), &[0.0, 0.0], &[("uniform-field", Port::Arm, &[0.0, 0.0, -9.81])]);
    check_body(law, &state(&tilted(), &[0.5, 0.0, 40.0]), DVec3::new(0.1, 0.1, 0.02), |rotation| {
        DVec3::new(0.0, 0.0, 0.3).cross(rotation.transpose() * DVec3::new(0.0, 0.0, -9.81))
    });
}
