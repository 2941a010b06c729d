//! `lagrangegs demo`: a synthetic dataset, a run trained on it, its metrics, and pictures of its future, its
//! past and other physics.
//!
//! Called again on the same folder it continues where it was interrupted.

use std::path::{Path, PathBuf};

use anyhow::Result;
use lgs_core::{Camera, Image};
use lgs_data::dataset::{Dataset, DatasetFormat};
use lgs_data::synth::SynthOptions;
use lgs_dynamics::{Edit, Reversal};
use lgs_eval::EvalOptions;
use lgs_eval::table::table;
use lgs_model::Motion;
use lgs_report::sheet::{Row, contact_sheet, evenly};
use lgs_report::{longest_view, spread_in_time};
use lgs_train::config::Preset;
use lgs_train::{RunFolder, TrainError};

use super::device::DeviceArgs;
use super::drawing::{Job, Label, time_label};
use super::eval::measure;
use super::failure::At;
use super::output::{self, prepare_folder, refuse_inside_dataset, write_png};
use super::progress::say;
use super::run::Run;
use super::shots::orbit;
use super::times::Times;
use super::train::{configured, refuse_change};
use super::trust::ModelName;
use super::trust::{Mark, trust_in};
use super::{synth, training};

/// Azimuth that the demo's pictures are taken from, degrees.
const AZIMUTH: f32 = 30.0;

/// Columns of the sheets.
const COLUMNS: usize = 8;

/// Scales of the potential that are shown beside each other.
const POTENTIAL_SCALES: [f32; 3] = [0.25, 1.0, 2.0];

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Folder for everything
    #[arg(long, default_value = "runs/demo")]
    out: PathBuf,
    /// Synthetic scene
    #[arg(long, default_value = "falling-ball")]
    scene: String,
    /// Width and height of the images, pixels [default: 160]
    #[arg(long, value_name = "PX")]
    size: Option<u32>,
    /// Training views [default: 12]
    #[arg(long)]
    views: Option<usize>,
    /// Setting laid over the quick preset; may be repeated
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    #[command(flatten)]
    device: DeviceArgs,
}

pub(super) fn run(args: &Args) -> Result<()> {
    synth::check_call(&args.scene, &args.images())?;
    refuse_inside_dataset(&args.out)?;
    let config = configured(Preset::Quick, None, &args.set)?;
    args.device.open()?;
    prepare_folder(&args.out)?;
    let (data, root) = (args.out.join("data"), args.out.join("run"));
    make_dataset(args, &data)?;
    let resume = root.join("config.toml").exists();
    if resume {
        let (_, own) = RunFolder::open(&root).at(&root)?;
        refuse_change(own.first_difference(&config).map_err(TrainError::from).at(&root)?, &root)?;
    }
    args.device.run(|device| {
        training::train(&training::Request {
            data: Some(&data),
            out: &root,
            config,
            resume,
            source_from: None,
            view: None,
            rerun: None,
            device,
        })
    })?;
    let run = Run::open(&root)?;
    let metrics = measure(&run, Some(&data), &EvalOptions::default())?;
    let renders = root.join("renders");
    pictures(&run, &renders)?;
    let dataset = run.images(&data, None)?;
    comparison(&run, &dataset, &renders.join("comparison.png"))?;
    output::print(&format!(
        "{}\nreport    {}\npictures  {}\nrun       {}\n",
        table(&metrics),
        root.join("report.html").display(),
        renders.display(),
        root.display()
    ))
}

/// Makes the dataset unless it is there.
fn make_dataset(args: &Args, data: &Path) -> Result<()> {
    if DatasetFormat::detect(data).is_some() {
        say(&format!("using the dataset that is there: {}", data.display()));
        return Ok(());
    }
    synth::make(&args.scene, &args.images(), data)
}

impl Args {
    /// Options of the synthetic images.
    fn images(&self) -> SynthOptions {
        let default = SynthOptions::default();
        let (size, views) = (self.size.unwrap_or(default.size), self.views.unwrap_or(default.views));
        SynthOptions { size, views, ..default }
    }
}

/// The future, the past, and the same start under other potentials.
fn pictures(run: &Run, folder: &Path) -> Result<()> {
    let camera = orbit(run)?.at(AZIMUTH);
    let window = run.scene.motion.time_window;
    let job = |times: Vec<f32>, edit: Edit| -> Result<Job> {
        let model = ModelName::Lagrangian;
        let trust = trust_in(run, model, edit)?;
        let (cameras, reversal) = (vec![camera; times.len()], Reversal::Exact);
        let (mark, label) = (Mark::default(), Label::default());
        Ok(Job { model, cameras, times, edit, reversal, trust, mark, label })
    };
    job(steps(window, 3.0 * window), Edit::default())?.write(&run.scene, &folder.join("future"))?;
    job(steps(-window, 0.0), Edit::default())?.write(&run.scene, &folder.join("past"))?;
    let times = steps(0.0, 2.0 * window);
    let mut rows = Vec::new();
    for beta in POTENTIAL_SCALES {
        let edit = Edit { potential_scale: beta, ..Edit::default() };
        let images =
            job(times.clone(), edit)?.write(&run.scene, &folder.join(format!("potential-{beta}")))?;
        let chosen = evenly(images.len(), COLUMNS);
        rows.push(Row {
            title: format!("β = {beta}"),
            frames: chosen.iter().map(|&i| images[i].clone()).collect(),
        });
    }
    let labels: Vec<String> = evenly(times.len(), COLUMNS).iter().map(|&i| time_label(times[i])).collect();
    write_png(&folder.join("potential-scales.png"), &contact_sheet(&labels, &rows))
}

/// Thirty steps from one time to another.
fn steps(from: f32, to: f32) -> Vec<f32> {
    const STEPS: usize = 30;
    (0..=STEPS).map(|i| from + (to - from) * i as f32 / STEPS as f32).collect()
}

/// Truth, source model and Lagrangian scene as one camera of the dataset sees them, over all the times at
/// which it has images.
fn comparison(run: &Run, dataset: &Dataset, path: &Path) -> Result<()> {
    let frames = longest_view(dataset);
    if frames.is_empty() {
        return Ok(());
    }
    let times = Times(frames.iter().map(|f| f.time).collect());
    times.check(&run.scene.motion, &dataset.root)?;
    let chosen = spread_in_time(&frames, COLUMNS);
    let background = run.scene.background;
    let mut motion = Motion::new(&run.scene, Edit::default(), Reversal::Exact);
    let draw =
        |cloud: &lgs_core::GaussianCloud, camera: &Camera| lgs_eval::render(cloud, camera, background).image;
    let row = |title: &str, frames: Vec<Image>| Row { title: title.to_owned(), frames };
    let mut rows = vec![row("truth", chosen.iter().map(|f| f.composited(background)).collect())];
    if let Some(source) = run.source()? {
        rows.push(row("source", chosen.iter().map(|f| draw(&source.cloud_at(f.time), &f.camera)).collect()));
    }
    rows.push(row(
        "lagrangian",
        chosen
            .iter()
            .map(|f| draw(&run.scene.cloud_at(&motion.state_at(f.time), f.time), &f.camera))
            .collect(),
    ));
    let labels: Vec<String> = chosen.iter().map(|f| time_label(f.time)).collect();
    write_png(path, &contact_sheet(&labels, &rows))
}
