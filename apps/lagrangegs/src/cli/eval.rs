//! `lagrangegs eval`.

use std::path::{Path, PathBuf};

use anyhow::Result;
use lgs_data::files::write_atomically;
use lgs_data::synth::GroundTruth;
use lgs_eval::table::table;
use lgs_eval::{EvalOptions, Metrics, Subject, evaluate};
use lgs_model::source::SourceModel;

use super::failure::At;
use super::output;
use super::progress::Task;
use super::report::write_report;
use super::run::{Run, load_dataset, load_options};

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Folder of the run
    run: PathBuf,
    /// Splits to score, separated by commas [default: all that the dataset has]
    #[arg(long, value_delimiter = ',', value_name = "NAMES")]
    split: Option<Vec<String>>,
    /// Dataset, if it is no longer where training found it
    #[arg(long, value_name = "DATA")]
    data: Option<PathBuf>,
    /// Print one JSON document instead of a table
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &Args) -> Result<()> {
    let run = Run::open(&args.run)?;
    let metrics = measure(&run, args.data.as_deref(), args.split.clone())?;
    if args.json { output::print_json(&metrics) } else { output::print(&table(&metrics)) }
}

/// Computes a run's metrics and writes them into its folder, as `metrics.json`, as figures and as a page.
pub(super) fn measure(run: &Run, data: Option<&Path>, splits: Option<Vec<String>>) -> Result<Metrics> {
    let root = run.dataset_path(data)?;
    let dataset = load_dataset(&root, &load_options(&run.config, splits))?;
    let truth = GroundTruth::load(&root).at(&root)?;
    let source = run.source()?;
    let subject = Subject {
        scene: &run.scene,
        source: source.as_ref().map(|source| source as &dyn SourceModel),
        dataset: Some(&dataset),
        truth: truth.as_ref(),
    };
    let mut metrics = scored(&subject);
    metrics.cost = run.cost();
    let path = run.folder.root().join("metrics.json");
    write_atomically(&path, |w| serde_json::to_writer_pretty(w, &metrics).map_err(Into::into)).at(&path)?;
    write_report(run, &subject, &metrics)?;
    Ok(metrics)
}

fn scored(subject: &Subject<'_>) -> Metrics {
    let _span = tracing::trace_span!("evaluate").entered();
    let task = Task::new("evaluation", 0);
    evaluate(subject, &EvalOptions::default(), &|done, total| task.count(done, total))
}
