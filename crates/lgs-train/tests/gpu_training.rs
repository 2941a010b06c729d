//! Training on a device of Vulkan, Metal or DX12 (feature `gpu`): what a step reads back, the memory that it
//! asks the driver for, and its bytes.
//!
//! Read-backs are counted where they happen, in the calls that the driver's library logs.
#![cfg(feature = "gpu")]

#[path = "common/tiny.rs"]
mod tiny;

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use burn::tensor::Device;
use lgs_data::dataset::Dataset;
use lgs_model::source::SourceKind;
use lgs_tensor::cube::{device_for_tests, reserved_bytes};
use lgs_train::cameras::RefinedCamera;
use lgs_train::{Control, Preset, Progress, RunFolder, Stage, TrainConfig, train};
use tempfile::TempDir;
use tiny::falling_ball;

/// Read-backs so far.
static READS: AtomicUsize = AtomicUsize::new(0);

/// Counts what the driver's library logs.
struct Counter;

impl log::Log for Counter {
    fn enabled(&self, metadata: &log::Metadata<'_>) -> bool {
        metadata.target().starts_with("wgpu_core")
    }

    fn log(&self, record: &log::Record<'_>) {
        if !self.enabled(record.metadata()) {
            return;
        }
        if record.args().to_string().starts_with("Buffer::map_async") {
            READS.fetch_add(1, Ordering::SeqCst);
        }
    }

    fn flush(&self) {}
}

/// A device, for one test at a time: the counts are those of the process.
fn counted() -> Option<(Device, std::sync::MutexGuard<'static, ()>)> {
    static ALONE: Mutex<()> = Mutex::new(());
    let alone = ALONE.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    if log::set_logger(&Counter).is_ok() {
        log::set_max_level(log::LevelFilter::Trace);
    }
    device_for_tests().map(|device| (device, alone))
}

fn config(kind: SourceKind, iterations: usize, more: &[&str]) -> TrainConfig {
    let settings = [
        format!("source.kind={}", kind.name()),
        format!("source.iterations={iterations}"),
        // None by the clock.
        "checkpoint_secs=100000".to_owned(),
        "source.stretch=1".to_owned(),
        "source.warmup_iterations=20".to_owned(),
        "source.initial_gaussians=300".to_owned(),
        "source.densify.after=10".to_owned(),
        "source.densify.before=70".to_owned(),
        "source.densify.interval=30".to_owned(),
        "source.densify.max_gaussians=400".to_owned(),
        "source.shading.times=4".to_owned(),
        "source.shading.after=40".to_owned(),
        "source.shading.trial=0".to_owned(),
        "fit_dynamics.steps=1".to_owned(),
        "fit_dynamics.frames=4".to_owned(),
        "refine_gaussians.iterations=24".to_owned(),
        "refine_gaussians.refresh_every=8".to_owned(),
        "tune_gaussians.iterations=4".to_owned(),
    ];
    let own = ["source.nodes.initial=12", "source.nodes.most=16", "source.nodes.interval=60"];
    let own = own.into_iter().filter(|_| kind == SourceKind::Nodes).map(str::to_owned);
    let more = more.iter().map(|setting| (*setting).to_owned());
    let settings: Vec<String> = settings.into_iter().chain(own).chain(more).collect();
    TrainConfig::resolve(Preset::Quick, None, &settings).expect("config")
}

/// What a step did.
#[derive(Clone, Copy, Debug)]
struct Count {
    reads: usize,
    /// Bytes of memory that the device has set aside after it.
    reserved: u64,
}

/// Trains; gives what every step did, by stage.
fn trained(
    folder: &Path,
    dataset: &Dataset,
    config: &TrainConfig,
    device: &Device,
) -> BTreeMap<&'static str, Vec<Count>> {
    let run = RunFolder::create(folder, config, dataset).expect("a folder");
    let mut counts: BTreeMap<&'static str, Vec<Count>> = BTreeMap::new();
    let mut progress = |p: Progress| {
        let reads = READS.swap(0, Ordering::SeqCst);
        let count = Count { reads, reserved: reserved_bytes(device) };
        counts.entry(p.stage.name()).or_default().push(count);
    };
    let stop = AtomicBool::new(false);
    train(&run, dataset, config, device, &mut Control::new(&stop, &mut progress)).expect("trained");
    counts
}

/// Steps, from 1, that read something back.
fn readers(counts: &[Count]) -> Vec<usize> {
    (1..).zip(counts).filter(|(_, count)| count.reads > 0).map(|(step, _)| step).collect()
}

/// Source training reads figures every ten steps, and Gaussians where their number or the nodes change. Gives
/// the folder with the `run`, where there is a device.
fn reads_nothing_in_a_step(kind: SourceKind, more: &[&str]) -> Option<TempDir> {
    let (device, _alone) = counted()?;
    let folder = tempfile::tempdir().expect("a folder");
    let dataset = falling_ball(folder.path(), 32, 4);
    let counts = trained(&folder.path().join("run"), &dataset, &config(kind, 130, more), &device);
    let source = &counts[Stage::Source.name()];
    // Behind the last densification and the last choice of nodes.
    let late: Vec<usize> = readers(source).into_iter().filter(|&step| step > 80).collect();
    assert_eq!(late, [90, 100, 110, 120, 130], "{}: steps that read", kind.name());
    assert!(source[80..].iter().all(|count| count.reads <= 2), "figures and room alone: {source:?}");
    let late: Vec<u64> = source[90..].iter().map(|count| count.reserved).collect();
    assert!(late.iter().all(|bytes| *bytes == late[0]), "{}: memory in 40 steps: {late:?}", kind.name());
    let refined = readers(&counts[Stage::RefineGaussians.name()]);
    assert!(refined.iter().all(|step| [1, 9, 10, 17, 20, 24].contains(step)), "{refined:?}");
    Some(folder)
}

#[test]
fn steps_of_a_deformation_network_read_nothing_back() {
    drop(reads_nothing_in_a_step(SourceKind::Defgs, &[]));
}

#[test]
fn steps_of_control_nodes_read_nothing_back() {
    drop(reads_nothing_in_a_step(SourceKind::Nodes, &[]));
}

#[test]
fn steps_of_relocation_read_nothing_back() {
    drop(reads_nothing_in_a_step(SourceKind::Defgs, &["source.densify.method=mcmc"]));
}

#[test]
fn steps_that_refine_poses_read_nothing_back() {
    let settings = ["source.cameras.refine_poses=on", "source.cameras.pose_after=0"];
    let Some(folder) = reads_nothing_in_a_step(SourceKind::Defgs, &settings) else { return };
    let (run, _) = RunFolder::open(&folder.path().join("run")).expect("a run");
    let refined = run.refined_cameras().expect("a file").expect("cameras");
    let moved = |camera: &RefinedCamera| camera.motion.iter().any(|v| *v != 0.0);
    assert!(refined.cameras.iter().all(moved), "{refined:?}");
}

#[test]
fn steps_of_the_papers_networks_read_nothing_back() {
    let Some((device, _alone)) = counted() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let dataset = falling_ball(folder.path(), 24, 3);
    let settings = [
        "distill.dynamics=networks",
        "distill.matching.steps=10",
        "distill.rollout.steps=2",
        "source.iterations=40",
        "source.warmup_iterations=20",
        "source.initial_gaussians=400",
        "refine_gaussians.iterations=1",
        "tune_gaussians.iterations=1",
        "tune_dynamics.iterations=25",
        "tune_dynamics.refresh_every=8",
    ];
    let settings = settings.map(str::to_owned);
    let config = TrainConfig::resolve(Preset::Quick, None, &settings).expect("config");
    let counts = trained(&folder.path().join("run"), &dataset, &config, &device);
    let tuned = &counts[Stage::TuneDynamics.name()];
    assert_eq!(tuned.len(), 25);
    // Figures come every ten steps, and the motion is rolled anew every eight.
    let readers = readers(tuned);
    assert!(readers.iter().all(|step| [1, 9, 10, 17, 20, 25].contains(step)), "{readers:?}");
}

#[test]
fn two_hundred_steps_have_the_same_bytes_twice() {
    let Some((device, _alone)) = counted() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let dataset = falling_ball(folder.path(), 32, 4);
    for (kind, steps) in [(SourceKind::Defgs, 200), (SourceKind::Nodes, 80)] {
        let runs = ["one", "two"].map(|name| folder.path().join(format!("{}-{name}", kind.name())));
        let config = config(kind, steps, &[]);
        runs.iter().for_each(|run| drop(trained(run, &dataset, &config, &device)));
        let source = format!("source/{}.safetensors", kind.name());
        for file in ["lagrangian.safetensors", &source, "events.jsonl"] {
            let [one, two] = runs.each_ref().map(|run| std::fs::read(run.join(file)).expect("a result"));
            assert!(one == two, "{}: {file} differs", kind.name());
        }
    }
}
