//! A recording of seconds of training.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

use lgs_data::dataset::{Dataset, LoadOptions};
use lgs_data::synth::{self, SynthOptions};
use lgs_rerun::{Recorder, Training};
use lgs_train::events::read_events;
use lgs_train::{Control, DeviceName, Onlooker, Preset, Progress, RunFolder, TrainConfig, TrainError, train};
use re_sdk_types::archetypes::{EncodedImage, GaussianSplats3D, Scalars, TextLog};
use re_sdk_types::components::{Blob, Position3D, Scalar, Text};

use crate::reader::Contents;

const SETTINGS: [&str; 7] = [
    "source.iterations=60",
    "source.warmup_iterations=20",
    "source.initial_gaussians=400",
    "distill.matching.steps=10",
    "distill.rollout.steps=2",
    "refine_gaussians.iterations=20",
    "tune_gaussians.iterations=20",
];

fn config() -> TrainConfig {
    TrainConfig::resolve(Preset::Quick, None, &SETTINGS.map(str::to_owned)).expect("settings")
}

/// Trains a run, up to a step of the source if one is given, and records it.
fn record(folder: &RunFolder, dataset: &Dataset, (path, until): (&Path, Option<usize>)) {
    let recorder = Recorder::begin(path, "tiny", config().hash().as_bytes()).expect("begun");
    let training = Training::new(recorder, folder, dataset);
    let stop = AtomicBool::new(false);
    let mut progress = |p: Progress| {
        training.report(&p);
        stop.store(until == Some(p.step), Ordering::Relaxed);
    };
    let mut onlooker = &training;
    let onlookers: Vec<&mut dyn Onlooker> = vec![&mut onlooker];
    let mut control = Control { stop: &stop, progress: &mut progress, onlookers };
    match train(folder, dataset, &config(), &DeviceName::Cpu.device(), &mut control) {
        Err(TrainError::Interrupted { .. }) if until.is_some() => {}
        result => drop(result.expect("trained")),
    }
    assert!(training.finish().expect("finished") > 0);
}

/// A number of a curve at each step.
fn curve(contents: &Contents, entity: &str) -> Vec<(i64, f64)> {
    let rows = contents.values::<Scalar>(entity, &Scalars::descriptor_scalars());
    rows.iter().map(|(step, values)| (*step, values[0].0.0)).collect()
}

#[test]
fn a_recording_has_the_training_curve_and_pictures_on_the_timeline_step() {
    let dir = tempfile::tempdir().expect("a folder");
    let data = dir.path().join("data");
    let options = SynthOptions { size: 24, views: 3, train_fps: 6, ..SynthOptions::default() };
    synth::generate("falling-ball", &options, &data, &|_, _| {}).expect("a dataset");
    let dataset = Dataset::load(&data, &LoadOptions::default(), &|_, _| {}).expect("loaded");
    let run = RunFolder::create(&dir.path().join("run"), &config(), &dataset).expect("a run");
    let [first, whole] = ["first.rrd", "whole.rrd"].map(|name| dir.path().join(name));
    record(&run, &dataset, (&first, Some(30)));
    let interrupted = Contents::read(&first);
    assert_eq!(interrupted.timelines().into_iter().collect::<Vec<_>>(), ["step"]);
    let steps: Vec<i64> = curve(&interrupted, "/curve/loss").iter().map(|(step, _)| *step).collect();
    assert_eq!(steps, [10, 20, 30]);

    // A resumed run brings its curve with it.
    record(&run, &dataset, (&whole, None));
    let contents = Contents::read(&whole);
    let events = read_events(&run.events_path()).expect("events");
    let loss = curve(&contents, "/curve/loss");
    let expected: Vec<f64> = events.iter().map(|event| f64::from(event.loss)).collect();
    assert_eq!(loss.iter().map(|(_, loss)| *loss).collect::<Vec<_>>(), expected);
    assert!(loss.is_sorted_by(|a, b| a.0 < b.0), "{loss:?}");
    assert!(loss.len() >= 10, "{loss:?}");
    let gaussians = curve(&contents, "/curve/gaussians");
    assert_eq!(gaussians.last().expect("a point").1, events.last().expect("a line").gaussians as f64);
    let stages = contents.values::<Text>("/stage", &TextLog::descriptor_text());
    let stages: Vec<&str> = stages.iter().map(|(_, texts)| texts[0].as_str()).collect();
    assert_eq!((stages[0], stages.last()), ("source", Some(&"tune-gaussians")));
    pictures(&contents, &dataset);
}

/// Asserts that Gaussians and pictures come at the same steps, a handful in each stage.
fn pictures(contents: &Contents, dataset: &Dataset) {
    let clouds = contents.values::<Position3D>("/world/gaussians", &GaussianSplats3D::descriptor_centers());
    let pictures = contents.values::<Blob>("/world/view", &EncodedImage::descriptor_blob());
    let of_clouds: Vec<i64> = clouds.iter().map(|(step, _)| *step).collect();
    let of_pictures: Vec<i64> = pictures.iter().map(|(step, _)| *step).collect();
    assert_eq!(of_clouds, of_pictures);
    assert!((20..60).contains(&of_clouds.len()), "{of_clouds:?}");
    assert!(of_clouds.is_sorted(), "{of_clouds:?}");
    assert!(clouds.iter().all(|(_, means)| !means.is_empty()));
    let truth = contents.values::<Blob>("/truth", &EncodedImage::descriptor_blob());
    let image = image::load_from_memory(&truth[0].1[0].0).expect("a PNG");
    assert_eq!([image.width(), image.height()], [24, 24]);
    let cameras = contents.entities().iter().filter(|entity| entity.starts_with("/world/cameras/")).count();
    assert_eq!(cameras, dataset.cameras("train").len());
}
