//! Repeats stage 1 on the source model of a finished run and prints what it finds: `distill_run RUN [key=value]…`.
//!
//! With `RUST_LOG=lgs_distill=debug` the forecasts of all candidate laws are listed.

use std::path::Path;

use lgs_model::source::DefGs;
use lgs_train::stages::{BakeRequest, bake};
use lgs_train::{RunFolder, TrainConfig};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    tracing_subscriber::fmt().with_env_filter(tracing_subscriber::EnvFilter::from_default_env()).with_writer(std::io::stderr).init();
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let Some((root, settings)) = arguments.split_first() else { return Err("usage: distill_run RUN [key=value]…".into()) };
    let (run, own) = RunFolder::open(Path::new(root))?;
    let config = TrainConfig::resolve(own.preset, None, settings)?;
    let source = DefGs::load(&run.source_path())?;
    let request = BakeRequest {
        partition: &config.partition,
        distill: &config.distill,
        motion: &config.motion,
        time_window: lgs_model::load_scene(&run.scene_path()).map_or(0.75, |scene| scene.motion.time_window),
        background: [1.0; 3],
        seed: config.seed,
    };
    let baked = bake(&source, &request, &mut |_, _, _| {})?;
    println!("{}", serde_json::to_string_pretty(&baked.reports)?);
    Ok(())
}
