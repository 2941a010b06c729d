//! A scene in other units, or elsewhere, has the same objects and laws.

use lgs_distill::{
    DistillConfig, Distilled, PartitionConfig, SceneDistillation, Trajectories, distill_objects, find_objects,
};
use lgs_mechanics::Law;
use rand_distr::{Distribution, StandardNormal};

const STEPS: usize = 90;
const DT: f32 = 0.015;
/// Length of the window in steps.
const WINDOW: usize = 50;

fn lattice([x, y, z]: [f64; 3], n: usize) -> Vec<[f64; 3]> {
    let at = |i: usize| (i as f64 - 0.5 * (n - 1) as f64) * 0.06;
    (0..n * n * n).map(|k| [x + at(k % n), y + at(k / n % n), z + at(k / n / n)]).collect()
}

/// A floor, a block that is thrown, and one that moves little and slowly and is slowed down.
fn scene(t: f64) -> Vec<[f64; 3]> {
    let mut all = lattice([0.0, 0.0, -1.5], 6);
    let thrown = [0.7 * t, 0.2 * t, 0.8 * t - 0.6 * t * t];
    let slow = [0.12 * (1.0 - (-1.5 * t).exp()), 0.0, 0.0];
    for (block, by) in [(lattice([-0.8, 0.0, 0.0], 5), thrown), (lattice([0.8, 0.4, 0.0], 4), slow)] {
        all.extend(block.into_iter().map(|p| [p[0] + by[0], p[1] + by[1], p[2] + by[2]]));
    }
    all
}

/// The scene with noise in other units, shifted, and what is found of it. The lengths that images resolve are
/// in the same units.
fn found(scale: f64, shift: f64) -> SceneDistillation {
    let mut rng = lgs_core::stream(11, "noise", 0);
    let mut seen = |x: f64| {
        let noise: f64 = StandardNormal.sample(&mut rng);
        (scale * (x + 0.001 * noise) + shift) as f32
    };
    let times: Vec<f32> = (0..=WINDOW).map(|i| DT * i as f32).collect();
    let positions =
        times.iter().map(|&t| scene(f64::from(t)).into_iter().map(|p| p.map(&mut seen)).collect());
    let trajectories = Trajectories::unweighted(times.clone(), positions.collect());
    let config = DistillConfig::default();
    let config = DistillConfig { forecast_tolerance: scale as f32 * config.forecast_tolerance, ..config };
    let objects = PartitionConfig::default();
    let objects = PartitionConfig {
        static_displacement: scale as f32 * objects.static_displacement,
        length_slack: scale as f32 * objects.length_slack,
        ..objects
    };
    let partition = find_objects(&trajectories, &objects).expect("objects");
    distill_objects(&trajectories, partition, &config, 1, &mut ()).expect("laws")
}

fn law(object: &Distilled) -> &Law {
    &object.report().generalised.as_ref().expect("a law").law
}

/// Largest error of the positions after two windows, in the units of the first scene.
fn error(found: &SceneDistillation, scale: f64, shift: f64) -> f64 {
    let truth = scene(f64::from(DT) * STEPS as f64);
    let of_object = |(members, object): &(Vec<usize>, Distilled)| {
        let last = object.rolled(DT, STEPS).pop().expect("a rollout");
        let of_particle = |(&i, q): (&usize, [f32; 3])| {
            (0..3).map(|c| ((f64::from(q[c]) - shift) / scale - truth[i][c]).abs()).fold(0.0, f64::max)
        };
        members.iter().zip(last).map(of_particle).fold(0.0, f64::max)
    };
    found.objects.iter().map(of_object).fold(0.0, f64::max)
}

#[test]
fn units_and_place_change_neither_objects_nor_laws() {
    let first = found(1.0, 0.0);
    assert_eq!(first.objects.len(), 2);
    assert!(error(&first, 1.0, 0.0) < 0.02, "{}", error(&first, 1.0, 0.0));
    for (scale, shift) in [(0.01, 0.02), (100.0, -300.0)] {
        let other = found(scale, shift);
        assert_eq!(other.partition, first.partition, "scale {scale}");
        let error = error(&other, scale, shift);
        assert!(error < 0.02, "scale {scale}: {error}");
        for ((_, a), (_, b)) in first.objects.iter().zip(&other.objects) {
            let (a, b) = (law(a), law(b));
            assert_eq!((&a.terms, a.coordinates.name()), (&b.terms, b.coordinates.name()), "scale {scale}");
            let sizes = a.table().into_iter().zip(a.parameters.iter().zip(&b.parameters));
            for ((parameter, _), (a, b)) in sizes {
                let expected = a * scale.powf(parameter.unit.length);
                let slack = 0.02 * (a.abs() + 1.0) * scale.powf(parameter.unit.length);
                assert!(
                    (b - expected).abs() < slack,
                    "{}: {b} for {expected}, scale {scale}",
                    parameter.name
                );
            }
        }
    }
}
