//! How well laws are chosen: 96 random laws of a point in twelve classes, 61 samples of a window with noise that
//! is correlated from sample to sample, forecast to three windows.
//!
//! `cargo run --release -p lgs-mechanics --example random_laws -- [--seeds N]`

#[path = "random_laws/draw.rs"]
mod draw;

use draw::Case;
use lgs_mechanics::Candidate;
use lgs_mechanics::bands::{Band, Verdict, trusted, verdict};
use lgs_mechanics::choose::{Choice, candidates, choose};
use lgs_mechanics::coordinates::{Coordinates, State};
use lgs_mechanics::fit::Track;

/// Laws of one seed.
const LAWS: usize = 96;
/// Radius over the extent of the path up to which a forecast is trusted.
const TOLERANCE: f64 = 0.04;

/// What came of one law.
struct Outcome {
    class: usize,
    right: bool,
    /// Error at three windows over the extent of the true path.
    error: f64,
    /// Whether the truth lies in the band at 1, 2 and 3 windows.
    held: [bool; 3],
    chi_square: f64,
    verdict: Verdict,
    /// Error over the path at the time to which the forecast is trusted.
    trusted_error: f64,
}

fn distance(a: &State, b: &State) -> f64 {
    a.x.iter().zip(&b.x).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}

/// Times of the window and after it, to three windows.
fn times() -> Vec<f64> {
    (0..=60).map(|k| f64::from(k) / 20.0).collect()
}

fn judge(case: &Case, list: &[Candidate], choice: &Choice) -> Option<Outcome> {
    let times = times();
    let band = Band::new(choice, &times, case.number as u64)?;
    let radius = band.radius(0.9, &distance);
    let errors: Vec<f64> = band.middle.iter().zip(&case.truth).map(|(a, x)| distance(a, x)).collect();
    let extent = case.extent;
    let terms = &list[choice.law().index].terms;
    let names: Vec<&str> = terms.iter().map(|term| term.kind.name()).collect();
    let [_, until] = trusted(&times, &radius, [0.0, 1.0], TOLERANCE * extent);
    let last_trusted = times.iter().rposition(|t| *t <= until)?;
    let near = Band::new(choice, &times[..=30], case.number as u64)?;
    Some(Outcome {
        class: case.class,
        right: case.names.contains(&names.join("+").as_str()),
        error: errors[60] / extent,
        held: [20, 40, 60].map(|k| errors[k] <= radius[k]),
        chi_square: choice.chi_square_per_sample(),
        verdict: verdict(choice, &near, TOLERANCE * extent, &distance),
        trusted_error: errors[last_trusted] / extent,
    })
}

fn run(number: usize, seed: u64, list: &[Candidate]) -> Option<Outcome> {
    let case = draw::case(number, seed, &times());
    let track = Track::new(&Coordinates::Point, &case.times, &case.x);
    let scales = track.scales(&Coordinates::Point);
    let choice = choose(list, &track, &scales)?;
    judge(&case, list, &choice)
}

fn share(outcomes: &[&Outcome], holds: impl Fn(&Outcome) -> bool) -> f64 {
    100.0 * outcomes.iter().filter(|o| holds(o)).count() as f64 / outcomes.len().max(1) as f64
}

fn report(seed: u64, outcomes: &[Outcome]) {
    let lawful: Vec<&Outcome> = outcomes.iter().filter(|o| o.class != draw::RANDOM_PATH).collect();
    let lawless: Vec<&Outcome> = outcomes.iter().filter(|o| o.class == draw::RANDOM_PATH).collect();
    let mut errors: Vec<f64> = lawful.iter().map(|o| 100.0 * o.error).collect();
    errors.sort_by(f64::total_cmp);
    let quantile = |q: f64| errors[(q * (errors.len() - 1) as f64).round() as usize];
    println!("seed {seed}: {} laws, {} random paths", lawful.len(), lawless.len());
    println!("  right law              {:5.1} %", share(&lawful, |o| o.right));
    println!(
        "  error at 3 windows     median {:.2} %  p75 {:.1} %  p90 {:.1} %",
        quantile(0.5),
        quantile(0.75),
        quantile(0.9)
    );
    let held = [0, 1, 2].map(|k| share(&lawful, |o| o.held[k]));
    println!("  in the 90 % band       {:.0} {:.0} {:.0} % at 1, 2, 3 windows", held[0], held[1], held[2]);
    println!("  trusted and right      {:5.1} %", share(&lawful, |o| o.trusted_error <= TOLERANCE));
    println!("  laws not outside       {:5.1} %", share(&lawful, |o| o.verdict != Verdict::Outside));
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
