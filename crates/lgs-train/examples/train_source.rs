//! Trains a source model on a dataset and prints, eight times, what its held-out frames say and, if the
//! dataset has a ground truth, how far its tracks are from it: `train_source DATA [key=value]…`.

use std::path::Path;
use std::time::{Duration, Instant};

use lgs_core::linear::{add, mat_vec, norm, sub};
use lgs_core::nearest_indices;
use lgs_data::dataset::{Dataset, Frame, LoadOptions};
use lgs_data::synth::GroundTruth;
use lgs_dynamics::kabsch;
use lgs_model::source::SourceModel;
use lgs_render::{Splats, psnr, rasterize};
use lgs_train::config::{Preset, TrainConfig};
use lgs_train::source::SourceTrainer;
use lgs_train::{DeviceName, Trainer};

/// Times that results are printed.
const REPORTS: usize = 8;
/// Logit of the opacity from which a Gaussian counts as a part of a body: one half.
const OPAQUE: f32 = 0.0;

/// Mean PSNR of every so many frames, dB.
fn mean_psnr(model: &dyn SourceModel, frames: &[Frame], every: usize, background: [f32; 3]) -> f32 {
    let chosen = frames.iter().step_by(every);
    let count = chosen.len().max(1) as f32;
    let psnr = |frame: &Frame| {
        let drawn = rasterize(&Splats::from(&model.cloud_at(frame.time)), &frame.camera, background);
        psnr(&drawn.to_image(), &frame.composited(background))
    };
    chosen.map(psnr).sum::<f32>() / count
}

/// The points of an object at the start and at a sampled time, as centre and rotation between them.
fn rigid(truth: &GroundTruth, object: i32, [start, time]: [usize; 2]) -> ([[f32; 3]; 2], [[f32; 3]; 3]) {
    let members: Vec<usize> = (0..truth.object.len()).filter(|&p| truth.object[p] == object).collect();
    let center = |at: usize| {
        let sum = members.iter().fold([0.0; 3], |sum, &p| add(sum, truth.points[at][p]));
        sum.map(|v: f32| v / members.len() as f32)
    };
    let centers = [center(start), center(time)];
    let mut moments = [[0.0; 3]; 3];
    for &p in &members {
        let [a, b] = [sub(truth.points[start][p], centers[0]), sub(truth.points[time][p], centers[1])];
        moments.iter_mut().zip(b).for_each(|(row, b)| row.iter_mut().zip(a).for_each(|(m, a)| *m += b * a));
    }
    (centers, kabsch(&moments))
}

/// Mean distances of opaque Gaussians on moving objects, and on the rest, from where the truth carries them,
/// over sampled times up to a last one, world units.
fn track_errors(model: &dyn SourceModel, truth: &GroundTruth, last: f32) -> [f32; 2] {
    let start = truth.times.iter().position(|&t| t > -1e-4).unwrap_or(0);
    let cloud = model.cloud_at(truth.times[start]);
    let opaque: Vec<usize> = (0..cloud.len()).filter(|&i| cloud.raw_opacities[i] > OPAQUE).collect();
    let means: Vec<[f32; 3]> = opaque.iter().map(|&i| cloud.means[i]).collect();
    let objects = nearest_indices(&truth.points[start], &means).into_iter().map(|p| truth.object[p as usize]);
    let objects: Vec<i32> = objects.collect();
    let (mut sums, mut counts) = ([0.0_f32; 2], [0.0_f32; 2]);
    for time in (start..truth.times.len()).take_while(|&time| truth.times[time] < last).step_by(5) {
        let positions = model.positions_at(truth.times[time]);
        for object in truth.objects().into_iter().chain([-1]) {
            let ([before, after], rotation) = rigid(truth, object, [start, time]);
            let is_static = usize::from(object < 0);
            for (i, &mean) in means.iter().enumerate().filter(|&(i, _)| objects[i] == object) {
                let carried = match object {
                    -1 => mean,
                    _ => add(after, mat_vec(&rotation, sub(mean, before))),
                };
                sums[is_static] += norm(sub(positions[opaque[i]], carried));
                counts[is_static] += 1.0;
            }
        }
    }
    std::array::from_fn(|i| sums[i] / counts[i].max(1.0))
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
    let truth = GroundTruth::load(Path::new(&data))?;
    let last = dataset.split("train").iter().map(|frame| frame.time).fold(0.0, f32::max);
    let mut trainer = SourceTrainer::new(&dataset, &config.source, config.seed, &DeviceName::Auto.device())?;
    let mut spent = Duration::ZERO;
    while !trainer.is_finished() {
        let start = Instant::now();
        trainer.step();
        spent += start.elapsed();
        let (step, steps) = (trainer.step_index(), trainer.steps());
        if step % steps.div_ceil(REPORTS) != 0 && step != steps {
            continue;
        }
        let model = trainer.model();
        let every = if step == steps { 1 } else { 5 };
        let val = mean_psnr(&*model, dataset.split("val"), every, dataset.background);
        print!("{step:5} {:6.1} s {} Gaussians, val {val:.2} dB", spent.as_secs_f32(), trainer.gaussians());
        if let Some(truth) = &truth {
            let [moving, rest] = track_errors(&*model, truth, last);
            print!(", tracks off by {moving:.4} (moving) {rest:.4} (static)");
        }
        println!();
    }
    Ok(())
}
