//! Times what training asks of a device, and of the processor in turns with it, as rows of a Markdown table:
//!
//! `cargo run --release -p lagrangegs -p lgs-train --features lagrangegs/gpu --example device_speed NAME
//! [--tiny]`, with a NAME as `lagrangegs info --devices` lists them.
//!
//! Pairs are those of pixels and Gaussians in the tile lists. Steps are those of the `standard` preset on a
//! generated set, all Gaussians moving.

use std::error::Error;
use std::hint::black_box;
use std::path::Path;
use std::time::Instant;

use burn::tensor::{Device, Tensor, TensorData};
use lgs_core::{Camera, GaussianCloud, stream};
use lgs_data::dataset::{Dataset, LoadOptions};
use lgs_data::synth::{self, SynthOptions};
use lgs_dynamics::tensor::{RolloutCall, rollout};
use lgs_dynamics::{Edit, Supports, System, SystemConfig, VelocityPolicy};
use lgs_render::tensor::{SplatTensors, ViewSpec, photometric_loss, rasterize};
use lgs_render::{Splats, rasterize as rasterize_slices};
use lgs_train::source::{SourceConfig, SourceTrainer};
use lgs_train::{DeviceName, Preset, Trainer};
use rand::RngExt;

const BACKGROUND: [f32; 3] = [1.0; 3];
/// Calls that are timed together, so that a wait for the device is a small part of them.
const CALLS: usize = 10;
/// Times that each is measured; the least counts.
const TURNS: usize = 3;

/// Sizes of the measurements.
struct Sizes {
    gaussians: usize,
    pixels: u32,
    steps: usize,
    /// Particles of a rollout, and its steps.
    rolled: [usize; 2],
}

/// A scene on a device.
struct Scene {
    splats: SplatTensors,
    target: Tensor<3>,
    view: ViewSpec,
}

fn leaf<const D: usize>(values: &[f32], shape: [usize; D], device: &Device) -> Tensor<D> {
    Tensor::from_data(TensorData::new(values.to_vec(), shape), device).require_grad()
}

impl Scene {
    fn new(cloud: &GaussianCloud, camera: Camera, device: &Device) -> Self {
        let (n, size) = (cloud.means.len(), [camera.height as usize, camera.width as usize, 3]);
        let splats = SplatTensors {
            means: leaf(cloud.means.as_flattened(), [n, 3], device),
            rotations: leaf(cloud.rotations.as_flattened(), [n, 4], device),
            log_scales: leaf(cloud.log_scales.as_flattened(), [n, 3], device),
            raw_opacities: leaf(&cloud.raw_opacities, [n], device),
            sh: leaf(&cloud.sh, [n, cloud.sh.len() / (3 * n), 3], device),
            means2d_probe: Tensor::zeros([n, 2], device),
            pose_probe: Tensor::zeros([6], device),
        };
        let view = ViewSpec { camera, background: BACKGROUND, active_degree: cloud.sh_degree };
        Self { splats, target: Tensor::zeros(size, device), view }
    }

    /// Draws so many times; waits for the last.
    fn forward(&self) {
        let mut image = None;
        for _ in 0..CALLS {
            image = Some(rasterize(&self.splats, self.view).image);
        }
        black_box(image.map(|image| image.inner().sum().into_data()));
    }

    /// Draws, compares and pulls back so many times; waits for the last.
    fn both(&self) {
        let mut gradient = None;
        for _ in 0..CALLS {
            let image = rasterize(&self.splats, self.view).image;
            let gradients = photometric_loss(image, self.target.clone(), 0.2).backward();
            gradient = self.splats.means.grad(&gradients);
        }
        black_box(gradient.map(|gradient| gradient.sum().into_data()));
    }
}

/// The least seconds of two measurements, taken in turns.
fn least(mut runs: [&mut dyn FnMut(); 2]) -> [f64; 2] {
    let mut least = [f64::INFINITY; 2];
    for turn in 0..=TURNS {
        for (run, least) in runs.iter_mut().zip(&mut least) {
            let begun = Instant::now();
            run();
            // The first turn compiles kernels and finds the room of tile lists.
            if turn > 0 {
                *least = least.min(begun.elapsed().as_secs_f64());
            }
        }
    }
    least
}

/// A ball of flat Gaussians, most of them faint.
fn ball(count: usize) -> GaussianCloud {
    let mut rng = stream(1, "ball", 0);
    let mut means = Vec::new();
    while means.len() < count {
        let point: [f32; 3] = std::array::from_fn(|_| rng.random_range(-1.0..1.0));
        if point.iter().map(|v| v * v).sum::<f32>() < 1.0 {
            means.push(point);
        }
    }
    let scale = 0.6 * (13.0 / count as f32).sqrt();
    let mut cloud = GaussianCloud::isotropic(means, scale, [0.6, 0.4, 0.3], 0.3);
    for (logit, scales) in cloud.raw_opacities.iter_mut().zip(&mut cloud.log_scales) {
        *logit += rng.random_range(-2.0..3.0);
        scales[2] -= 1.5;
    }
    cloud
}

fn rasterizer(sizes: &Sizes, devices: &[Device; 2]) {
    let camera = Camera::look_at([0.9, -3.0, 1.5], [0.0; 3], 0.75, sizes.pixels, sizes.pixels);
    let cloud = ball(sizes.gaussians);
    let pairs = rasterize_slices(&Splats::from(&cloud), &camera, BACKGROUND).listed_pairs();
    let scenes = devices.each_ref().map(|device| Scene::new(&cloud, camera, &device.clone().autodiff()));
    let rates = |secs: [f64; 2]| secs.map(|secs| CALLS as f64 * pairs as f64 / secs * 1e-9);
    let [one, other] = &scenes;
    let of = format!("{} Gaussians, {1} × {1}", sizes.gaussians, sizes.pixels);
    row(
        &format!("rasterizer, forward ({of}), G pairs/s"),
        rates(least([&mut || one.forward(), &mut || other.forward()])),
    );
    row(
        "the same with loss and backward, G pairs/s",
        rates(least([&mut || one.both(), &mut || other.both()])),
    );
}

/// Rolls particles by the paper's networks with alignment, and pulls back; waits for the end.
fn roll(system: &System, points: &[[f32; 3]], call: &RolloutCall, device: &Device) {
    let n = points.len();
    let params = leaf(&system.params, [system.params.len()], device);
    let q = leaf(points.as_flattened(), [n, 3], device);
    let states = rollout(params.clone(), q, Tensor::zeros([n, 3], device), call.clone());
    let gradients = states.sum().backward();
    black_box(params.grad(&gradients).map(|gradient| gradient.sum().into_data()));
}

fn rollouts(sizes: &Sizes, devices: &[Device; 2]) {
    let [n, steps] = sizes.rolled;
    let (points, system) = (ball(n).means, System::init(SystemConfig::paper(), 0));
    let call = RolloutCall {
        config: system.config,
        dt: 0.01,
        steps,
        last_dt: None,
        edit: Edit::default(),
        supports: Some(Supports::nearest(&points, 16).into()),
        velocity_policy: VelocityPolicy::Keep,
    };
    let [one, other] = devices.each_ref().map(|device| device.clone().autodiff());
    let run = |device: &Device| roll(&system, &points, &call, device);
    let secs = least([&mut || run(&one), &mut || run(&other)]);
    let rates = secs.map(|secs| (n * steps) as f64 / secs * 1e-6);
    row(&format!("rollout with alignment and backward ({n} particles, {steps} steps), M steps/s"), rates);
}

fn trainer<'a>(
    dataset: &'a Dataset,
    sizes: &Sizes,
    device: &Device,
) -> Result<SourceTrainer<'a>, Box<dyn Error>> {
    let mut config = SourceConfig::preset(lgs_model::source::SourceKind::Defgs, Preset::Standard);
    (config.initial_gaussians, config.warmup_iterations) = (sizes.gaussians, 0);
    config.densify.before = 0;
    Ok(SourceTrainer::new(dataset, &config, 0, device)?)
}

fn training(sizes: &Sizes, devices: &[Device; 2], folder: &Path) -> Result<(), Box<dyn Error>> {
    let options = SynthOptions { size: sizes.pixels, views: 6, train_fps: 12, ..SynthOptions::default() };
    synth::generate("falling-ball", &options, folder, &|_, _| {})?;
    let dataset = Dataset::load(folder, &LoadOptions::default(), &|_, _| {})?;
    let [mut one, mut other] =
        [trainer(&dataset, sizes, &devices[0])?, trainer(&dataset, sizes, &devices[1])?];
    let steps = |trainer: &mut SourceTrainer<'_>| {
        let mut report = None;
        for _ in 0..sizes.steps {
            report = Some(trainer.step());
        }
        black_box(report.map(|report| report.figures()));
    };
    let secs = least([&mut || steps(&mut one), &mut || steps(&mut other)]);
    row("training (`standard`, deformation network), steps/s", secs.map(|secs| sizes.steps as f64 / secs));
    Ok(())
}

/// A row: figures of the device and of the processor.
fn row(name: &str, [device, processor]: [f64; 2]) {
    println!("| {name} | {device:.3} | {processor:.3} | {:.2} × |", device / processor);
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let name: DeviceName = arguments.first().ok_or("usage: device_speed NAME [--tiny]")?.parse()?;
    let sizes = if arguments.iter().any(|argument| argument == "--tiny") {
        Sizes { gaussians: 300, pixels: 32, steps: 4, rolled: [64, 4] }
    } else {
        Sizes { gaussians: 100_000, pixels: 800, steps: 50, rolled: [4096, 75] }
    };
    let devices = [name.open()?, DeviceName::Cpu.open()?];
    let folder = tempfile::tempdir()?;
    println!("| | {name} | processor | ratio |\n|---|---|---|---|");
    rasterizer(&sizes, &devices);
    rollouts(&sizes, &devices);
    training(&sizes, &devices, &folder.path().join("data"))
}
