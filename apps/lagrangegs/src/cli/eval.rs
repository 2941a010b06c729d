//! `lagrangegs eval`.

use std::path::{Path, PathBuf};

use anyhow::{Result, bail};
use lgs_data::files::write_atomically;
use lgs_eval::table::table;
use lgs_eval::{EvalOptions, Metrics, Subject, evaluate};

use super::device::DeviceArgs;
use super::evidence::Evidence;
use super::failure::At;
use super::output;
use super::progress::{Task, say};
use super::report::Background;
use super::run::{METRICS, Run};
use super::weights::perceptual;

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Folder of the run
    run: PathBuf,
    /// Splits to score, separated by commas [default: all that the dataset has]. Metrics and report of a run
    /// that has further splits in them stay as they are
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
            splits: args.split.as_deref(),
            ..EvalOptions::default()
        };
        measure(&run, args.data.as_deref(), &options)
    })?;
    if args.json { output::print_json(&metrics) } else { output::print(&table(&metrics)) }
}

/// Computes a run's metrics and writes them into its folder, as `metrics.json`, as figures and as a page;
/// those of some splits only where no other ones are lost.
pub(super) fn measure(run: &Run, data: Option<&Path>, options: &EvalOptions<'_>) -> Result<Metrics> {
    run.check_writable()?;
    let kept = options.splits.map(|splits| further_splits(run, splits)).transpose()?.unwrap_or_default();
    let data = run.dataset_path(data)?;
    if let (Some(_), None) = (options.splits, &data) {
        bail!(
            "the run has no dataset and so no splits; name one with --data: {}",
            run.folder.root().display()
        );
    }
    let (cost, background) = (run.cost()?, Background::read(run)?);
    let evidence = Evidence::load(run, data.as_deref())?;
    let subject = evidence.subject(run);
    check_splits(&subject, options)?;
    let mut metrics = scored(&subject, options);
    metrics.cost = cost;
    metrics.cameras = run.camera_corrections()?;
    metrics.protocol.other_dataset = evidence.other.clone();
    let path = run.folder.root().join(METRICS);
    if !kept.is_empty() {
        say(&format!("the file stays as it is, since it has {}, too: {}", kept.join(", "), path.display()));
        return Ok(metrics);
    }
    write_atomically(&path, |w| serde_json::to_writer_pretty(w, &metrics).map_err(Into::into)).at(&path)?;
    background.write_report(run, &subject, &metrics)?;
    Ok(metrics)
}

/// The splits that the run's metrics have beside some.
fn further_splits(run: &Run, splits: &[String]) -> Result<Vec<String>> {
    let known = run.scored_splits()?.unwrap_or_default();
    Ok(known.into_iter().filter(|name| !splits.contains(name)).collect())
}

/// Refuses splits that the dataset does not have.
fn check_splits(subject: &Subject<'_>, options: &EvalOptions<'_>) -> Result<()> {
    let Some(dataset) = subject.dataset else { return Ok(()) };
    let is_absent = |name: &&String| !dataset.splits.contains_key(*name);
    if let Some(name) = options.splits.unwrap_or_default().iter().find(is_absent) {
        let known: Vec<&str> = dataset.splits.keys().map(String::as_str).collect();
        let (known, root) = (known.join(", "), dataset.root.display());
        bail!("the dataset has no split `{name}`; expected one of {known}: {root}");
    }
    Ok(())
}

fn scored(subject: &Subject<'_>, options: &EvalOptions<'_>) -> Metrics {
    let _span = tracing::trace_span!("evaluate").entered();
    let task = Task::new("evaluation", 0);
    evaluate(subject, options, &|done, total| task.count(done, total))
}
