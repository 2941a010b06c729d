//! Trains a source model on a dataset and prints what its held-out frames say: `train_source DATA [key=value]…`.

use std::path::Path;
use std::time::Instant;

use lgs_data::dataset::{Dataset, Frame, LoadOptions};
use lgs_model::source::SourceModel;
use lgs_render::{Splats, psnr, rasterize};
use lgs_train::config::{Preset, TrainConfig};
use lgs_train::source::SourceTrainer;

fn mean_psnr(model: &dyn SourceModel, frames: &[Frame], background: [f32; 3]) -> f32 {
    let psnr = |frame: &Frame| {
        let cloud = model.cloud_at(frame.time);
        let drawn = rasterize(&Splats::from(&cloud), &frame.camera, background);
        psnr(&drawn.to_image(), &frame.composited(background))
    };
    frames.iter().map(psnr).sum::<f32>() / frames.len().max(1) as f32
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let data = arguments.next().ok_or("usage: train_source DATA [key=value]…")?;
    let overrides: Vec<String> = arguments.collect();
    let config = TrainConfig::resolve(Preset::Quick, None, &overrides)?;
    let options = LoadOptions { white_background: config.data.white_background, ..LoadOptions::default() };
    let dataset = Dataset::load(Path::new(&data), &options, &|_, _| {})?;
    let mut trainer = SourceTrainer::new(&dataset, &config.source, config.seed)?;
    let start = Instant::now();
    let mut mean = 0.0;
    while !trainer.is_done() {
        let report = trainer.step()?;
        mean += report.psnr / 100.0;
        if report.iteration % 100 == 0 {
            eprintln!("{:5} psnr {mean:.2} gaussians {} {:.1} s", report.iteration, report.gaussians, start.elapsed().as_secs_f32());
            mean = 0.0;
        }
    }
    let model = trainer.model();
    for split in ["val", "test"] {
        println!("{split} {:.2} dB", mean_psnr(&*model, dataset.split(split), dataset.background));
    }
    Ok(())
}
