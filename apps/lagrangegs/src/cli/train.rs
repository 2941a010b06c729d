//! `lagrangegs train`.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use anyhow::{Context, Result, bail};
use clap::ValueEnum;
use lgs_data::dataset::{Dataset, DatasetFormat};
use lgs_eval::Cost;
use lgs_eval::memory::{peak_rss_bytes, reset_peak_rss};
use lgs_model::source::imported_kind;
use lgs_train::checkpoint::Stage;
use lgs_train::config::Preset;
use lgs_train::device::Device;
use lgs_train::{Control, Progress, RunFolder, TrainConfig, TrainError, Trained, imported_source};

use super::ablation::Ablations;
use super::device::DeviceArgs;
use super::failure::At;
use super::output::{self, refuse_inside_dataset};
use super::progress::{Task, say};
use super::run::{dataset_format, load_dataset, load_options, read_cost, write_cost};

/// Exit code of a program that a second Ctrl-C ended.
const ABORTED: i32 = 130;

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Dataset; with `--source frames` and no `--import`, the frames themselves
    #[arg(required_unless_present = "import")]
    data: Option<PathBuf>,
    /// Format of the dataset [default: detected]
    #[arg(long, value_name = "NAME", value_parser = dataset_format)]
    format: Option<DatasetFormat>,
    /// Folder of the run, new or (with --resume) one that was begun
    #[arg(long, value_name = "RUN")]
    out: PathBuf,
    /// Model that learns the motion from the images [default: defgs]
    #[arg(long, value_enum, value_name = "SOURCE")]
    source: Option<Source>,
    /// Take the source model from here instead of training it: a folder of .ply frames, a .safetensors of
    /// trajectories, or an output folder of the DefGS authors' program; without a dataset, stage 1 is all
    /// that is done
    #[arg(long, value_name = "PATH")]
    import: Option<PathBuf>,
    /// Defaults to start from [default: quick]
    #[arg(long, value_enum, value_name = "PRESET")]
    preset: Option<PresetName>,
    /// TOML file laid over the preset
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Setting laid over preset and file, such as source.iterations=500; may be repeated
    #[arg(long, value_name = "KEY=VALUE", value_parser = key_value)]
    set: Vec<String>,
    #[command(flatten)]
    device: DeviceArgs,
    /// Seed of every random draw
    #[arg(long)]
    seed: Option<u64>,
    /// Continue from the run's latest checkpoint
    #[arg(long)]
    resume: bool,
    #[command(flatten)]
    ablations: Ablations,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Source {
    /// Deformable 3D Gaussians
    Defgs,
    /// A deformation that a field of rigid velocities carries on
    Freegave,
    /// Trajectories from elsewhere
    Frames,
}

impl Source {
    /// Its name in configurations.
    fn name(self) -> &'static str {
        match self {
            Self::Defgs => "defgs",
            Self::Freegave => "freegave",
            Self::Frames => "frames",
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum PresetName {
    /// Minutes on two processor cores
    Quick,
    /// As published; hours to days on a processor
    Paper,
}

fn key_value(text: &str) -> Result<String, String> {
    if text.split_once('=').is_some_and(|(key, _)| !key.trim().is_empty()) {
        Ok(text.to_owned())
    } else {
        Err("expected KEY=VALUE".to_owned())
    }
}

pub(super) fn run(args: &Args) -> Result<()> {
    refuse_inside_dataset(&args.out)?;
    let request = Request {
        data: args.paths().0,
        out: &args.out,
        config: resolve(args)?,
        resume: args.resume,
        source_from: None,
        device: &args.device.device(),
    };
    train(&request)?;
    output::print(&format!("{}\n", args.out.display()))
}

impl Args {
    /// Dataset, and what to import: the one path of `--source frames PATH` is the frames.
    fn paths(&self) -> (Option<&Path>, Option<&Path>) {
        match (self.data.as_deref(), self.import.as_deref()) {
            (frames, None) if self.source == Some(Source::Frames) => (None, frames),
            paths => paths,
        }
    }

    /// Settings of the source: its kind, which files to import decide if nothing else does, and these files.
    fn source_settings(&self) -> Result<Vec<String>> {
        let Some(import) = self.paths().1 else {
            return Ok(self.source.iter().map(|source| format!("source.kind={}", source.name())).collect());
        };
        // An official model is a source that could have been trained here, whatever it is called.
        let kind = match (imported_kind(import), self.source) {
            (found, None | Some(Source::Frames)) => found.name(),
            (_, Some(named)) => named.name(),
        };
        let path = std::path::absolute(import).at(import)?;
        Ok(vec![format!("source.kind={kind}"), format!("source.import={}", path.display())])
    }
}

/// The configuration asked for; with `--resume` the run's own, which flags may repeat but not change.
fn resolve(args: &Args) -> Result<TrainConfig> {
    let preset = match args.preset {
        Some(PresetName::Paper) => Preset::Paper,
        _ => Preset::Quick,
    };
    let mut sets = args.source_settings()?;
    sets.extend(args.format.map(|format| format!("data.format={}", format.name())));
    sets.extend(args.ablations.settings());
    sets.extend_from_slice(&args.set);
    sets.extend(args.seed.map(|seed| format!("seed={seed}")));
    let asked =
        || TrainConfig::resolve(preset, args.config.as_deref(), &sets).context("the configuration is wrong");
    if !args.resume {
        return asked();
    }
    let (_, own) = RunFolder::open(&args.out).at(&args.out).context("there is no run to resume")?;
    let any = args.preset.is_some() || args.config.is_some() || !sets.is_empty();
    if any && asked()?.hash() != own.hash() {
        bail!(
            "the run was begun with another configuration; leave the settings out to resume it: {}",
            args.out.display()
        );
    }
    Ok(own)
}

/// What to train, from what, into which folder.
pub(super) struct Request<'a> {
    /// Nothing: an imported source is distilled, and that is all.
    pub(super) data: Option<&'a Path>,
    pub(super) out: &'a Path,
    pub(super) config: TrainConfig,
    pub(super) resume: bool,
    /// Run whose trained source is taken over.
    pub(super) source_from: Option<&'a Path>,
    pub(super) device: &'a Device,
}

/// Trains behind progress bars; Ctrl-C leaves a checkpoint, a second one ends the program at once.
pub(super) fn train(request: &Request<'_>) -> Result<Trained> {
    // What came before in this process is no part of training.
    reset_peak_rss();
    let dataset = training_images(request)?;
    if !request.config.source.import.is_empty() {
        // Before a folder is made for the run; training reads it again.
        imported_source(&request.config, request.data.is_some())
            .at(Path::new(&request.config.source.import))?;
    }
    let folder = if request.resume {
        RunFolder::open(request.out).at(request.out)?.0
    } else {
        RunFolder::create(request.out, &request.config, &dataset).at(request.out)?
    };
    let begun = Instant::now();
    let mut cost = read_cost(request.out);
    if let Some(from) = request.source_from {
        folder.adopt_source(&request.config, from).at(from)?;
        if cost == Cost::default() {
            cost = cost_of_source(from);
        }
    }
    cost.peak_rss_bytes = cost.peak_rss_bytes.max(peak_rss_bytes());
    let trained = with_bars(request, &folder, &dataset, &mut cost);
    cost.train_secs = Some(cost.train_secs.unwrap_or(0.0) + begun.elapsed().as_secs_f64());
    if matches!(trained, Ok(_) | Err(TrainError::Interrupted { .. })) {
        write_cost(request.out, &cost)?;
    }
    trained.at(request.out)
}

/// What the source of a run took: a run that takes it over counts it as its own.
fn cost_of_source(root: &Path) -> Cost {
    let mut cost = Cost::default();
    if let Some(source) = read_cost(root).stages.iter().find(|stage| stage.stage == Stage::Source.name()) {
        cost.add_stage(&source.stage, source.secs, source.peak_rss_bytes);
        cost.train_secs = Some(source.secs);
    }
    cost
}

fn training_images(request: &Request<'_>) -> Result<Dataset> {
    let options = load_options(&request.config, Some(vec!["train".to_owned()]));
    match request.data {
        Some(data) => load_dataset(&std::path::absolute(data).at(data)?, &options),
        None => Ok(Dataset::none(if options.white_background { [1.0; 3] } else { [0.0; 3] })),
    }
}

/// A stage under way.
struct Running {
    stage: Stage,
    task: Task,
    begun: Instant,
}

impl Running {
    fn start(p: &Progress) -> Self {
        reset_peak_rss();
        Self { stage: p.stage, task: Task::new(p.stage.name(), p.steps as u64), begun: Instant::now() }
    }

    fn end(self, cost: &mut Cost) {
        cost.add_stage(self.stage.name(), self.begun.elapsed().as_secs_f64(), peak_rss_bytes());
    }
}

fn with_bars(
    request: &Request<'_>,
    folder: &RunFolder,
    dataset: &Dataset,
    cost: &mut Cost,
) -> Result<Trained, TrainError> {
    let stop = stop_flag();
    let mut current: Option<Running> = None;
    let mut progress = |p: Progress| {
        if current.as_ref().is_none_or(|running| running.stage != p.stage) {
            // The old bar goes before the new one comes.
            current.take().into_iter().for_each(|running| running.end(cost));
            current = Some(Running::start(&p));
        }
        if let Some(running) = &current {
            running.task.set(p.step as u64, p.steps as u64, || message(&p));
        }
    };
    let mut control = Control { stop: &stop, progress: &mut progress };
    let trained = lgs_train::train(folder, dataset, &request.config, request.device, &mut control);
    current.into_iter().for_each(|running| running.end(cost));
    trained
}

fn message(p: &Progress) -> String {
    let quality = p.psnr.map_or_else(|| format!("loss {:.3e}", p.loss), |psnr| format!("PSNR {psnr:.2} dB"));
    format!("{quality}, {} Gaussians", p.gaussians)
}

/// Whether Ctrl-C was pressed while something trained.
pub(super) fn is_stopping() -> bool {
    stop_flag().load(Ordering::Relaxed)
}

/// A flag that Ctrl-C raises. The handler is set once per process; later calls share its flag.
fn stop_flag() -> Arc<AtomicBool> {
    static FLAG: std::sync::OnceLock<Arc<AtomicBool>> = std::sync::OnceLock::new();
    let flag = FLAG.get_or_init(|| {
        let flag = Arc::new(AtomicBool::new(false));
        let raised = Arc::clone(&flag);
        let handler = move || {
            if raised.swap(true, Ordering::SeqCst) {
                std::process::exit(ABORTED);
            }
            say("stopping at the next step; Ctrl-C again aborts without a checkpoint");
        };
        if let Err(error) = ctrlc::set_handler(handler) {
            tracing::warn!("Ctrl-C will not leave a checkpoint: {error}");
        }
        flag
    });
    Arc::clone(flag)
}
