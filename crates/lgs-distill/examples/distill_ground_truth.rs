//! Stage 1 on ground-truth trajectories, without and with noise: the error at three times the window, as a
//! part of the path.
//!
//! `cargo run --release -p lgs-distill --example distill_ground_truth [-- SCENE …]`

use lgs_data::synth;
use lgs_distill::{DistillConfig, Distilled, Trajectories, distill};
use rand::RngExt;

/// Scenes of one object.
const SCENES: [&str; 17] = [
    "falling-ball",
    "fan",
    "sled",
    "projectile",
    "spring",
    "pendulum",
    "large-pendulum",
    "spun-up-fan",
    "torsion-spring",
    "rolling-ball",
    "top",
    "tumbling",
    "kepler",
    "double-well",
    "quadratic-drag",
    "magnet",
    "led",
];
const PARTICLES: usize = 400;
/// Samples of the window, and steps of the rollout at the same spacing.
const WINDOW: usize = 76;
const STEPS: usize = 225;
const DT: f64 = 0.01;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    println!("{:<14} {:>6} {:>9} {:>8}  law", "scene", "noise", "error", "seconds");
    let mut scenes: Vec<String> = std::env::args().skip(1).collect();
    if scenes.is_empty() {
        scenes = SCENES.map(str::to_owned).to_vec();
    }
    for scene in &scenes {
        let times: Vec<f64> = (0..=STEPS).map(|i| DT * i as f64).collect();
        let truth = synth::ground_truth(scene, &times, PARTICLES, 0)?;
        for noise in [0.0, 0.002, 0.004] {
            let clock = std::time::Instant::now();
            let seen = window(&truth.points, noise);
            let found = distill(&seen, &DistillConfig::default(), 1, &mut |_| {})?;
            let seconds = clock.elapsed().as_secs_f64();
            let error = 100.0 * relative_error(&found, &truth.points);
            println!("{scene:<14} {noise:>6} {error:>8.3}% {seconds:>8.1}  {}", describe(&found));
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

/// Mean position error at the end of the rollout over the mean path.
fn relative_error(found: &Distilled, truth: &[Vec<[f32; 3]>]) -> f64 {
    let states = found.rolled(DT as f32, STEPS);
    let distance = |a: &[[f32; 3]], b: &[[f32; 3]]| -> f64 {
        a.iter().zip(b).map(|(&p, &q)| f64::from(lgs_core::linear::norm(lgs_core::linear::sub(p, q)))).sum()
    };
    let path: f64 = truth.windows(2).map(|pair| distance(&pair[0], &pair[1])).sum();
    distance(&states[STEPS], &truth[STEPS]) / path
}

/// The terms found.
fn describe(found: &Distilled) -> String {
    let report = found.report();
    if let Some(found) = &report.generalised {
        let terms: Vec<&str> = found.law.terms.iter().map(|term| term.kind.name()).collect();
        let (name, verdict) = (found.law.coordinates.name(), found.known.verdict);
        return format!("{name}: {}; {verdict:?}, χ² {:.2}", terms.join(" + "), found.known.chi_square);
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
