//! Repeats stage 1 on the source model of a finished run and prints what it finds: `distill_run RUN [key=value]…`.
//!
//! With `RUST_LOG=lgs_distill=debug` the forecasts of all candidate laws are listed.

use std::path::Path;

use lgs_model::source::load_source;
use lgs_train::stages::{BakeRequest, bake};
use lgs_train::{RunFolder, TrainConfig};

/// What a pixel of the median camera spans at the distance of the cameras' mean from it, world units: near enough to what training uses.
fn pixel_size(root: &Path) -> Result<f32, Box<dyn std::error::Error>> {
    let cameras = lgs_data::cameras::read_cameras_json(&root.join("source").join("cameras.json"))?;
    let centers: Vec<[f32; 3]> = cameras.iter().map(|(_, camera)| camera.center_in_world()).collect();
    let mean: [f32; 3] = std::array::from_fn(|i| centers.iter().map(|c| c[i]).sum::<f32>() / centers.len().max(1) as f32);
    let mut sizes: Vec<f32> = cameras.iter().map(|(_, camera)| camera.pixel_from_world(mean).1.max(0.0) / camera.fx).collect();
    sizes.sort_by(f32::total_cmp);
    Ok(sizes.get(sizes.len() / 2).copied().unwrap_or(0.0))
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    tracing_subscriber::fmt().with_env_filter(tracing_subscriber::EnvFilter::from_default_env()).with_writer(std::io::stderr).init();
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let Some((root, given)) = arguments.split_first() else { return Err("usage: distill_run RUN [key=value]…".into()) };
    let (run, own) = RunFolder::open(Path::new(root))?;
    let mut settings = vec![format!("source.kind={}", own.source.kind.name())];
    settings.extend_from_slice(given);
    let config = TrainConfig::resolve(own.preset, None, &settings)?;
    let source = load_source(&run.source_path(own.source.kind))?;
    let request = BakeRequest {
        partition: &config.partition,
        distill: &config.distill,
        motion: &config.motion,
        time_window: lgs_model::load_scene(&run.scene_path()).map_or(0.75, |scene| scene.motion.time_window),
        pixel_size: pixel_size(run.root())?,
        background: [1.0; 3],
        seed: config.seed,
    };
    let baked = bake(&*source, &request, &mut |_, _, _| {})?;
    println!("{}", serde_json::to_string_pretty(&baked.reports)?);
    Ok(())
}
