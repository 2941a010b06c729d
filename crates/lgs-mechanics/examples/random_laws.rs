//! How well laws are chosen: 96 random laws of a point in twelve classes, 61 samples of a window with noise
//! that is correlated from sample to sample, forecast to three windows.
//!
//! `cargo run --release -p lgs-mechanics --example random_laws -- [--seeds N]`

#[path = "random_laws/draw.rs"]
mod draw;

use draw::{Case, distance};
use lgs_mechanics::Candidate;
use lgs_mechanics::bands::Verdict;
use lgs_mechanics::choose::candidates;
use lgs_mechanics::coordinates::Coordinates;
use lgs_mechanics::explain::{Explanation, Options, explain};

/// Laws of one seed.
const LAWS: usize = 96;

/// What came of one law.
struct Outcome {
    class: usize,
    right: bool,
    /// Error at three windows over the path until then.
    error: f64,
    /// Whether the truth lies in the band at 1, 2 and 3 windows.
    held: [bool; 3],
    chi_square: f64,
    verdict: Verdict,
    /// Largest error over the path in the time in which the forecast is trusted.
    trusted_error: f64,
}

/// Times of the window and after it, to three windows.
fn times() -> Vec<f64> {
    (0..=60).map(|k| f64::from(k) / 20.0).collect()
}

fn judge(case: &Case, explanation: &Explanation) -> Option<Outcome> {
    let times = times();
    let radius = explanation.radius(&times);
    let motion = explanation.states(&times).ok()?;
    let errors: Vec<f64> = motion.iter().zip(&case.truth).map(|(a, x)| distance(a, x)).collect();
    let terms = &explanation.law().terms;
    let names: Vec<&str> = terms.iter().map(|term| term.kind.name()).collect();
    let steps = case.truth.windows(2).map(|pair| distance(&pair[0], &pair[1]));
    let path: Vec<f64> =
        steps.scan(0.0, |sum, step| Some(*sum + step).inspect(|next| *sum = *next)).collect();
    let at = |k: usize| errors[k] / path[k.max(20) - 1];
    let trusted = (0..=60).filter(|&k| (explanation.trusted[0]..=explanation.trusted[1]).contains(&times[k]));
    Some(Outcome {
        class: case.class,
        right: case.names.contains(&names.join("+").as_str()),
        error: at(60),
        held: [20, 40, 60].map(|k| errors[k] <= radius[k]),
        chi_square: explanation.choice.chi_square_per_sample(),
        verdict: explanation.verdict,
        trusted_error: trusted.map(at).fold(0.0, f64::max),
    })
}

fn run(number: usize, seed: u64, list: &[Candidate]) -> Option<Outcome> {
    let case = draw::case(number, seed, &times());
    judge(&case, &explain(list, &case.times, &case.x, &Options::default()).ok()?)
}

fn share(outcomes: &[&Outcome], holds: impl Fn(&Outcome) -> bool) -> f64 {
    100.0 * outcomes.iter().filter(|o| holds(o)).count() as f64 / outcomes.len().max(1) as f64
}

/// Whether a verdict is right: laws are not outside, nothing is trusted that errs by more than the tolerance,
/// and random paths are never explained.
fn verdict_right(outcome: &Outcome) -> bool {
    match outcome.class == draw::RANDOM_PATH {
        true => outcome.verdict != Verdict::Explained,
        false => {
            let trusted = outcome.trusted_error <= Options::default().tolerance;
            outcome.verdict != Verdict::Outside && (outcome.verdict != Verdict::Explained || trusted)
        }
    }
}

fn report(seed: u64, outcomes: &[Outcome]) {
    let all: Vec<&Outcome> = outcomes.iter().collect();
    let (lawless, lawful): (Vec<&Outcome>, Vec<&Outcome>) =
        outcomes.iter().partition(|o| o.class == draw::RANDOM_PATH);
    let mut errors: Vec<f64> = lawful.iter().map(|o| 100.0 * o.error).collect();
    errors.sort_by(f64::total_cmp);
    let quantile = |q: f64| errors[(q * (errors.len() - 1) as f64).round() as usize];
    let [median, p75, p90] = [0.5, 0.75, 0.9].map(quantile);
    println!("seed {seed}: {} laws, {} random paths", lawful.len(), lawless.len());
    println!("  right law              {:5.1} %", share(&lawful, |o| o.right));
    println!("  error at 3 windows     median {median:.2} %  p75 {p75:.1} %  p90 {p90:.1} %");
    let held = [0, 1, 2].map(|k| share(&lawful, |o| o.held[k]));
    println!("  in the 90 % band       {:.0} {:.0} {:.0} % at 1, 2, 3 windows", held[0], held[1], held[2]);
    println!("  verdict right          {:5.1} %", share(&all, verdict_right));
    println!("  laws outside           {:5.1} %", share(&lawful, |o| o.verdict == Verdict::Outside));
    println!("  laws explained         {:5.1} %", share(&lawful, |o| o.verdict == Verdict::Explained));
    println!("  random paths outside   {:5.1} %", share(&lawless, |o| o.verdict == Verdict::Outside));
    println!("  random paths explained {:5.1} %", share(&lawless, |o| o.verdict == Verdict::Explained));
    let largest = lawful.iter().map(|o| o.chi_square).fold(0.0, f64::max);
    let smallest = lawless.iter().map(|o| o.chi_square).fold(f64::INFINITY, f64::min);
    println!("  χ² per sample          laws ≤ {largest:.2}, random paths ≥ {smallest:.2}");
    for class in 0..draw::CLASSES {
        let of: Vec<&Outcome> = outcomes.iter().filter(|o| o.class == class).collect();
        println!("    {:28} right {:5.1} %", draw::name(class), share(&of, |o| o.right));
    }
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let seeds = match arguments.as_slice() {
        [flag, count] if flag == "--seeds" => count.parse().unwrap_or(1),
        _ => 1,
    };
    let list = candidates(&Coordinates::Point);
    for seed in 0..seeds {
        let outcomes: Vec<Outcome> = (0..LAWS).filter_map(|number| run(number, seed, &list)).collect();
        report(seed, &outcomes);
    }
}
