//! Scenes of real tosses, each learned from the first third of its frames, against the rest:
//! `cargo run --release -p lgs-train --example toss_scenes -- DIRECTORY [key=value]…`, where the directory
//! holds tracks `toss_N.safetensors` in metres and seconds of a cube that falls on the table z = 0.
//!
//! Each row is read off the written scene: gravity; the centre at the sample nearest to its first impact; the
//! height of the centre after the last sample over the half-width; the lowest Gaussian.
#![allow(clippy::unwrap_used, reason = "an example")]

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use lgs_data::dataset::Dataset;
use lgs_data::frames::{FrameSequence, read_frames};
use lgs_dynamics::{Edit, Reversal};
use lgs_mechanics::System;
use lgs_model::{GeneralisedDynamics, LagrangianScene, Motion, load_scene};
use lgs_train::{Control, DeviceName, Preset, RunFolder, TrainConfig, train};

/// Half width of the cube, metres.
const HALF: f64 = 0.0524;
/// Gravity as the data measures it (their own scale), metres per second².
const GRAVITY: f64 = 9.64;

/// The scene that a run on the frames before a time has written.
fn learned(
    path: &Path,
    before: f32,
    settings: &[String],
) -> Result<LagrangianScene, Box<dyn std::error::Error>> {
    let folder = tempfile::tempdir()?;
    let own = ["source.kind=frames".to_owned(), format!("source.import={}", path.display())];
    let own = own.into_iter().chain([format!("data.train_before={before}")]);
    let all: Vec<String> = own.chain(settings.iter().cloned()).collect();
    let config = TrainConfig::resolve(Preset::Quick, None, &all)?;
    let dataset = Dataset::none([1.0; 3]);
    let run = RunFolder::create(&folder.path().join("run"), &config, &dataset)?;
    let (stop, device) = (AtomicBool::new(false), DeviceName::Auto.device());
    train(&run, &dataset, &config, &device, &mut Control::new(&stop, &mut |_| {}))?;
    Ok(load_scene(&run.scene_path())?)
}

/// Mean of the points that move at each time.
fn centers(frames: &FrameSequence) -> Vec<[f64; 3]> {
    let first = &frames.positions[0];
    let moves =
        |i: &usize| frames.positions.iter().any(|row| distance(widened(row[*i]), widened(first[*i])) > 0.01);
    let moving: Vec<usize> = (0..first.len()).filter(moves).collect();
    frames.positions.iter().map(|row| mean(moving.iter().map(|&i| row[i]))).collect()
}

fn widened(p: [f32; 3]) -> [f64; 3] {
    p.map(f64::from)
}

fn mean(points: impl ExactSizeIterator<Item = [f32; 3]>) -> [f64; 3] {
    let count = points.len() as f64;
    points.fold([0.0; 3], |sum, p| std::array::from_fn(|i| sum[i] + f64::from(p[i]) / count))
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().sqrt()
}

/// One line of the table.
fn row(name: &str, path: &Path, settings: &[String]) -> Result<String, Box<dyn std::error::Error>> {
    let frames = read_frames(path)?;
    let truth = centers(&frames);
    let scene = learned(path, frames.times[frames.times.len() / 3], settings)?;
    let Some(GeneralisedDynamics { law, start, known, .. }) = scene.objects[0].dynamics.generalised() else {
        return Ok(format!("{name:10} no law in generalised coordinates"));
    };
    let field = law.terms.iter().position(|term| term.kind.name() == "uniform-field").ok_or("no field")?;
    let gravity = -law.parameters[law.range(field).end - 1];
    let until = f64::from(frames.times[frames.times.len() - 1]);
    let impact = System::new(law, lgs_mechanics::Edit::NONE).impacts(start, until)?;
    let touch = impact.first().map_or(until, |impact| impact.time);
    let apart = |k: &usize| (f64::from(frames.times[*k]) - touch).abs();
    let touch = (0..truth.len()).min_by(|a, b| apart(a).total_cmp(&apart(b))).unwrap();
    let mut motion = Motion::new(&scene, Edit::default(), Reversal::default());
    let mut at = |time: f32| motion.state_at(time).q;
    let error = distance(mean(at(frames.times[touch]).into_iter()), truth[touch]);
    let rest = mean(at(until as f32).into_iter())[2] - HALF;
    let end = distance(mean(at(until as f32).into_iter()), truth[truth.len() - 1]);
    let lowest = (0..=200)
        .flat_map(|k| at(until as f32 * k as f32 / 200.0))
        .map(|p| p[2])
        .fold(f32::INFINITY, f32::min);
    let contact = law.contact.as_ref().ok_or("no contact")?;
    let [e, mu] = contact.deviations;
    let told = [1e3 * error, 1e3 * rest, 1e3 * f64::from(lowest), 1e3 * end];
    let [error, rest, lowest, end] = told.map(|millimetres| format!("{millimetres:6.1} mm"));
    let gravity = format!("{gravity:6.3} ({:+5.1} %)", 100.0 * (gravity / GRAVITY - 1.0));
    let constants = format!("{:.2} ± {e:.2}  {:.2} ± {mu:.2}", contact.restitution, contact.friction);
    let claim = format!("{:?} until {:.2}", known.verdict, known.trusted[1]);
    let seen = law.impacts.len();
    Ok(format!("{name:10} {gravity} {error} {rest} {lowest}  {seen}     {constants} {end}  {claim}"))
}

fn main() {
    tracing_subscriber::fmt()
        .with_env_filter(tracing_subscriber::EnvFilter::from_default_env())
        .with_writer(std::io::stderr)
        .init();
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [directory, settings @ ..] = &arguments[..] else {
        eprintln!("usage: toss_scenes DIRECTORY [key=value]…");
        return;
    };
    let mut files: Vec<PathBuf> =
        std::fs::read_dir(directory).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.retain(|path| {
        path.to_string_lossy().ends_with(".safetensors") && !path.to_string_lossy().contains(".poses.")
    });
    files.sort();
    println!(
        "toss       g, m/s²             touch      rest    lowest  seen  restitution  friction        end"
    );
    for path in files {
        let name = path.file_stem().unwrap().to_string_lossy();
        println!("{}", row(&name, &path, settings).unwrap_or_else(|error| format!("{name:10} {error}")));
    }
}
