//! Stage 1 on ground-truth trajectories with noise, object by object of the truth: errors at the end of the
//! whole recording and at three times the window, as parts of the path.
//!
//! `cargo run --release -p lgs-distill --example distill_ground_truth [-- [--noise X] [--seeds N] SCENE …]`

use lgs_data::synth::{self, GroundTruth};
use lgs_distill::{DistillConfig, Distilled, Partition, SceneDistillation, Trajectories, distill_objects};
use rand::RngExt;

/// Scenes whose objects are known.
const SCENES: [&str; 20] = [
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
    "led",
];
const PARTICLES: usize = 400;
/// Samples of the window, and steps of the rollout at the same spacing.
const WINDOW: usize = 76;
const STEPS: usize = 225;
/// Step at t = 1, the end of the whole recording.
const RECORDED: usize = 100;
const DT: f64 = 0.01;

type AnyError = Box<dyn std::error::Error>;

/// What is asked for.
struct Request {
    noise: f32,
    seeds: u64,
    scenes: Vec<String>,
}

impl Request {
    fn of_arguments() -> Result<Self, AnyError> {
        let mut request = Self { noise: 0.002, seeds: 3, scenes: Vec::new() };
        let mut arguments = std::env::args().skip(1);
        while let Some(argument) = arguments.next() {
            match argument.as_str() {
                "--noise" => request.noise = arguments.next().ok_or("--noise NOISE")?.parse()?,
                "--seeds" => request.seeds = arguments.next().ok_or("--seeds N")?.parse()?,
                _ => request.scenes.push(argument),
            }
        }
        if request.scenes.is_empty() {
            request.scenes = SCENES.map(str::to_owned).to_vec();
        }
        Ok(request)
    }
}

fn main() -> Result<(), AnyError> {
    let Request { noise, seeds, scenes } = Request::of_arguments()?;
    println!("{:<16} {:>4} {:>8} {:>9} {:>8}  law", "scene", "seed", "t = 1", "t = 2.25", "seconds");
    let times: Vec<f64> = (0..=STEPS).map(|i| DT * i as f64).collect();
    for scene in &scenes {
        for seed in 1..=seeds {
            let truth = synth::ground_truth(scene, &times, PARTICLES, seed)?;
            let clock = std::time::Instant::now();
            let seen = window(&truth.points, noise);
            let objects = truth.object.iter().max().map_or(0, |last| (last + 1) as usize);
            let partition = Partition { object: truth.object.clone(), objects };
            let found = distill_objects(&seen, partition, &DistillConfig::default(), 1, &mut |_, _, _| {})?;
            let seconds = clock.elapsed().as_secs_f64();
            let [recorded, last] = [RECORDED, STEPS].map(|step| 100.0 * relative_error(&found, &truth, step));
            let laws: Vec<String> = found.objects.iter().map(|(_, object)| describe(object)).collect();
            let laws = laws.join(" | ");
            println!("{scene:<16} {seed:>4} {recorded:>7.3}% {last:>8.3}% {seconds:>8.1}  {laws}");
        }
    }
    Ok(())
}

/// The samples of the window with independent normal noise.
fn window(points: &[Vec<[f32; 3]>], noise: f32) -> Trajectories {
    let mut rng = lgs_core::stream(7, "noise", 0);
    let mut normal = || -> f32 { rng.sample(rand_distr::StandardNormal) };
    let times = (0..WINDOW).map(|i| (DT * i as f64) as f32).collect();
    let positions = points[..WINDOW]
        .iter()
        .map(|row| row.iter().map(|p| p.map(|x| x + noise * normal())).collect())
        .collect();
    Trajectories::unweighted(times, positions)
}

/// Mean position error at a step of the rollout over the mean path until then, over all objects.
fn relative_error(found: &SceneDistillation, truth: &GroundTruth, step: usize) -> f64 {
    let (mut error, mut path) = (0.0, 0.0);
    for (members, object) in &found.objects {
        let at = |step: usize| -> Vec<[f32; 3]> { members.iter().map(|&i| truth.points[step][i]).collect() };
        path += (0..step).map(|step| distance(&at(step), &at(step + 1))).sum::<f64>();
        error += object.rolled(DT as f32, step).get(step).map_or(f64::NAN, |last| distance(last, &at(step)));
    }
    error / path
}

/// Sum of distances.
fn distance(a: &[[f32; 3]], b: &[[f32; 3]]) -> f64 {
    let apart = |(&p, &q): (&[f32; 3], &[f32; 3])| lgs_core::linear::norm(lgs_core::linear::sub(p, q));
    a.iter().zip(b).map(|pair| f64::from(apart(pair))).sum()
}

/// The terms found.
fn describe(found: &Distilled) -> String {
    let report = found.report();
    if let Some(found) = &report.generalised {
        let terms: Vec<&str> = found.law.terms.iter().map(|term| term.kind.name()).collect();
        let (name, known) = (found.law.coordinates.name(), &found.known);
        let (terms, verdict, until) = (terms.join(" + "), known.verdict, known.trusted[1]);
        return format!("{name}: {terms}; {verdict:?} until {until:.2}, χ² {:.2}", known.chi_square);
    }
    let Some(terms) = report.terms else { return "networks".into() };
    let mut words = vec![format!("{:?}", report.paths)];
    words.extend(terms.gravity.then(|| "field".into()));
    words.push(format!("stiffness {:?}", terms.stiffness));
    words.extend(terms.damping.then(|| "damping".into()));
    words.extend(terms.gyration.then(|| "gyration".into()));
    words.extend(report.rigid_constraint.then(|| "rigid constraint".into()));
    words.extend(report.networks.then(|| "networks".into()));
    words.join(", ")
}
