//! `lagrangegs bench`: the cells of a suite, each an ordinary run trained by `train` and measured by `eval`,
//! and the tables they make.

use std::path::{Path, PathBuf};

use anyhow::{Result, bail};
use lgs_data::dataset::DatasetFormat;
use lgs_data::files::write_with_parents;
use lgs_eval::EvalOptions;
use lgs_eval::table::aligned;
use lgs_report::write_suite_report;
use lgs_suite::{Cell, CellState, Plan, Results, Suite, all_tables, bundled_suites, table_text};
use lgs_train::device::Device;
use serde_json::json;

use super::device::DeviceArgs;
use super::eval::measure;
use super::failure::{At, chain};
use super::interrupt::is_stopping;
use super::output::{self, refuse_inside_dataset};
use super::progress::say;
use super::run::Run;
use super::weights::perceptual;
use super::{synth, training};

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Suite file, or the name of a bundled suite
    #[arg(required_unless_present = "list_suites")]
    suite: Option<PathBuf>,
    /// List the bundled suites
    #[arg(long)]
    list_suites: bool,
    /// Folder for runs, synthetic datasets and tables [default: runs/NAME]
    #[arg(long)]
    out: Option<PathBuf>,
    /// Folder with the scenes' datasets, one folder each
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// List the cells, where their sources come from and how far they are
    #[arg(long, conflicts_with_all = ["cell", "tables"])]
    list: bool,
    /// Run one cell by its number, and make no tables
    #[arg(long, value_name = "INDEX", conflicts_with = "tables")]
    cell: Option<usize>,
    /// Run nothing; make the tables of what is there
    #[arg(long)]
    tables: bool,
    /// Print one JSON document instead of text
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    device: DeviceArgs,
}

pub(super) fn run(args: &Args) -> Result<()> {
    let (Some(name), false) = (&args.suite, args.list_suites) else { return list_suites(args) };
    let suite = Suite::open(name).at(name)?;
    let out = args.out.clone().unwrap_or_else(|| Path::new("runs").join(&suite.name));
    refuse_inside_dataset(&out)?;
    let plan = Plan::new(suite, &out, args.data.as_deref()).at(name)?;
    if args.list {
        return list(&plan, args);
    }
    if args.tables {
        return tables(&plan, args);
    }
    if let Some(missing) = plan.missing_data() {
        bail!("{missing}");
    }
    match args.cell {
        Some(index) => {
            let cell = plan.cell(index).at(name)?;
            args.device.run(|device| run_cell(&plan, cell, device))?;
            output::print(&format!("{}\n", plan.run_folder(cell).display()))
        }
        None => run_all(&plan, args),
    }
}

/// Runs what is missing, cell by cell. A cell that fails does not keep the others from running.
fn run_all(plan: &Plan, args: &Args) -> Result<()> {
    let mut failed = Vec::new();
    for cell in &plan.cells {
        if let Err(error) = args.device.run(|device| run_cell(plan, cell, device)) {
            if is_stopping() {
                return Err(error);
            }
            say(&format!("cell {} ({}) failed: {}", cell.index, cell.name(), chain(&error)));
            failed.push(cell.name());
        }
        if is_stopping() {
            bail!("interrupted; the same command goes on: {}", plan.root().display());
        }
    }
    tables(plan, args)?;
    match failed.len() {
        0 => Ok(()),
        n => bail!(
            "{n} of {} cells failed ({}): {}",
            plan.cells.len(),
            failed.join(", "),
            plan.root().display()
        ),
    }
}

/// Trains and evaluates a cell, as far as it is not done.
fn run_cell(plan: &Plan, cell: &Cell, device: &Device) -> Result<()> {
    let out = plan.run_folder(cell);
    let state = plan.state(cell).at(&out)?;
    if state == CellState::Done {
        return Ok(());
    }
    say(&format!("cell {} of {}: {}", cell.index, plan.cells.len(), cell.name()));
    let data = plan.dataset(cell);
    make_dataset(plan, cell, &data)?;
    if state < CellState::Trained {
        let source_from = plan.source_folder(cell).at(&out)?;
        let resume = state == CellState::Begun;
        let config = cell.config.clone();
        training::train(&training::Request {
            data: Some(&data),
            out: &out,
            config,
            resume,
            source_from: source_from.as_deref(),
            view: None,
            rerun: None,
            device,
        })?;
    }
    let perceptual = perceptual(device)?;
    let options = EvalOptions {
        half_resolution: plan.suite.half_resolution,
        perceptual: perceptual.as_ref(),
        ..EvalOptions::default()
    };
    measure(&Run::open(&out)?, Some(&data), &options).map(drop)
}

/// Makes a synthetic dataset that is not there.
fn make_dataset(plan: &Plan, cell: &Cell, data: &Path) -> Result<()> {
    let Some(options) = plan.suite.synthetic(cell.seed) else { return Ok(()) };
    if DatasetFormat::detect(data).is_some() {
        return Ok(());
    }
    let made = synth::make(&cell.scene, &options, data);
    // Datasets appear whole: if another process was faster, its is as good.
    if DatasetFormat::detect(data).is_some() { Ok(()) } else { made }
}

/// Writes the tables of what is there and a page of all runs, and prints the tables.
fn tables(plan: &Plan, args: &Args) -> Result<()> {
    let tables = all_tables(&Results::load(plan));
    let folder = plan.tables_folder();
    let write = |name: String, text: &str| {
        let path = folder.join(name);
        write_with_parents(&path, |w| w.write_all(text.as_bytes())).at(&path)
    };
    for table in &tables {
        write(format!("{}.md", table.id), &table_text::markdown(table))?;
        write(format!("{}.csv", table.id), &table_text::csv(table))?;
        write(format!("{}.tex", table.id), &table_text::latex(table))?;
    }
    let document = table_text::json(&plan.suite.name, &tables);
    write("tables.json".to_owned(), &format!("{document:#}\n"))?;
    let markdown = tables.iter().map(table_text::markdown).collect::<Vec<_>>().join("\n");
    write("tables.md".to_owned(), &markdown)?;
    let runs: Vec<(String, PathBuf)> =
        plan.cells.iter().map(|cell| (cell.name(), plan.run_folder(cell))).collect();
    let page = plan.root().join("report.html");
    write_suite_report(&page, &plan.suite.name, &runs).at(&page)?;
    if args.json { output::print_json(&document) } else { output::print(&markdown) }
}

/// The cells of a suite.
fn list(plan: &Plan, args: &Args) -> Result<()> {
    let states = plan
        .cells
        .iter()
        .map(|cell| plan.state(cell).at(&plan.run_folder(cell)))
        .collect::<Result<Vec<CellState>>>()?;
    let cells = || plan.cells.iter().zip(&states);
    if args.json {
        let entry = |(cell, state): (&Cell, &CellState)| {
            let Cell { index, scene, method, variant, seed, source_of, .. } = cell;
            json!({
                "index": index, "name": cell.name(), "scene": scene, "method": method,
                "variant": variant, "seed": seed,
                "source_of": source_of, "state": state.name(), "folder": plan.run_folder(cell),
            })
        };
        let cells: Vec<_> = cells().map(entry).collect();
        return output::print_json(
            &json!({ "suite": plan.suite.name, "with_own_source": plan.leaders(), "cells": cells }),
        );
    }
    let mut rows = vec![["index", "cell", "source", "state"].map(str::to_owned).to_vec()];
    rows.extend(cells().map(|(cell, state)| {
        let source = cell.source_of.map_or_else(|| "own".to_owned(), |leader| format!("of {leader}"));
        vec![cell.index.to_string(), cell.name(), source, state.name().to_owned()]
    }));
    output::print(&aligned(&rows, &[false, false, false, false]))
}

fn list_suites(args: &Args) -> Result<()> {
    let mut suites = Vec::new();
    for bundled in bundled_suites() {
        let suite = Suite::open(Path::new(bundled.name))?;
        suites.push((
            bundled.name,
            suite.title.clone(),
            Plan::new(suite, Path::new("runs"), None)?.cells.len(),
        ));
    }
    if args.json {
        let entries: Vec<_> = suites
            .iter()
            .map(|(name, title, cells)| json!({ "name": name, "title": title, "cells": cells }))
            .collect();
        return output::print_json(&entries);
    }
    let rows: Vec<Vec<String>> = suites
        .into_iter()
        .map(|(name, title, cells)| vec![name.to_owned(), title, format!("{cells} cells")])
        .collect();
    output::print(&aligned(&rows, &[false, false, false]))
}
