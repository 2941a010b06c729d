//! Steps of training a source by the `standard` preset, all Gaussians moving.

use std::error::Error;
use std::hint::black_box;

use burn::tensor::Device;
use lgs_data::dataset::{Dataset, LoadOptions};
use lgs_data::synth::{self, SynthOptions};
use lgs_model::source::SourceKind;
use lgs_train::source::{SourceConfig, SourceTrainer};
use lgs_train::{Preset, Trainer};

use crate::Sizes;
use crate::rows::{least, row};

fn trainer<'a>(
    dataset: &'a Dataset,
    sizes: &Sizes,
    device: &Device,
) -> Result<SourceTrainer<'a>, Box<dyn Error>> {
    let mut config = SourceConfig::preset(SourceKind::Defgs, Preset::Standard);
    (config.initial_gaussians, config.warmup_iterations) = (sizes.gaussians, 0);
    config.densify.before = 0;
    config.shading.after = 0;
    Ok(SourceTrainer::new(dataset, &config, 0, device)?)
}

/// Measures and prints.
pub(crate) fn run(sizes: &Sizes, devices: &[Device; 2]) -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let options = SynthOptions { size: sizes.pixels, views: 6, train_fps: 12, ..SynthOptions::default() };
    let data = folder.path().join("data");
    synth::generate("falling-ball", &options, &data, &|_, _| {})?;
    let dataset = Dataset::load(&data, &LoadOptions::default(), &|_, _| {})?;
    let [mut one, mut other] =
        [trainer(&dataset, sizes, &devices[0])?, trainer(&dataset, sizes, &devices[1])?];
    let steps = |trainer: &mut SourceTrainer<'_>, count: usize| {
        let mut report = None;
        for _ in 0..count {
            report = Some(trainer.step());
        }
        black_box(report.map(|report| report.figures()));
    };
    // The processor takes as long for a tenth of them.
    let counts = [sizes.steps, sizes.steps.div_ceil(10)];
    let secs = least([&mut || steps(&mut one, counts[0]), &mut || steps(&mut other, counts[1])]);
    let rates = [0, 1].map(|i| counts[i] as f64 / secs[i]);
    row("training by `standard` with the deformation network and light over time, steps/s", rates);
    Ok(())
}
