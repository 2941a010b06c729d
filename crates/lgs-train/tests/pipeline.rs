//! The whole of training on a tiny scene: it learns, it resumes bit for bit from every stage, and threads do
//! not change a byte.

#[path = "common/kinds.rs"]
mod kinds;
#[path = "common/tiny.rs"]
mod tiny;

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

use kinds::own_settings;
use lgs_data::dataset::{Dataset, LoadOptions};
use lgs_model::source::{SourceKind, load_source};
use lgs_train::schedule::read_schedule;
use lgs_train::source::SourceTrainer;
use lgs_train::{
    Control, DeviceName, Preset, Progress, RunFolder, Stage, TrainConfig, TrainError, Trained, Trainer, train,
};
use tiny::falling_ball;

fn tiny_config(kind: SourceKind) -> TrainConfig {
    tiny_config_with(kind, &[])
}

fn tiny_config_with(kind: SourceKind, more: &[&str]) -> TrainConfig {
    // A velocity field goes without the first part of stage 2, so that the second one is not left out.
    let fit = if kind == SourceKind::Freegave { "fit_dynamics.steps=0" } else { "fit_dynamics.steps=2" };
    // Particles by themselves have a part of stage 2 that laws in generalised coordinates do not need.
    let coordinates = if kind == SourceKind::Freegave { "particles" } else { "generalised" };
    let settings = [
        &format!("source.kind={}", kind.name()),
        &format!("distill.coordinates={coordinates}"),
        // Twice these: a warm-up to 40, a window that grows to 72, and 120 in all.
        "source.stretch=2",
        "source.iterations=60",
        "source.warmup_iterations=20",
        "source.window_steps=5",
        "source.window_interval=4",
        "source.initial_gaussians=300",
        "source.densify.after=10",
        "source.densify.before=40",
        "source.densify.interval=20",
        "source.densify.max_gaussians=400",
        fit,
        "fit_dynamics.frames=6",
        "tune_dynamics.iterations=4",
        "tune_dynamics.frames_per_step=2",
        "tune_dynamics.subset=64",
        "tune_dynamics.refresh_every=3",
        "refine_gaussians.iterations=5",
        "tune_gaussians.iterations=12",
        "tune_gaussians.refresh_every=5",
    ];
    let own = own_settings(kind);
    let settings: Vec<String> = settings.iter().chain(own).chain(more).map(|s| (*s).to_owned()).collect();
    TrainConfig::resolve(Preset::Quick, None, &settings).expect("config")
}

/// Trains in a folder; a stop is asked for after `stop_at` steps of a stage.
fn run(
    folder: &Path,
    dataset: &Dataset,
    kind: SourceKind,
    stop_at: Option<(Stage, usize)>,
) -> Result<Trained, TrainError> {
    let config = tiny_config(kind);
    if !folder.exists() {
        RunFolder::create(folder, &config, dataset)?;
    }
    run_with(&config, folder, dataset, stop_at)
}

/// Trains with settings in a folder that holds their run.
fn run_with(
    config: &TrainConfig,
    folder: &Path,
    dataset: &Dataset,
    stop_at: Option<(Stage, usize)>,
) -> Result<Trained, TrainError> {
    let run = RunFolder::open(folder)?.0;
    let stop = AtomicBool::new(false);
    let mut progress = |p: Progress| {
        if stop_at == Some((p.stage, p.step)) {
            stop.store(true, Ordering::Relaxed);
        }
    };
    let device = DeviceName::Cpu.device();
    train(&run, dataset, config, &device, &mut Control::new(&stop, &mut progress))
}

/// Bytes of everything that a run delivers.
fn delivered(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let checkpoints =
        std::fs::read_dir(folder.join("checkpoints")).expect("checkpoints").map(|e| e.expect("entry").path());
    let name = |p: &Path| p.file_name().expect("name").to_string_lossy().into_owned();
    let mut files: Vec<_> = checkpoints.filter(|p| name(p).contains("-tune-gaussians-0000012")).collect();
    let source = std::fs::read_dir(folder.join("source")).expect("source").map(|e| e.expect("entry").path());
    files.extend(source.filter(|p| p.extension().is_some_and(|e| e == "safetensors")));
    files.extend([folder.join("lagrangian.safetensors"), folder.join("events.jsonl")]);
    files.into_iter().map(|p| (name(&p), std::fs::read(&p).expect("read"))).collect()
}

#[test]
fn a_run_that_was_stopped_in_every_stage_delivers_the_same_bytes_on_any_number_of_threads() {
    stopped_runs_deliver_the_same_bytes(SourceKind::Defgs);
}

#[test]
fn so_do_those_with_a_velocity_field_or_control_nodes() {
    stopped_runs_deliver_the_same_bytes(SourceKind::Freegave);
    stopped_runs_deliver_the_same_bytes(SourceKind::Nodes);
}

#[test]
fn relocation_keeps_its_budget_and_resumes_bit_for_bit() {
    let folder = tempfile::tempdir().expect("folder");
    let dataset = falling_ball(folder.path(), 40, 4);
    let more = [
        "source.densify.method=mcmc",
        "source.densify.max_gaussians=330",
        "source.densify.mcmc.growth=0.2",
        "source.densify.proposals=5",
        "source.antialias=mip-smoothing",
    ];
    let config = tiny_config_with(SourceKind::Defgs, &more).source;
    let device = DeviceName::Cpu.device();
    let trainer = || SourceTrainer::new(&dataset, &config, 3, &device).expect("trainer");
    let (mut whole, mut losses, mut halves) = (trainer(), Vec::new(), None);
    while !whole.is_finished() {
        losses.push(whole.step().figures().loss);
        if whole.step_index() == 50 {
            halves = Some(whole.checkpoint());
        }
    }
    assert_eq!(whole.gaussians(), 330, "the number grows to the budget and stays there");
    assert!(losses[110..].iter().sum::<f32>() < 0.8 * losses[..10].iter().sum::<f32>());
    let path = folder.path().join("half");
    halves.expect("a checkpoint").save(&path).expect("save");
    let file = lgs_model::TensorFile::load(&path, lgs_train::checkpoint::CHECKPOINT_FORMAT).expect("load");
    let mut resumed = trainer();
    resumed.restore(&file, 50).expect("restore");
    while !resumed.is_finished() {
        resumed.step();
    }
    assert_eq!(resumed.model().cloud_at(0.4), whole.model().cloud_at(0.4));
}

fn stopped_runs_deliver_the_same_bytes(kind: SourceKind) {
    let folder = tempfile::tempdir().expect("folder");
    let dataset = falling_ball(folder.path(), 40, 4);
    let (whole, stopped) = (folder.path().join("whole"), folder.path().join("stopped"));
    let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("pool");
    let trained = one_thread.install(|| run(&whole, &dataset, kind, None)).expect("train");
    assert_eq!(trained.source.kind(), kind);
    let is_lit = kind != SourceKind::Defgs;
    assert_eq!([trained.source.shading().is_some(), trained.scene.shading.is_some()], [is_lit; 2]);
    assert!(!trained.scene.dynamic_gaussians.is_empty(), "the ball was found to move");
    assert!(trained.scene.velocities.as_flattened().iter().all(|v| v.is_finite()));

    let three_threads = rayon::ThreadPoolBuilder::new().num_threads(3).build().expect("pool");
    for stop in [
        (Stage::Source, 30),
        (Stage::Source, 55),
        (Stage::Source, 101),
        (Stage::RefineGaussians, 2),
        if kind == SourceKind::Freegave { (Stage::TuneDynamics, 2) } else { (Stage::FitDynamics, 1) },
        (Stage::TuneGaussians, 7),
    ] {
        let interrupted = three_threads.install(|| run(&stopped, &dataset, kind, Some(stop)));
        assert!(matches!(interrupted, Err(TrainError::Interrupted { .. })), "stopped in {stop:?}");
    }
    three_threads.install(|| run(&stopped, &dataset, kind, None)).expect("resume");
    let (whole, stopped) = (delivered(&whole), delivered(&stopped));
    assert_eq!(whole.len(), if kind == SourceKind::Nodes { 5 } else { 4 }, "refined cameras are one more");
    assert_eq!(whole.keys().collect::<Vec<_>>(), stopped.keys().collect::<Vec<_>>());
    for (name, bytes) in &whole {
        assert!(bytes == &stopped[name], "{name} differs");
    }
}

#[test]
fn the_schedule_of_a_time_budget_is_recorded_and_repeated_exactly_also_in_parts() {
    let folder = tempfile::tempdir().expect("folder");
    let dataset = falling_ball(folder.path(), 40, 4);
    let more = ["time_budget_secs=4", "source.stretch=100", "tune_gaussians.stretch=100"];
    let config = tiny_config_with(SourceKind::Defgs, &more);
    let (whole, parts) = (folder.path().join("whole"), folder.path().join("parts"));
    RunFolder::create(&whole, &config, &dataset).expect("run");
    RunFolder::create(&parts, &config, &dataset).expect("run");
    let train_in = |path: &Path, stop: Option<(Stage, usize)>| run_with(&config, path, &dataset, stop);
    train_in(&whole, None).expect("train");
    let schedule = read_schedule(&whole.join("schedule.json")).expect("a schedule");
    let shortened = schedule.paces.iter().find(|pace| pace.pace > 1.0).expect("thousands of steps");
    std::fs::copy(whole.join("schedule.json"), parts.join("schedule.json")).expect("copy");
    let mut stops = vec![(Stage::Source, 3), (Stage::Source, shortened.step + 2)];
    // On a slow machine the stages before leave no time for it.
    if schedule.has_time_for[Stage::TuneGaussians.name()] {
        stops.push((Stage::TuneGaussians, 1));
    }
    for stop in stops {
        assert!(matches!(train_in(&parts, Some(stop)), Err(TrainError::Interrupted { .. })), "{stop:?}");
    }
    train_in(&parts, None).expect("resume");
    assert_eq!(read_schedule(&parts.join("schedule.json")).expect("a schedule").paces, schedule.paces);
    let (whole, parts) = (delivered(&whole), delivered(&parts));
    assert_eq!(whole.len(), 3);
    assert!(whole == parts, "other bytes in one of {:?}", whole.keys());
}

#[test]
fn an_ablated_run_leaves_out_what_it_names() {
    let folder = tempfile::tempdir().expect("folder");
    falling_ball(folder.path(), 40, 4);
    let config = tiny_config_with(
        SourceKind::Defgs,
        &["last_stage=1", "motion.alignment=false", "distill.force=none", "data.train_before=0.5"],
    );
    let options = LoadOptions { train_before: Some(config.data.train_before), ..LoadOptions::default() };
    let dataset = Dataset::load(&folder.path().join("data"), &options, &|_, _| {}).expect("load");
    let path = folder.path().join("run");
    let run = RunFolder::create(&path, &config, &dataset).expect("run");
    let mut stages = std::collections::BTreeSet::new();
    let mut progress = |p: Progress| {
        stages.insert(p.stage);
    };
    let (stop, device) = (AtomicBool::new(false), DeviceName::Cpu.device());
    let mut control = Control::new(&stop, &mut progress);
    let scene = train(&run, &dataset, &config, &device, &mut control).expect("train").scene;
    assert_eq!(stages.into_iter().collect::<Vec<_>>(), [Stage::Source, Stage::Distill]);
    assert!(
        !scene.objects.is_empty() && scene.objects.iter().all(|object| object.dynamics.supports().is_none())
    );
    assert!(scene.objects.iter().all(|object| {
        let particles = object.dynamics.particles();
        particles.is_none_or(|particles| particles.system.config.force == lgs_dynamics::ForceKind::None)
    }));
    assert!(
        (scene.motion.time_window - 25.0 / 60.0).abs() < 1e-5,
        "the last training time below 0.5: {}",
        scene.motion.time_window
    );
}

#[test]
fn a_folder_with_a_run_is_not_overwritten_and_a_damaged_checkpoint_is_named() {
    let folder = tempfile::tempdir().expect("folder");
    let dataset = falling_ball(folder.path(), 40, 4);
    let path = folder.path().join("run");
    run(&path, &dataset, SourceKind::Freegave, Some((Stage::Source, 3))).err().expect("stopped");
    let again = RunFolder::create(&path, &tiny_config(SourceKind::Freegave), &dataset)
        .expect_err("occupied")
        .to_string();
    assert!(again.contains("run"), "{again}");
    let checkpoint = std::fs::read_dir(path.join("checkpoints"))
        .expect("folder")
        .next()
        .expect("one")
        .expect("entry")
        .path();
    let bytes = std::fs::read(&checkpoint).expect("read");
    std::fs::write(&checkpoint, &bytes[..bytes.len() / 2]).expect("cut");
    let error = run(&path, &dataset, SourceKind::Freegave, None).err().expect("damaged").to_string();
    assert!(error.contains("0-source-0000003.safetensors"), "{error}");
}

#[test]
fn every_kind_of_source_model_learns_from_images_and_survives_its_file() {
    let folder = tempfile::tempdir().expect("folder");
    let dataset = falling_ball(folder.path(), 40, 4);
    let device = DeviceName::Cpu.device();
    for kind in SourceKind::ALL.into_iter().filter(|kind| kind.is_trained()) {
        let config = tiny_config(kind);
        let mut trainer = SourceTrainer::new(&dataset, &config.source, 3, &device).expect("trainer");
        let losses: Vec<f32> = (0..trainer.steps()).map(|_| trainer.step().figures().loss).collect();
        let mean = |part: &[f32]| part.iter().sum::<f32>() / part.len() as f32;
        let (first, last) = (mean(&losses[..10]), mean(&losses[losses.len() - 10..]));
        assert!(last < 0.8 * first, "{}: {first} {last}", kind.name());
        let (model, path) = (trainer.model(), folder.path().join(kind.name()));
        assert_eq!((model.kind(), model.len()), (kind, trainer.gaussians()));
        model.save(&path).expect("save");
        let read = load_source(&path).expect("load");
        assert_eq!((read.kind(), read.cloud_at(0.4)), (kind, model.cloud_at(0.4)));
    }
}
