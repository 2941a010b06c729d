//! `lagrangegs eval`.

use std::path::{Path, PathBuf};

use anyhow::Result;
use lgs_data::files::write_atomically;
use lgs_eval::table::table;
use lgs_eval::{EvalOptions, Metrics, Subject, evaluate};

use super::device::DeviceArgs;
use super::evidence::Evidence;
use super::failure::At;
use super::output;
use super::progress::Task;
use super::report::write_report;
use super::run::Run;
use super::weights::perceptual;

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Folder of the run
    run: PathBuf,
    /// Splits to score, separated by commas [default: all that the dataset has]
    #[arg(long, value_delimiter = ',', value_name = "NAMES", value_parser = split_name)]
    split: Option<Vec<String>>,
    /// Dataset, if it is no longer where training found it
    #[arg(long, value_name = "DATA")]
    data: Option<PathBuf>,
    /// Compare images at half their size, as the published figures of single objects
    #[arg(long)]
    half_resolution: bool,
    /// Leave LPIPS out, which takes long, even if there are weights for it
    #[arg(long)]
    no_lpips: bool,
    /// Print one JSON document instead of a table
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    device: DeviceArgs,
}

fn split_name(text: &str) -> Result<String, String> {
    let name = text.trim();
    if name.is_empty() { Err("a split needs a name".to_owned()) } else { Ok(name.to_owned()) }
}

pub(super) fn run(args: &Args) -> Result<()> {
    let run = Run::open(&args.run)?;
    let metrics = args.device.run(|device| {
        let perceptual = if args.no_lpips { None } else { perceptual(device)? };
        let options = EvalOptions {
            half_resolution: args.half_resolution,
            perceptual: perceptual.as_ref(),
            ..EvalOptions::default()
        };
        measure(&run, args.data.as_deref(), args.split.clone(), &options)
    })?;
    if args.json { output::print_json(&metrics) } else { output::print(&table(&metrics)) }
}

/// Computes a run's metrics and writes them into its folder, as `metrics.json`, as figures and as a page.
pub(super) fn measure(
    run: &Run,
    data: Option<&Path>,
    splits: Option<Vec<String>>,
    options: &EvalOptions<'_>,
) -> Result<Metrics> {
    let evidence = Evidence::load(run, run.dataset_path(data)?.as_deref(), splits)?;
    let subject = evidence.subject(run);
    let mut metrics = scored(&subject, options);
    metrics.cost = run.cost();
    metrics.cameras = run.camera_corrections()?;
    let path = run.folder.root().join("metrics.json");
    write_atomically(&path, |w| serde_json::to_writer_pretty(w, &metrics).map_err(Into::into)).at(&path)?;
    write_report(run, &subject, &metrics)?;
    Ok(metrics)
}

fn scored(subject: &Subject<'_>, options: &EvalOptions<'_>) -> Metrics {
    let _span = tracing::trace_span!("evaluate").entered();
    let task = Task::new("evaluation", 0);
    evaluate(subject, options, &|done, total| task.count(done, total))
}
