//! Motions as one meets them every day: laws of several terms, friction that stops a body, bodies whose
//! particles are not centred on their mass; and that no law is trusted that runs away.
#![allow(clippy::unwrap_used, reason = "tests")]

use lgs_core::geometry::wide;
use lgs_data::synth::{self, GroundTruth};
use lgs_distill::{DistillConfig, Distilled, DistilledLaw, Partition, Trajectories, distill_objects};
use lgs_dynamics::ForceKind;
use lgs_mechanics::bands::Verdict;
use rand::RngExt;
use rand_distr::StandardNormal;

const DT: f64 = 0.0125;
const WINDOW: usize = 61;
const STEPS: usize = 180;

/// Tracks of a scene with noise, as its window shows them, beside the truth.
struct Seen {
    truth: GroundTruth,
    window: Trajectories,
}

impl Seen {
    fn of(scene: &str, seed: u64) -> Self {
        let times: Vec<f64> = (0..=STEPS).map(|step| DT * step as f64).collect();
        let truth = synth::ground_truth(scene, &times, 200, seed).unwrap();
        let mut rng = lgs_core::stream(seed, "noise", 0);
        let mut noisy = |x: f32| x + 0.002 * rng.sample::<f32, _>(StandardNormal);
        let mut row = |points: &Vec<[f32; 3]>| points.iter().map(|p| p.map(&mut noisy)).collect();
        let positions = truth.points[..WINDOW].iter().map(&mut row).collect();
        let window = Trajectories::unweighted(times[..WINDOW].iter().map(|t| *t as f32).collect(), positions);
        Self { truth, window }
    }

    /// Without what is at rest.
    fn alone(mut self) -> Self {
        let moving: Vec<usize> =
            (0..self.truth.object.len()).filter(|&i| self.truth.object[i] >= 0).collect();
        self.window = self.window.select(&moving);
        self.truth.points =
            self.truth.points.iter().map(|row| moving.iter().map(|&i| row[i]).collect()).collect();
        self.truth.object = vec![0; moving.len()];
        self
    }

    fn law(&self, config: &DistillConfig) -> DistilledLaw {
        let partition = Partition { object: self.truth.object.clone(), objects: 1 };
        let found = distill_objects(&self.window, partition, config, 1, &mut ()).unwrap();
        let Distilled::Generalised(law) = &found.objects[0].1 else { panic!("a law") };
        (**law).clone()
    }

    /// Mean distance from the truth at the last time.
    fn error(&self, law: &DistilledLaw) -> f64 {
        let last = Distilled::Generalised(Box::new(law.clone())).rolled(DT as f32, STEPS).pop().unwrap();
        let moving = (0..self.truth.object.len()).filter(|&i| self.truth.object[i] >= 0);
        let pairs = last.iter().zip(moving.map(|i| self.truth.points[STEPS][i]));
        pairs.map(|(&found, truth)| wide(found).distance(wide(truth))).sum::<f64>() / last.len() as f64
    }
}

fn terms(law: &DistilledLaw) -> Vec<&'static str> {
    law.law.terms.iter().map(|term| term.kind.name()).collect()
}

#[test]
fn a_block_on_a_floor_is_stopped_by_friction() {
    let seen = Seen::of("sliding-block", 1);
    let law = seen.law(&DistillConfig::default());
    assert_eq!((terms(&law), law.known.verdict), (vec!["dry-friction"], Verdict::Explained));
    assert!(seen.error(&law) < 0.01, "{}", seen.error(&law));
}

#[test]
fn without_a_floor_it_may_come_back_as_well() {
    let law = Seen::of("sliding-block", 1).alone().law(&DistillConfig::default());
    let rivals: Vec<&str> = law.known.rivals.iter().map(|rival| rival.terms.as_str()).collect();
    assert!(rivals.contains(&"dry-friction") && rivals.contains(&"uniform-field"), "{rivals:?}");
    let last = law.known.band.radius.last().copied().flatten().unwrap_or(f64::INFINITY);
    assert!(last > 0.2 && law.known.trusted[1] < 1.6, "{:?}", law.known);
}

#[test]
fn laws_of_several_terms_are_found_where_no_simple_one_explains() {
    for (scene, expected) in [
        ("damped-springs", ["spring-positive", "linear-drag"]),
        ("elastic-pendulum", ["uniform-field", "spring-length"]),
        ("magnetic-trap", ["spring", "gyroscopic"]),
    ] {
        let seen = Seen::of(scene, 1);
        let law = seen.law(&DistillConfig::default());
        assert_eq!((terms(&law), law.known.verdict), (expected.to_vec(), Verdict::Explained), "{scene}");
        assert!(seen.error(&law) < 0.1, "{scene}: {}", seen.error(&law));
    }
}

#[test]
fn what_unwinds_rolls_and_what_spirals_is_damped() {
    for (scene, seed, expected, coordinates) in [
        ("yo-yo", 1, vec!["uniform-field"], "rolling"),
        ("magnetic-spiral", 1, vec!["gyroscopic", "linear-drag"], "point"),
    ] {
        let seen = Seen::of(scene, seed);
        let law = seen.law(&DistillConfig::default());
        assert_eq!((terms(&law), law.law.coordinates.name()), (expected, coordinates), "{scene}");
        assert!(seen.error(&law) < 0.05, "{scene}: {}", seen.error(&law));
    }
}

#[test]
fn a_body_that_vibrates_in_flight_falls_as_it_vibrates() {
    let seen = Seen::of("falling-jelly", 1);
    let law = seen.law(&DistillConfig::default());
    let expected = vec!["uniform-field", "spring-diagonal", "damping-diagonal"];
    assert_eq!((terms(&law), law.known.verdict), (expected, Verdict::Explained));
    assert!(seen.error(&law) < 0.05, "{}", seen.error(&law));
}

#[test]
fn a_law_that_runs_away_is_not_trusted_beyond_the_window() {
    let seen = Seen::of("magnetic-trap", 1);
    let law = seen.law(&DistillConfig { force: ForceKind::None, ..DistillConfig::default() });
    assert_ne!(law.known.verdict, Verdict::Explained, "{:?}", law.known);
    assert!(law.known.trusted[1] <= 0.7501, "{:?}", law.known.trusted);
}

#[test]
fn a_ball_that_spins_about_no_centre_of_its_points_flies_on() {
    let seen = Seen::of("spinning-ball", 1);
    let law = seen.law(&DistillConfig::default());
    assert_eq!((terms(&law)[0], law.known.verdict), ("uniform-field", Verdict::Explained));
    assert!(!terms(&law).contains(&"gyroscopic") && seen.error(&law) < 0.05, "{}", seen.error(&law));
}
