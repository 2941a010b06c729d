//! Two bodies that laws of their own explain: whether they are one system.
#![allow(clippy::unwrap_used, reason = "tests")]

use lgs_data::synth;
use lgs_distill::{
    DistillConfig, DistillObserver, LawSearch, Partition, SceneDistillation, Trajectories, distill_objects,
};
use rand::RngExt;
use rand_distr::StandardNormal;

/// Stage 1 of the moving bodies of scenes, seen beside each other with noise in a window.
fn distilled(scenes: &[(&str, u64)]) -> SceneDistillation {
    distilled_before(scenes, &mut ())
}

/// The same before an observer.
fn distilled_before(scenes: &[(&str, u64)], observer: &mut dyn DistillObserver) -> SceneDistillation {
    let times: Vec<f64> = (0..=75).map(|step| 0.01 * f64::from(step)).collect();
    let mut rng = lgs_core::stream(scenes[0].1, "noise", 0);
    let mut positions = vec![Vec::new(); times.len()];
    let mut object = Vec::new();
    for (&(scene, seed), place) in scenes.iter().zip([0.0, 3.0]) {
        let truth = synth::ground_truth(scene, &times, 400, seed).unwrap();
        let first = object.iter().max().map_or(0, |last| last + 1);
        let moving: Vec<usize> = (0..truth.object.len()).filter(|&i| truth.object[i] >= 0).collect();
        object.extend(moving.iter().map(|&i| first + truth.object[i]));
        for (row, points) in positions.iter_mut().zip(&truth.points) {
            let mut noisy = |x: f32| x + 0.002 * rng.sample::<f32, _>(StandardNormal);
            let beside = |&i: &usize| [points[i][0] + place, points[i][1], points[i][2]];
            row.extend(moving.iter().map(|i| beside(i).map(&mut noisy)));
        }
    }
    let seen = Trajectories::unweighted(times.iter().map(|t| *t as f32).collect(), positions);
    let objects = object.iter().max().map_or(0, |last| (last + 1) as usize);
    distill_objects(&seen, Partition { object, objects }, &DistillConfig::default(), 1, observer).unwrap()
}

#[test]
fn bodies_that_pull_each_other_are_one_system_though_laws_of_their_own_explain_them() {
    assert_eq!(distilled(&[("attracting-pair", 5)]).objects.len(), 1);
}

/// Has time for the first search alone; notes what it is asked for.
struct FirstSearch(Vec<(LawSearch, usize)>);

impl DistillObserver for FirstSearch {
    fn has_time_to_seek(&mut self, search: LawSearch, round: usize) -> bool {
        self.0.push((search, round));
        false
    }
}

#[test]
fn without_time_for_pairs_bodies_keep_laws_of_their_own() {
    let mut observer = FirstSearch(Vec::new());
    let found = distilled_before(&[("attracting-pair", 5)], &mut observer);
    assert_eq!(observer.0, [(LawSearch::OfPairs, 1)], "both are explained by the first search");
    assert_eq!(found.objects.len(), 2);
    for (_, distilled) in &found.objects {
        assert!(distilled.report().generalised.is_some(), "a law of the first search");
    }
}

#[test]
fn bodies_that_places_of_their_own_pull_stay_two() {
    for scenes in [
        [("spring", 1), ("spring", 2)],
        [("kepler", 1), ("kepler", 2)],
        [("pendulum", 1), ("torsion-spring", 2)],
    ] {
        assert_eq!(distilled(&scenes).objects.len(), 2, "{scenes:?}");
    }
}
