//! Static/moving split and objects.

use lgs_data::synth;
use lgs_distill::{
    DistillConfig, DistillObserver, Partition, PartitionConfig, PartitionMethod, SceneDistillation,
    Trajectories, distill_objects, find_objects, partition,
};
use rand_distr::{Distribution, Normal};

fn sampled(points: impl Fn(f32) -> Vec<[f32; 3]>) -> Trajectories {
    let times: Vec<f32> = (0..76).map(|i| 0.01 * i as f32).collect();
    Trajectories::unweighted(times.clone(), times.iter().map(|&t| points(t)).collect())
}

fn lattice(center: [f32; 3], n: usize, spacing: f32) -> Vec<[f32; 3]> {
    let at = |i: usize| (i as f32 - 0.5 * (n - 1) as f32) * spacing;
    (0..n * n * n)
        .map(|k| [center[0] + at(k % n), center[1] + at(k / n % n), center[2] + at(k / n / n)])
        .collect()
}

fn noisy(mut trajectories: Trajectories, deviation: f32) -> Trajectories {
    let mut rng = lgs_core::stream(5, "noise", 0);
    let normal = Normal::new(0.0, deviation).expect("a standard deviation");
    trajectories.positions.iter_mut().flatten().flatten().for_each(|x| *x += normal.sample(&mut rng));
    trajectories
}

/// A wall, a block that slides along it, a block that touches the first one and moves the other way, and a
/// few outliers.
fn touching() -> Trajectories {
    sampled(|t| {
        let mut all = lattice([0.0, 0.0, -1.0], 6, 0.1);
        all.extend(lattice([0.0, 0.0, 0.0], 7, 0.05).into_iter().map(|[x, y, z]| [x + 0.4 * t, y, z]));
        all.extend(
            lattice([0.0, 0.0, 0.35], 6, 0.05).into_iter().map(|[x, y, z]| [x - 0.4 * t, y + 0.2 * t, z]),
        );
        all.extend((0..5).map(|i| [0.3, 0.1 * i as f32, -0.3 - 0.5 * t]));
        all
    })
}

/// Has no time for another round.
struct OneRound;

impl DistillObserver for OneRound {
    fn has_time_for(&mut self, _round: usize) -> bool {
        false
    }
}

/// Stage 1, with as many rounds as it asks for or with one.
fn distilled(
    trajectories: &Trajectories,
    partition: Partition,
    config: &DistillConfig,
    has_time: bool,
) -> SceneDistillation {
    let observer: &mut dyn DistillObserver = if has_time { &mut () } else { &mut OneRound };
    distill_objects(trajectories, partition, config, 1, observer).expect("systems")
}

/// Objects and their systems, with default settings.
fn distilled_scene(trajectories: &Trajectories) -> SceneDistillation {
    let partition = find_objects(trajectories, &PartitionConfig::default()).expect("objects");
    distilled(trajectories, partition, &DistillConfig::default(), true)
}

#[test]
fn touching_bodies_part_and_outliers_join_the_nearest() {
    for deviation in [0.0, 0.001] {
        let found = partition(&noisy(touching(), deviation), &PartitionConfig::default()).unwrap();
        assert_eq!(found.objects, 2, "noise {deviation}");
        assert!(found.object[..216].iter().all(|&o| o == -1), "the wall stands, noise {deviation}");
        assert!(found.object[216..216 + 343].iter().all(|&o| o == 0));
        assert!(found.object[216 + 343..216 + 343 + 216].iter().all(|&o| o == 1));
        assert!(found.object[216 + 343 + 216..].iter().all(|&o| o == 0));
        assert_eq!(found.moving(), 343 + 216 + 5);
    }
}

#[test]
fn the_room_has_moving_objects() {
    let times: Vec<f64> = (0..76).map(|i| 0.01 * f64::from(i)).collect();
    let truth = synth::ground_truth("room", &times, 600, 0).unwrap();
    let trajectories = Trajectories::unweighted(truth.times.clone(), truth.points.clone());
    let found = partition(&noisy(trajectories, 0.001), &PartitionConfig::default()).unwrap();
    // The hub of the turntable hardly moves, so that some of its points count as static.
    let moving =
        truth.object.iter().zip(&found.object).filter(|&(&truth, &found)| truth >= 0 && found >= 0).count();
    assert!(moving as f32 > 0.9 * truth.object.iter().filter(|&&o| o >= 0).count() as f32);
    let wrong =
        truth.object.iter().zip(&found.object).filter(|&(&truth, &found)| truth < 0 && found >= 0).count();
    assert_eq!(wrong, 0, "static points that move");
    for object in 0..found.objects {
        let mut names: Vec<i32> = found.members(object).iter().map(|&i| truth.object[i]).collect();
        names.dedup();
        assert_eq!(names.len(), 1, "object {object} mixes bodies");
    }
}

#[test]
fn a_scene_without_motion_has_no_objects() {
    let still = sampled(|_| lattice([0.0; 3], 5, 0.1));
    let found = distilled_scene(&noisy(still, 0.001));
    assert_eq!((found.partition.objects, found.objects.len()), (0, 0));
}

#[test]
fn every_object_of_a_scene_gets_its_own_system() {
    let found = distilled_scene(&touching());
    assert_eq!(found.objects.len(), 2);
    for (members, distilled) in &found.objects {
        assert_eq!(members.len(), distilled.q0().len());
        assert!(distilled.v0().iter().all(|v| (v[0].abs() - 0.4).abs() < 0.02), "{:?}", &distilled.v0()[..3]);
    }
}

#[test]
fn configurations_read_back_and_reject_unknown_fields() {
    let text = serde_json::to_string(&DistillConfig::default()).unwrap();
    assert_eq!(serde_json::from_str::<DistillConfig>(&text).unwrap(), DistillConfig::default());
    let text = serde_json::to_string(&PartitionConfig::default()).unwrap();
    assert_eq!(serde_json::from_str::<PartitionConfig>(&text).unwrap(), PartitionConfig::default());
    assert!(serde_json::from_str::<DistillConfig>(r#"{"hiden": 3}"#).is_err());
    assert!(serde_json::from_str::<DistillConfig>(r#"{"hidden": 48}"#).is_ok());
}

#[test]
fn k_means_with_the_right_count_parts_the_same_bodies() {
    let config =
        PartitionConfig { method: PartitionMethod::KMeans, clusters: 2, ..PartitionConfig::default() };
    let found = partition(&noisy(touching(), 0.001), &config).unwrap();
    assert_eq!(found.objects, 2);
    assert!(found.object[..216].iter().all(|&o| o == -1), "the wall stands");
    for bodies in [216..216 + 343, 216 + 343..216 + 343 + 216] {
        let first = found.object[bodies.start];
        assert!(first >= 0 && found.object[bodies.clone()].iter().all(|&o| o == first), "{bodies:?}");
    }
    let one = partition(&touching(), &PartitionConfig { clusters: 1, ..config }).unwrap();
    assert_eq!((one.objects, one.moving()), (1, 343 + 216 + 5));
}

/// A block slides; of what is taken for a second object a part slides with it, and the rest trembles, every
/// particle by itself.
#[test]
fn an_object_that_no_system_follows_loses_what_others_explain() {
    let seen = sampled(|t| {
        let mut all: Vec<_> =
            lattice([0.0; 3], 7, 0.05).into_iter().map(|[x, y, z]| [x + 0.4 * t, y, z]).collect();
        let tremble = |i: usize, p: [f32; 3]| [p[0], p[1], p[2] + 0.1 * (9.0 * t + 2.4 * i as f32).sin()];
        all.extend(lattice([0.5, 0.0, 0.0], 5, 0.05).into_iter().enumerate().map(|(i, p)| tremble(i, p)));
        all
    });
    let object = (0..343 + 125).map(|i| i32::from(i >= 300)).collect();
    let mut config = DistillConfig::default();
    (config.matching.steps, config.rollout.steps) = (60, 6);
    let partition = Partition { object, objects: 2 };
    let found = distilled(&seen, partition.clone(), &config, true);
    assert_eq!((found.partition.objects, found.objects.len()), (2, 2));
    assert!(found.partition.object[..343].iter().all(|&o| o == 0), "what slides joins the block");
    assert!(found.partition.object[343..].iter().all(|&o| o == 1), "what trembles stays an object");
    let in_one_round = distilled(&seen, partition.clone(), &config, false);
    assert_eq!(in_one_round.partition, partition, "there is no time for another round");
}

#[test]
fn a_part_that_a_source_follows_badly_belongs_to_its_body() {
    // Half of a block slips along as it slides; or it slips by itself, the same way, while the block stands
    // nearly still.
    let found = |speed: f32| {
        let seen = sampled(|t| {
            let slides = |[x, y, z]: [f32; 3], by: f32| [x + by, y, z];
            let mut all: Vec<_> =
                lattice([0.0; 3], 6, 0.05).into_iter().map(|p| slides(p, speed * t)).collect();
            let slip = 0.4 * t + 0.05 * (14.0 * t).sin();
            all.extend(lattice([0.0, 0.4, 0.0], 5, 0.05).into_iter().map(|p| slides(p, slip)));
            all
        });
        let object = (0..216 + 125).map(|i| i32::from(i >= 216)).collect();
        let mut config = DistillConfig { remainder_threshold: 10.0, ..DistillConfig::default() };
        (config.matching.steps, config.rollout.steps) = (60, 6);
        let partition = Partition { object, objects: 2 };
        distilled(&seen, partition, &config, true).partition.objects
    };
    assert_eq!(found(0.4), 1);
    assert_eq!(found(0.05), 2);
}
