//! Trains a source model on a dataset and prints, eight times, what its training frames say, with the
//! cameras as they are refined, and its held-out ones (`val`, else `test`), also of the discs of things that
//! fly, and, if the dataset has a ground truth, how far each object's tracks are from it (mean, median), −1
//! being all that is static:
//! `train_source DATA [quick|standard|paper] [key=value]… [pictures=FOLDER]`. Into the folder go, whenever
//! figures are printed, three held-out frames beside their images, one above the other.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use lgs_core::linear::{add, mat_vec, norm, sub};
use lgs_core::{Image, nearest_indices};
use lgs_data::dataset::{Dataset, Frame, LoadOptions};
use lgs_data::synth::GroundTruth;
use lgs_dynamics::kabsch;
use lgs_model::source::SourceModel;
use lgs_render::{Splats, psnr, rasterize};
use lgs_train::config::{Preset, TrainConfig};
use lgs_train::source::SourceTrainer;
use lgs_train::tracks::{Track, find_flights};
use lgs_train::{DeviceName, Trainer};

/// Times that results are printed.
const REPORTS: usize = 8;
/// Logit of the opacity from which a Gaussian counts as a part of a body: one half.
const OPAQUE: f32 = 0.0;
/// Largest distance from a true point of a Gaussian that counts as its part, world units.
const NEAR: f32 = 0.05;

/// Held-out frames that pictures are made of.
const PICTURES: usize = 3;

/// What a model shows in the place of a frame.
fn drawn(model: &dyn SourceModel, frame: &Frame, background: [f32; 3]) -> Image {
    let drawn = rasterize(&Splats::from(&model.cloud_at(frame.time)), &frame.camera, background);
    let mut image = drawn.to_image();
    frame.exposure.expose(&mut image.pixels, &drawn.transmittance, background);
    image
}

/// Mean PSNR of every so many frames, dB.
fn mean_psnr(model: &dyn SourceModel, frames: &[Frame], every: usize, background: [f32; 3]) -> f32 {
    let chosen = frames.iter().step_by(every);
    let count = chosen.len().max(1) as f32;
    chosen.map(|f| psnr(&drawn(model, f, background), &f.composited(background))).sum::<f32>() / count
}

/// PSNR of the held-out frames within the discs of a thing in flight, dB.
fn psnr_of_thing(model: &dyn SourceModel, dataset: &Dataset, thing: &Track) -> f32 {
    let (mut error, mut count) = (0.0_f64, 0.0_f64);
    for frame in dataset.split(held_out(dataset)) {
        let camera = &frame.camera;
        let ([x, y], depth) = camera.pixel_from_world(thing.position(frame.time));
        let radius = camera.fx * thing.radius / depth;
        let (shown, image) = (drawn(model, frame, dataset.background), frame.composited(dataset.background));
        for (i, (a, b)) in shown.pixels.iter().zip(&image.pixels).enumerate() {
            let [dx, dy] =
                [(i as u32 % camera.width) as f32 + 0.5 - x, (i as u32 / camera.width) as f32 + 0.5 - y];
            if depth > 0.0 && dx * dx + dy * dy < radius * radius {
                error += (0..3).map(|c| f64::from(a[c].clamp(0.0, 1.0) - b[c]).powi(2)).sum::<f64>();
                count += 3.0;
            }
        }
    }
    (-10.0 * (error / count.max(1.0)).log10()) as f32
}

/// Frames spread over a split, as a model shows them (left) and as they are.
fn picture(model: &dyn SourceModel, frames: &[Frame], background: [f32; 3]) -> Option<image::RgbImage> {
    let chosen = || frames.iter().step_by(frames.len().div_ceil(PICTURES).max(1));
    let size = chosen().map(|frame| [frame.camera.width, frame.camera.height]).next()?;
    let mut sheet = image::RgbImage::new(2 * size[0], chosen().count() as u32 * size[1]);
    for (row, frame) in (0..).zip(chosen()) {
        let shown = [drawn(model, frame, background), frame.composited(background)];
        for (column, shown) in (0..).zip(shown) {
            for y in 0..size[1].min(shown.height) {
                for x in 0..size[0].min(shown.width) {
                    let color = shown.pixels[(y * shown.width + x) as usize];
                    let byte = color.map(|c| (255.0 * c.clamp(0.0, 1.0)).round() as u8);
                    sheet.put_pixel(column * size[0] + x, row * size[1] + y, image::Rgb(byte));
                }
            }
        }
    }
    Some(sheet)
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

/// Label of each object and the mean and median distance of its opaque Gaussians from where the truth carries
/// them, over sampled times up to a last one, world units; −1 is all that is static.
fn track_errors(model: &dyn SourceModel, truth: &GroundTruth, last: f32) -> Vec<(i32, [f32; 2])> {
    let start = truth.times.iter().position(|&t| t > -1e-4).unwrap_or(0);
    let cloud = model.cloud_at(truth.times[start]);
    let nearest = nearest_indices(&truth.points[start], &cloud.means);
    let is_part = |&i: &usize| {
        let point = truth.points[start][nearest[i] as usize];
        cloud.raw_opacities[i] > OPAQUE && norm(sub(cloud.means[i], point)) < NEAR
    };
    let parts: Vec<usize> = (0..cloud.len()).filter(is_part).collect();
    let mut errors: BTreeMap<i32, Vec<f32>> = BTreeMap::new();
    for time in (start..truth.times.len()).take_while(|&time| truth.times[time] < last).step_by(5) {
        let positions = model.positions_at(truth.times[time]);
        for object in truth.objects().into_iter().chain([-1]) {
            let ([before, after], rotation) = rigid(truth, object, [start, time]);
            for &i in parts.iter().filter(|&&i| truth.object[nearest[i] as usize] == object) {
                let carried = match object {
                    -1 => cloud.means[i],
                    _ => add(after, mat_vec(&rotation, sub(cloud.means[i], before))),
                };
                errors.entry(object).or_default().push(norm(sub(positions[i], carried)));
            }
        }
    }
    let summary = |mut errors: Vec<f32>| {
        errors.sort_by(f32::total_cmp);
        [errors.iter().sum::<f32>() / errors.len() as f32, errors[errors.len() / 2]]
    };
    errors.into_iter().map(|(object, errors)| (object, summary(errors))).collect()
}

/// The settings that arguments ask for: a preset's name, and values over it.
fn configured(arguments: impl Iterator<Item = String>) -> Result<TrainConfig, Box<dyn std::error::Error>> {
    let (overrides, names): (Vec<String>, Vec<String>) = arguments.partition(|a| a.contains('='));
    let preset = match names.first().map(String::as_str) {
        None | Some("quick") => Preset::Quick,
        Some("standard") => Preset::Standard,
        Some("paper") => Preset::Paper,
        Some(other) => return Err(format!("`{other}` is no preset").into()),
    };
    Ok(TrainConfig::resolve(preset, None, &overrides)?)
}

/// The images of a folder as the settings ask for them.
fn loaded(data: &Path, config: &TrainConfig) -> Result<Dataset, Box<dyn std::error::Error>> {
    let options = LoadOptions {
        white_background: config.data.white_background,
        resolution: (config.data.resolution > 0).then_some(config.data.resolution),
        near: config.source.near,
        filter: config.source.antialias.filter(),
        ..LoadOptions::default()
    };
    Ok(Dataset::load(data, &options, &|_, _| {})?)
}

/// The split that is held out.
fn held_out(dataset: &Dataset) -> &'static str {
    if dataset.split("val").is_empty() { "test" } else { "val" }
}

/// Prints what the frames say of a model as it is now, of all frames or of every fifth.
fn report(trainer: &SourceTrainer, dataset: &Dataset, every: usize) -> Box<dyn SourceModel> {
    let (model, held_out) = (trainer.model(), held_out(dataset));
    let refined = trainer.refined_cameras().map(|cameras| cameras.applied_to(dataset));
    let corrected = refined.as_ref().unwrap_or(dataset);
    let train = mean_psnr(&*model, corrected.split("train"), 5 * every, dataset.background);
    let held = mean_psnr(&*model, dataset.split(held_out), every, dataset.background);
    print!("{} Gaussians, train {train:.2} dB, {held_out} {held:.2} dB", trainer.gaussians());
    model
}

/// The settings among the arguments, and the folder of pictures.
fn arguments() -> (Vec<String>, Option<PathBuf>) {
    let is_folder = |a: &String| a.starts_with("pictures=");
    let (folders, settings): (Vec<String>, Vec<String>) = std::env::args().skip(1).partition(is_folder);
    (settings, folders.first().and_then(|a| a.strip_prefix("pictures=")).map(PathBuf::from))
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (settings, folder) = arguments();
    let mut settings = settings.into_iter();
    let data = settings.next().ok_or("usage: train_source DATA [quick|standard|paper] [key=value]…")?;
    let config = configured(settings)?;
    let dataset = loaded(Path::new(&data), &config)?;
    let truth = GroundTruth::load(Path::new(&data))?;
    let things = find_flights(dataset.split("train"), dataset.background);
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
        print!("{step:5} {:6.1} s ", spent.as_secs_f32());
        let model = report(&trainer, &dataset, if step == steps { 1 } else { 5 });
        if let Some(truth) = &truth {
            for (object, [mean, median]) in track_errors(&*model, truth, last) {
                print!(", {object}: {mean:.4} {median:.4}");
            }
        }
        things
            .iter()
            .for_each(|thing| print!(", in flight {:.2} dB", psnr_of_thing(&*model, &dataset, thing)));
        println!();
        if let Some(folder) = &folder {
            std::fs::create_dir_all(folder)?;
            let frames = dataset.split(held_out(&dataset));
            picture(&*model, frames, dataset.background)
                .map(|sheet| sheet.save(folder.join(format!("{step:06}.png"))))
                .transpose()?;
        }
    }
    Ok(())
}
