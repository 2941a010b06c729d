//! Random laws, starts and noise.

use lgs_core::{Stream, stream};
use lgs_mechanics::coordinates::{Coordinates, Port, State};
use lgs_mechanics::terms::Term;
use lgs_mechanics::{Edit, Law, System};
use rand::RngExt;
use std::f64::consts::TAU;

/// Number of classes.
pub(crate) const CLASSES: usize = 12;
/// The class that no law explains.
pub(crate) const RANDOM_PATH: usize = 11;
/// Correlation of the noise from sample to sample.
const CORRELATION: f64 = 0.75;

/// Terms of each class; with the names that count as right.
const TERMS: [&[&str]; CLASSES] = [
    &["uniform-field"],
    &["uniform-field", "linear-drag"],
    &["uniform-field", "quadratic-drag"],
    &["spring"],
    &["spring", "linear-drag"],
    &["spring-full"],
    &["central-inverse-square"],
    &["central-logarithm"],
    &["quartic-radial"],
    &["gyroscopic"],
    &["uniform-field", "gyroscopic"],
    &[],
];

/// One law with its noisy samples and its true motion.
pub(crate) struct Case {
    pub(crate) number: usize,
    pub(crate) class: usize,
    /// Names of the terms that count as right.
    pub(crate) names: Vec<&'static str>,
    pub(crate) times: Vec<f64>,
    pub(crate) x: Vec<Vec<f64>>,
    pub(crate) truth: Vec<State>,
    /// Largest distance of the true motion from its start.
    pub(crate) extent: f64,
}

/// Names of a class in the order of its terms.
pub(crate) fn name(class: usize) -> &'static str {
    const NAMES: [&str; CLASSES] = [
        "uniform-field",
        "uniform-field+linear-drag",
        "uniform-field+quadratic-drag",
        "spring",
        "spring+linear-drag",
        "spring-full",
        "central-inverse-square",
        "central-logarithm",
        "quartic-radial",
        "gyroscopic",
        "uniform-field+gyroscopic",
        "random path",
    ];
    NAMES[class]
}

fn between(random: &mut Stream, low: f64, high: f64) -> f64 {
    low + (high - low) * random.random::<f64>()
}

fn normal(random: &mut Stream) -> f64 {
    let radius = (-2.0 * (1.0 - random.random::<f64>()).ln()).sqrt();
    radius * (TAU * random.random::<f64>()).cos()
}

/// A vector of random direction with a length between two.
fn vector(random: &mut Stream, low: f64, high: f64) -> [f64; 3] {
    let v: [f64; 3] = std::array::from_fn(|_| normal(random));
    let length = v.iter().map(|v| v * v).sum::<f64>().sqrt();
    let wanted = between(random, low, high);
    v.map(|v| v / length * wanted)
}

/// Stiffness with random principal directions, upper triangle by rows.
fn stiffness(random: &mut Stream) -> Vec<f64> {
    let a = vector(random, 1.0, 1.0);
    let b = vector(random, 1.0, 1.0);
    let [k, ka, kb] = [between(random, 3.0, 9.0), between(random, 3.0, 20.0), between(random, 3.0, 20.0)];
    let entry = |i: usize, j: usize| f64::from(u8::from(i == j)) * k + ka * a[i] * a[j] + kb * b[i] * b[j];
    vec![entry(0, 0), entry(0, 1), entry(0, 2), entry(1, 1), entry(1, 2), entry(2, 2)]
}

/// Parameters of a class.
fn parameters(class: usize, random: &mut Stream) -> Vec<f64> {
    let field = vector(random, 1.0, 5.0).to_vec();
    let center = vector(random, 0.0, 0.3).to_vec();
    let rate = between(random, 2.5, 7.0).powi(2);
    let drag = between(random, 0.4, 1.6);
    match class {
        0 => field,
        1 | 2 => [field, vec![drag]].concat(),
        3 => [vec![rate], center].concat(),
        4 => [vec![rate], center, vec![drag]].concat(),
        5 => [stiffness(random), center].concat(),
        6 | 7 => [vec![between(random, 2.0, 9.0)], center].concat(),
        8 => [vec![-between(random, 4.0, 12.0), between(random, 8.0, 25.0)], center].concat(),
        9 => vector(random, 3.0, 9.0).to_vec(),
        _ => [field, vector(random, 3.0, 9.0).to_vec()].concat(),
    }
}

/// A smooth random path: three waves in each coordinate.
fn wander(random: &mut Stream, times: &[f64]) -> Vec<State> {
    let waves: Vec<[f64; 4]> = (0..9)
        .map(|i| {
            [(i % 3) as f64, between(random, 0.2, 0.6), between(random, 2.0, 11.0), between(random, 0.0, TAU)]
        })
        .collect();
    let at = |t: &f64| {
        let mut x = vec![0.0; 3];
        waves
            .iter()
            .for_each(|[axis, size, rate, phase]| x[*axis as usize] += size * (rate * t + phase).sin());
        State { x, v: vec![0.0; 3] }
    };
    times.iter().map(at).collect()
}

fn motion(class: usize, random: &mut Stream, times: &[f64]) -> Vec<State> {
    if class == RANDOM_PATH {
        return wander(random, times);
    }
    let term = |name: &&str| Term::named(name, Port::Whole).expect("a known term");
    let terms = TERMS[class].iter().map(term).collect();
    let law =
        Law::new(Coordinates::Point, terms, parameters(class, random), 0.005).expect("a law of a point");
    let start = State { x: vector(random, 0.6, 1.2).to_vec(), v: vector(random, 0.6, 2.0).to_vec() };
    System::new(&law, Edit::NONE).states(&start, times).expect("a motion")
}

/// Adds noise of a random level, 0.0004 to 0.003, that is correlated from sample to sample.
fn noisy(states: &[State], random: &mut Stream) -> Vec<Vec<f64>> {
    let level = between(random, (0.0004_f64).ln(), (0.003_f64).ln()).exp();
    let fresh = (1.0 - CORRELATION * CORRELATION).sqrt();
    let mut error: [f64; 3] = std::array::from_fn(|_| normal(random));
    let sample = |state: &State| {
        let x = state.x.iter().zip(&error).map(|(x, e)| x + level * e).collect();
        error = error.map(|e| CORRELATION * e + fresh * normal(random));
        x
    };
    states.iter().map(sample).collect()
}

/// Law number `number` of a seed, with its true motion at `asked`.
pub(crate) fn case(number: usize, seed: u64, asked: &[f64]) -> Case {
    let class = number % CLASSES;
    let mut random = stream(seed, "random laws", number as u64);
    let times: Vec<f64> = (0..61).map(|k| f64::from(k) / 60.0).collect();
    let both = [times.as_slice(), asked].concat();
    let mut states = motion(class, &mut random, &both);
    let truth = states.split_off(times.len());
    let x = noisy(&states, &mut random);
    let start = truth[0].x.clone();
    let from = |s: &State| s.x.iter().zip(&start).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
    let extent = truth.iter().map(from).fold(0.0, f64::max);
    let mut names = vec![name(class)];
    if class == 5 {
        names.push("spring-positive");
    }
    Case { number, class, names, times, x, truth, extent }
}
