//! Random laws, starts and noise.

use lgs_core::{Stream, stream};
use lgs_mechanics::coordinates::{Coordinates, Port, State};
use lgs_mechanics::terms::Term;
use lgs_mechanics::{Edit, Law, System};
use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};
use std::f64::consts::TAU;

/// Number of classes.
pub(crate) const CLASSES: usize = 12;
/// The class that no law explains.
pub(crate) const RANDOM_PATH: usize = 11;
/// Error of the true motions over their extent.
const RESOLVED: f64 = 1e-6;
/// Shortest step of the true motions: a 64th of the interval between samples.
const SHORTEST: f64 = 1.0 / (60.0 * 64.0);
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
    pub(crate) class: usize,
    /// Names of the terms that count as right.
    pub(crate) names: Vec<&'static str>,
    pub(crate) times: Vec<f64>,
    pub(crate) x: Vec<Vec<f64>>,
    pub(crate) truth: Vec<State>,
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

/// Distance of two configurations.
pub(crate) fn distance(a: &State, b: &State) -> f64 {
    a.x.iter().zip(&b.x).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}

fn normal(random: &mut Stream) -> f64 {
    StandardNormal.sample(random)
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

/// Waves of a random path in each coordinate.
const WAVES: usize = 8;
/// Time over which a random path is correlated, in windows: polynomials of a degree of about eight follow it.
const CORRELATION_TIME: f64 = 0.35;
/// Standard deviation of a random path, about that of the other classes.
const WANDERING: f64 = 0.5;

/// A random smooth path: in each coordinate a Gaussian process with the kernel `exp(−t²/2τ²)`, as waves of
/// random rates.
fn wander(random: &mut Stream, times: &[f64]) -> Vec<State> {
    let size = WANDERING * (2.0 / WAVES as f64).sqrt();
    let wave = |random: &mut Stream| [normal(random) / CORRELATION_TIME, between(random, 0.0, TAU)];
    let waves: Vec<[f64; 2]> = (0..3 * WAVES).map(|_| wave(random)).collect();
    let sum = |waves: &[[f64; 2]], t: f64| -> f64 {
        waves.iter().map(|[rate, phase]| size * (rate * t + phase).sin()).sum()
    };
    let at = |t: &f64| State { x: waves.chunks(WAVES).map(|own| sum(own, *t)).collect(), v: vec![0.0; 3] };
    times.iter().map(at).collect()
}

/// A law of a class and a start, with steps that resolve its motion up to a time. Motions that no step down
/// to [`SHORTEST`] resolves, falls through a centre of attraction, are drawn again.
fn law(class: usize, random: &mut Stream, until: f64) -> (Law, State) {
    loop {
        let term = |name: &&str| Term::named(name, Port::Whole).expect("a known term");
        let terms = TERMS[class].iter().map(term).collect();
        let law = Law::new(Coordinates::Point, terms, parameters(class, random), 1.0 / 120.0).expect("a law");
        let start = State { x: vector(random, 0.6, 1.2).to_vec(), v: vector(random, 0.6, 2.0).to_vec() };
        match law.resolved(&start, until, RESOLVED) {
            Ok(law) if law.step > SHORTEST => return (law, start),
            _ => {}
        }
    }
}

/// Adds noise that is correlated from sample to sample.
fn noisy(states: &[State], level: f64, random: &mut Stream) -> Vec<Vec<f64>> {
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
    let until = asked[asked.len() - 1];
    let lawful = (class != RANDOM_PATH).then(|| law(class, &mut random, until));
    let mut states = match &lawful {
        Some((law, start)) => System::new(law, Edit::NONE).states(start, &both).expect("a motion"),
        None => wander(&mut random, &both),
    };
    let truth = states.split_off(times.len());
    let level = between(&mut random, (0.0004_f64).ln(), (0.003_f64).ln()).exp();
    let x = noisy(&states, level, &mut random);
    let mut names = vec![name(class)];
    if class == 5 {
        names.push("spring-positive");
    }
    Case { class, names, times, x, truth }
}
