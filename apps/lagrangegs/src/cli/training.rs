//! Training behind progress bars: one call for every command that trains, its cost, and Ctrl-C.

use std::path::Path;
use std::time::Instant;

use anyhow::Result;
use lgs_data::dataset::Dataset;
use lgs_eval::Cost;
use lgs_eval::memory::{peak_rss_bytes, reset_peak_rss};
use lgs_train::checkpoint::Stage;
use lgs_train::device::Device;
use lgs_train::{
    Control, Progress, RunFolder, TrainConfig, TrainError, Trained, check_window, imported_source,
    learns_no_motion,
};

use super::failure::At;
use super::interrupt::Training;
use super::outlook::Outlook;
use super::progress::{Task, say};
use super::run::{load_dataset, load_options, read_cost, write_cost};
use super::watchers::{Seats, Watchers};

/// A training run: its data, its folder and its settings.
pub(super) struct Request<'a> {
    /// The dataset; without one, an imported source is distilled, and that is all.
    pub(super) data: Option<&'a Path>,
    /// Folder of the run.
    pub(super) out: &'a Path,
    pub(super) config: TrainConfig,
    /// Whether to continue from the latest checkpoint of a run that exists.
    pub(super) resume: bool,
    /// Run whose trained source is taken over.
    pub(super) source_from: Option<&'a Path>,
    pub(super) device: &'a Device,
    /// Port of a page that shows the models while they are trained.
    pub(super) view: Option<u16>,
    /// Recording of rerun to write while they are trained.
    pub(super) rerun: Option<&'a Path>,
}

/// Trains behind progress bars; Ctrl-C leaves a checkpoint, a second one ends the program at once.
pub(super) fn train(request: &Request<'_>) -> Result<Trained> {
    // What came before in this process is no part of training.
    reset_peak_rss();
    if !request.resume {
        RunFolder::check_free(request.out).at(request.out)?;
    }
    let mut cost = read_cost(request.out)?;
    let seats = Seats::take(request.view, request.rerun, (request.out, &request.config))?;
    let dataset = checked_images(request)?;
    let folder = run_folder(request, &dataset)?;
    let begun = Instant::now();
    let outlook = if request.resume || request.source_from.is_some() {
        Outlook::none()
    } else {
        Outlook::announce(&dataset, &request.config, request.device)?
    };
    if let Some(from) = request.source_from {
        folder.adopt_source(&request.config, from).at(from)?;
        if cost == Cost::default() {
            cost = cost_of_source(from)?;
        }
    }
    cost.peak_rss_bytes = cost.peak_rss_bytes.max(peak_rss_bytes());
    let watchers = seats.watchers(&folder, &request.config, &dataset);
    let trained = with_bars(request, (&folder, &dataset), &watchers, (&mut cost, outlook));
    let recorded = watchers.finish();
    cost.train_secs = Some(cost.train_secs.unwrap_or(0.0) + begun.elapsed().as_secs_f64());
    if matches!(trained, Ok(_) | Err(TrainError::Interrupted { .. })) {
        write_cost(request.out, &cost)?;
    }
    let trained = trained.at(request.out)?;
    recorded.at(request.out)?;
    Ok(trained)
}

/// The training images, and a look at whether they and what is imported can be trained on, before a folder is
/// made for the run.
fn checked_images(request: &Request<'_>) -> Result<Dataset> {
    let dataset = training_images(request)?;
    check_window(&dataset, &request.config)?;
    if learns_no_motion(&dataset, &request.config) {
        say("a still scene: all training images are of one time, and no motion is learned");
    }
    if !request.config.source.import.is_empty() {
        // Training reads it again.
        imported_source(&request.config, &dataset).at(Path::new(&request.config.source.import))?;
    }
    Ok(dataset)
}

fn run_folder(request: &Request<'_>, dataset: &Dataset) -> Result<RunFolder> {
    if request.resume {
        return Ok(RunFolder::open(request.out).at(request.out)?.0);
    }
    RunFolder::create(request.out, &request.config, dataset).at(request.out)
}

/// Cost of the source of a run: a run that takes the source over counts it as its own.
fn cost_of_source(root: &Path) -> Result<Cost> {
    let mut cost = Cost::default();
    if let Some(source) = read_cost(root)?.stages.iter().find(|stage| stage.stage == Stage::Source.name()) {
        cost.add_stage(&source.stage, source.secs, source.peak_rss_bytes);
        cost.train_secs = Some(source.secs);
    }
    Ok(cost)
}

fn training_images(request: &Request<'_>) -> Result<Dataset> {
    let options = load_options(&request.config, Some(vec!["train".to_owned()]));
    match request.data {
        Some(data) => {
            let dataset = load_dataset(&std::path::absolute(data).at(data)?, &options)?;
            dataset.remarks.iter().for_each(|remark| tracing::warn!("{remark}"));
            Ok(dataset)
        }
        None => Ok(Dataset::none(if options.white_background { [1.0; 3] } else { [0.0; 3] })),
    }
}

/// The stage that runs, with its progress bar.
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
    (folder, dataset): (&RunFolder, &Dataset),
    watchers: &Watchers<'_>,
    (cost, mut outlook): (&mut Cost, Outlook),
) -> Result<Trained, TrainError> {
    let interruptible = Training::begin();
    let stop = interruptible.stop();
    let mut current: Option<Running> = None;
    let mut progress = |p: Progress| {
        if current.as_ref().is_none_or(|running| running.stage != p.stage) {
            // The old bar goes before the new one comes.
            current.take().into_iter().for_each(|running| running.end(cost));
            current = Some(Running::start(&p));
        }
        let left = outlook.left(&p);
        if let Some(running) = &current {
            running.task.set(p.step as u64, p.steps as u64, || message(&p, left.as_deref()));
        }
        watchers.report(&p, stop);
    };
    let trained = {
        let mut watching = watchers.onlookers();
        let mut control = Control::new(stop, &mut progress);
        watching.iter_mut().for_each(|onlooker| control.onlookers.push(&mut **onlooker));
        lgs_train::train(folder, dataset, &request.config, request.device, &mut control)
    };
    current.into_iter().for_each(|running| running.end(cost));
    trained
}

fn message(p: &Progress, left: Option<&str>) -> String {
    let quality = p.psnr.map_or_else(|| format!("loss {:.3e}", p.loss), |psnr| format!("PSNR {psnr:.2} dB"));
    let left = left.map_or_else(String::new, |left| format!(", {left}"));
    format!("{quality}, {} Gaussians{left}", p.gaussians)
}
