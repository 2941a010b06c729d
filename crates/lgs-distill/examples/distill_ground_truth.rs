//! Stage 1 on ground-truth trajectories with noise, object by object of the truth: errors at the end of the
//! whole recording and at three times the window as parts of the path, verdicts, the share of the truth in
//! the 90 % band, constants against those of the truth, errors under edits, and impacts; then how often all
//! this is right.
//!
//! `cargo run --release -p lgs-distill --example distill_ground_truth -- [--noise X] [--seeds A[-B]] [--laws]
//! [SCENE …]`
//!
//! With `--laws` every law is told with its parameters and its rivals.

#[path = "distill_ground_truth/constants.rs"]
mod constants;
#[path = "distill_ground_truth/contact.rs"]
mod contact;
#[path = "distill_ground_truth/edits.rs"]
mod edits;
#[path = "distill_ground_truth/measure.rs"]
mod measure;
#[path = "distill_ground_truth/summary.rs"]
mod summary;
#[path = "distill_ground_truth/thresholds.rs"]
mod thresholds;

use measure::{Row, measured};
use std::ops::RangeInclusive;

/// Scenes with one law for each object or two, and those that no law explains.
const SCENES: [&str; 59] = [
    "falling-ball",
    "fan",
    "sled",
    "projectile",
    "spring",
    "pendulum",
    "large-pendulum",
    "double-pendulum",
    "spun-up-fan",
    "torsion-spring",
    "rolling-ball",
    "top",
    "tumbling",
    "kepler",
    "double-well",
    "quadratic-drag",
    "magnet",
    "spring-pair",
    "vibration",
    "bounce",
    "sliding-block",
    "stopping-wheel",
    "swing",
    "elastic-pendulum",
    "damped-springs",
    "magnetic-trap",
    "conical-pendulum",
    "slope",
    "thrown-box",
    "spinning-ball",
    "puck",
    "attracting-pair",
    "falling-jelly",
    "screw",
    "wind",
    "whirlpool",
    "stiffening-spring",
    "rubbing-spring",
    "magnetic-spiral",
    "bowl",
    "two-centres",
    "scattering",
    "self-sustained",
    "driven-pendulum",
    "falling-pole",
    "rubbing-balance",
    "flywheel",
    "magnet-pendulum",
    "rolling-spring",
    "yo-yo",
    "rocket",
    "braked-top",
    "repelling-pair",
    "random-fields",
    "random-hinge",
    "walker",
    "led",
    "grabbed",
    "released",
];

type AnyError = Box<dyn std::error::Error>;

/// What is asked for.
struct Request {
    noise: f32,
    seeds: RangeInclusive<u64>,
    tells_laws: bool,
    scenes: Vec<String>,
}

impl Request {
    fn of_arguments() -> Result<Self, AnyError> {
        let mut request = Self { noise: 0.002, seeds: 1..=3, tells_laws: false, scenes: Vec::new() };
        let mut arguments = std::env::args().skip(1);
        while let Some(argument) = arguments.next() {
            match argument.as_str() {
                "--noise" => request.noise = arguments.next().ok_or("--noise NOISE")?.parse()?,
                "--seeds" => request.seeds = seeds(&arguments.next().ok_or("--seeds A[-B]")?)?,
                "--laws" => request.tells_laws = true,
                _ => request.scenes.push(argument),
            }
        }
        if request.scenes.is_empty() {
            request.scenes = SCENES.map(str::to_owned).to_vec();
        }
        Ok(request)
    }
}

/// Seeds 1 to N, or from one to another.
fn seeds(text: &str) -> Result<RangeInclusive<u64>, AnyError> {
    Ok(match text.split_once('-') {
        Some((first, last)) => first.parse()?..=last.parse()?,
        None => 1..=text.parse()?,
    })
}

fn main() -> Result<(), AnyError> {
    let Request { noise, seeds, tells_laws, scenes } = Request::of_arguments()?;
    println!("{}", Row::HEADER);
    let mut rows = Vec::new();
    for scene in &scenes {
        for seed in seeds.clone() {
            let row = measured(scene, seed, noise)?;
            println!("{row}");
            if tells_laws {
                row.details.iter().for_each(|law| println!("    {law}"));
            }
            rows.push(row);
        }
    }
    summary::print(&rows);
    Ok(())
}
