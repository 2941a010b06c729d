//! Who looks at training changes nothing in its result.

#[path = "common/tiny.rs"]
mod tiny;

use std::path::Path;
use std::sync::atomic::AtomicBool;

use lgs_data::dataset::Dataset;
use lgs_train::{Control, DeviceName, Glance, Onlooker, Preset, RunFolder, TrainConfig, train};
use tiny::falling_ball;

/// Looks at the models after every step.
#[derive(Default)]
struct Curious {
    sources: usize,
    scenes: usize,
}

impl Onlooker for Curious {
    fn wants(&mut self) -> bool {
        true
    }

    fn show(&mut self, glance: Glance) {
        let gaussians = match glance {
            Glance::Source(source) => {
                self.sources += 1;
                source.cloud_at(0.3).len()
            }
            Glance::Scene(scene) => {
                self.scenes += 1;
                scene.len()
            }
        };
        assert!(gaussians > 0);
    }
}

/// Trains for seconds; returns the scene's file and the curve.
fn trained(folder: &Path, dataset: &Dataset, onlooker: Option<&mut Curious>) -> [Vec<u8>; 2] {
    let settings = [
        "source.iterations=60",
        "source.warmup_iterations=20",
        "source.initial_gaussians=400",
        "distill.matching.steps=10",
        "distill.rollout.steps=2",
        "refine_gaussians.iterations=3",
        "tune_gaussians.iterations=6",
    ]
    .map(str::to_owned);
    let config = TrainConfig::resolve(Preset::Quick, None, &settings).expect("settings");
    let run = RunFolder::create(folder, &config, dataset).expect("a run");
    let stop = AtomicBool::new(false);
    let onlookers = onlooker.into_iter().map(|curious| curious as &mut dyn Onlooker).collect();
    let mut progress = |_| {};
    let mut control = Control { stop: &stop, progress: &mut progress, onlookers };
    train(&run, dataset, &config, &DeviceName::Cpu.device(), &mut control).expect("trained");
    ["lagrangian.safetensors", "events.jsonl"].map(|name| std::fs::read(folder.join(name)).expect(name))
}

#[test]
fn a_run_that_is_looked_at_has_the_bytes_of_one_that_is_not() {
    let folder = tempfile::tempdir().expect("folder");
    let dataset = falling_ball(folder.path(), 24, 3);
    let mut curious = Curious::default();
    let seen = trained(&folder.path().join("seen"), &dataset, Some(&mut curious));
    let unseen = trained(&folder.path().join("unseen"), &dataset, None);
    assert!(curious.sources > 0 && curious.scenes > 0, "{} {}", curious.sources, curious.scenes);
    assert!(seen == unseen);
}
