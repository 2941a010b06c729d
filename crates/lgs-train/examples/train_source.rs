//! Trains a source model on a dataset and prints what its held-out frames say, as a whole and by time:
//! `train_source DATA [key=value]…`.

use std::path::Path;
use std::time::Instant;

use lgs_data::dataset::{Dataset, Frame, LoadOptions};
use lgs_model::source::SourceModel;
use lgs_render::{Splats, psnr, rasterize};
use lgs_train::config::{Preset, TrainConfig};
use lgs_train::source::SourceTrainer;
use lgs_train::{DeviceName, Trainer};

/// Parts of a split that are printed by themselves.
const PARTS: usize = 8;

/// PSNR by time, dB.
fn psnr_by_time(model: &dyn SourceModel, frames: &[Frame], background: [f32; 3]) -> Vec<(f32, f32)> {
    let psnr = |frame: &Frame| {
        let cloud = model.cloud_at(frame.time);
        let drawn = rasterize(&Splats::from(&cloud), &frame.camera, background);
        (frame.time, psnr(&drawn.to_image(), &frame.composited(background)))
    };
    let mut rows: Vec<(f32, f32)> = frames.iter().map(psnr).collect();
    rows.sort_by(|a, b| a.0.total_cmp(&b.0));
    rows
}

fn mean(rows: &[(f32, f32)]) -> f32 {
    rows.iter().map(|(_, psnr)| psnr).sum::<f32>() / rows.len().max(1) as f32
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let data = arguments.next().ok_or("usage: train_source DATA [key=value]…")?;
    let overrides: Vec<String> = arguments.collect();
    let config = TrainConfig::resolve(Preset::Quick, None, &overrides)?;
    let data_config = &config.data;
    let options = LoadOptions {
        white_background: data_config.white_background,
        resolution: (data_config.resolution > 0).then_some(data_config.resolution),
        near: config.source.near,
        filter: config.source.antialias.filter(),
        ..LoadOptions::default()
    };
    let dataset = Dataset::load(Path::new(&data), &options, &|_, _| {})?;
    let mut trainer = SourceTrainer::new(&dataset, &config.source, config.seed, &DeviceName::Auto.device())?;
    let start = Instant::now();
    let mut recent = 0.0;
    while !trainer.is_finished() {
        let report = trainer.step();
        recent += report.psnr / 100.0;
        if trainer.step_index() % 100 == 0 {
            eprintln!(
                "{:5} psnr {recent:.2} gaussians {} {:.1} s",
                trainer.step_index(),
                trainer.gaussians(),
                start.elapsed().as_secs_f32()
            );
            recent = 0.0;
        }
    }
    let model = trainer.model();
    for split in ["val", "test"] {
        let rows = psnr_by_time(&*model, dataset.split(split), dataset.background);
        println!("{split} {:.2} dB", mean(&rows));
        for part in rows.chunks(rows.len().div_ceil(PARTS).max(1)) {
            eprintln!("{split} from t = {:.3}: {:.2} dB", part[0].0, mean(part));
        }
    }
    Ok(())
}
