//! `lagrangegs report`: the figures of a run and `report.html`, from the metrics that `eval` left.

use std::path::PathBuf;

use anyhow::{Result, bail};
use lgs_core::Camera;
use lgs_eval::{Metrics, Subject};
use lgs_report::{Curve, FIGURES, RunSubject, read_metrics, write_run_report};
use lgs_train::checkpoint::Stage;
use lgs_train::events::read_events;

use super::evidence::Evidence;
use super::failure::At;
use super::output;
use super::progress::Task;
use super::run::Run;

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Folder of the run
    run: PathBuf,
    /// Dataset, if it is no longer where training found it; a run without one has no figures of true images
    #[arg(long, value_name = "DATA")]
    data: Option<PathBuf>,
}

pub(super) fn run(args: &Args) -> Result<()> {
    let run = Run::open(&args.run)?;
    run.check_writable()?;
    let Some(metrics) = read_metrics(&args.run).at(&args.run)? else {
        bail!("the run has not been evaluated; call `lagrangegs eval` first: {}", args.run.display());
    };
    let background = Background::read(&run)?;
    // Only a dataset that is named has to be there.
    let root = run
        .dataset_path(args.data.as_deref())
        .ok()
        .flatten()
        .filter(|root| args.data.is_some() || root.is_dir());
    let evidence = Evidence::load(&run, root.as_deref())?;
    background.write_report(&run, &evidence.subject(&run), &metrics)?;
    let root = run.folder.root();
    output::print(&format!(
        "report   {}\nfigures  {}\n",
        root.join("report.html").display(),
        root.join(FIGURES).display()
    ))
}

/// What a report shows of a run beside its scene and metrics.
pub(super) struct Background {
    cameras: Vec<Camera>,
    training: Vec<Curve>,
    config: String,
}

impl Background {
    /// Reads it from the run's files.
    pub(super) fn read(run: &Run) -> Result<Self> {
        let config = run.folder.config_path();
        Ok(Self {
            cameras: run.cameras()?.into_iter().map(|(_, camera)| camera).collect(),
            training: training_curves(run)?,
            config: std::fs::read_to_string(&config).at(&config)?,
        })
    }

    /// Writes the run's figures and `report.html`.
    pub(super) fn write_report(&self, run: &Run, subject: &Subject<'_>, metrics: &Metrics) -> Result<()> {
        let _span = tracing::trace_span!("report").entered();
        let _task = Task::new("figures", 0);
        let root = run.folder.root();
        let report = RunSubject {
            title: &root.display().to_string(),
            scene: subject.scene,
            source: subject.source,
            dataset: subject.dataset,
            truth: subject.truth,
            cameras: &self.cameras,
            metrics,
            training: &self.training,
            config: &self.config,
        };
        write_run_report(root, &report).at(root)?;
        Ok(())
    }
}

/// PSNR by step of every stage that renders, from the run's events; a line that a crash cut short is left
/// out.
fn training_curves(run: &Run) -> Result<Vec<Curve>> {
    let events = read_events(&run.folder.events_path()).at(&run.folder.events_path())?;
    let curve = |stage: Stage| {
        let own = events.iter().filter(|event| event.stage == stage.name());
        let points =
            own.filter_map(|event| event.psnr.map(|psnr| (event.step as f64, f64::from(psnr)))).collect();
        Curve { stage: stage.name().to_owned(), points }
    };
    Ok(Stage::ALL.into_iter().map(curve).filter(|curve| !curve.points.is_empty()).collect())
}
