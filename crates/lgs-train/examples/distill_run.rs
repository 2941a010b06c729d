//! Repeats stage 1 on the source model of a finished run and prints what it finds: `distill_run RUN DATA
//! [key=value]…`.
//!
//! With `RUST_LOG=lgs_distill=debug,lgs_train=debug` the forecasts of all candidate laws are listed, and what
//! the images say of each object.

use std::path::Path;

use lgs_data::dataset::{Dataset, LoadOptions};
use lgs_model::source::load_source;
use lgs_train::stages::{InitialSceneRequest, initialise_scene};
use lgs_train::{DeviceName, RunFolder, TrainConfig};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    tracing_subscriber::fmt()
        .with_env_filter(tracing_subscriber::EnvFilter::from_default_env())
        .with_writer(std::io::stderr)
        .init();
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [root, data, given @ ..] = arguments.as_slice() else {
        return Err("usage: distill_run RUN DATA [key=value]…".into());
    };
    let (run, own) = RunFolder::open(Path::new(root))?;
    let mut settings = vec![format!("source.kind={}", own.source.kind.name())];
    settings.extend_from_slice(given);
    let config = TrainConfig::resolve(own.preset, None, &settings)?;
    let source = load_source(&run.source_path(own.source.kind))?;
    let dataset = Dataset::load(Path::new(data), &LoadOptions::default(), &|_, _| {})?;
    let request = InitialSceneRequest {
        partition: &config.partition,
        distill: &config.distill,
        motion: &config.motion,
        time_window: lgs_model::load_scene(&run.scene_path()).map_or(0.75, |scene| scene.motion.time_window),
        pixel_size: dataset.pixel_size(),
        background: dataset.background,
        frames: dataset.split("train"),
        viewing_distance: dataset.viewing_distance(),
        seed: config.seed,
        device: &DeviceName::Cpu.device(),
    };
    let initial = initialise_scene(&*source, &request, &mut ())?;
    println!("{}", serde_json::to_string_pretty(&initial.reports)?);
    Ok(())
}
