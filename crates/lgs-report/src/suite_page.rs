//! A page over several runs: one table, one chart, and the strips of every run that has one.

use std::path::{Path, PathBuf};

use lgs_data::files::{read_bytes, write_with_parents};
use lgs_eval::{Metrics, SplitScore};

use crate::canvas::Figure;
use crate::error::ReportError;
use crate::figures::suite_figure;
use crate::html::{self, FirstRow};
use crate::run_page::FIGURES;
use crate::suite_cell::{Cell, SPLITS};
use crate::thresholds::RUNS_WITH_STRIPS;

/// Writes a page over runs, given by a name and their folder, from the `metrics.json` of each; runs without
/// one are listed as missing.
///
/// # Errors
/// If there are damaged metrics, the chart cannot be drawn or the file not written.
pub fn write_suite_report(path: &Path, title: &str, cells: &[(String, PathBuf)]) -> Result<(), ReportError> {
    let page = suite_html(title, cells)?;
    Ok(write_with_parents(path, |w| w.write_all(page.as_bytes()))?)
}

/// The page that [`write_suite_report`] writes.
///
/// # Errors
/// As there.
pub fn suite_html(title: &str, cells: &[(String, PathBuf)]) -> Result<String, ReportError> {
    let cells: Vec<Cell> = cells
        .iter()
        .map(|(name, folder)| {
            Ok(Cell { name: name.clone(), folder: folder.clone(), metrics: read_metrics(folder)? })
        })
        .collect::<Result<_, ReportError>>()?;
    let missing: Vec<&str> = cells.iter().filter(|c| c.metrics.is_none()).map(|c| c.name.as_str()).collect();
    let mut body = String::new();
    if !missing.is_empty() {
        body.push_str(&format!(
            "<p class=\"soft\">Not evaluated yet: {}.</p>\n",
            html::escaped(&missing.join(", "))
        ));
    }
    body.push_str("<h2>Images</h2>\n");
    body.push_str(&html::table(
        "PSNR in dB, source model → Lagrangian scene.",
        &image_rows(&cells),
        FirstRow::Names,
    ));
    if let Some(figure) = suite_figure(&cells)? {
        body.push_str(&chart(&figure));
    }
    body.push_str("<h2>Motion and cost</h2>\n");
    body.push_str(&html::table(
        "Trajectory error over path length at the last time known.",
        &motion_rows(&cells),
        FirstRow::Names,
    ));
    if cells.len() <= RUNS_WITH_STRIPS {
        cells.iter().for_each(|cell| body.push_str(&strip(cell)));
    }
    Ok(html::page(title, &body))
}

/// Metrics of a run; nothing if it has none yet.
///
/// # Errors
/// If there are some and they do not parse.
pub fn read_metrics(run: &Path) -> Result<Option<Metrics>, ReportError> {
    let path = run.join("metrics.json");
    if !path.exists() {
        return Ok(None);
    }
    serde_json::from_slice(&read_bytes(&path)?)
        .map(Some)
        .map_err(|e| ReportError::Metrics { path, reason: e.to_string() })
}

/// The chart without links to files, which a suite has none of.
fn chart(figure: &Figure) -> String {
    let caption = html::escaped(&figure.caption);
    format!(
        "<figure>\n<div class=\"wide\">\n{}</div>\n<figcaption>{caption}</figcaption>\n</figure>\n",
        figure.svg
    )
}

fn strip(cell: &Cell) -> String {
    let pictures = ["extrapolation", "trajectories"]
        .map(|name| read_bytes(&cell.folder.join(FIGURES).join(format!("{name}.png"))).ok());
    let shown: String = pictures.iter().flatten().map(|png| html::picture(png, &cell.name)).collect();
    if shown.is_empty() { shown } else { format!("<h2>{}</h2>\n{shown}", html::escaped(&cell.name)) }
}

fn image_rows(cells: &[Cell]) -> Vec<Vec<String>> {
    let splits: Vec<&str> = SPLITS
        .into_iter()
        .filter(|s| cells.iter().flat_map(|c| &c.metrics).any(|m| m.splits.contains_key(*s)))
        .collect();
    if splits.is_empty() {
        return Vec::new();
    }
    let header = std::iter::once("run".to_owned()).chain(splits.iter().map(|s| (*s).to_owned())).collect();
    let psnr = |score: &Option<SplitScore>| {
        score.as_ref().and_then(|s| s.psnr).map_or_else(|| "–".to_owned(), |p| format!("{p:.2}"))
    };
    let row = |cell: &Cell| {
        let metrics = cell.metrics.as_ref();
        let score = |split: &&str| match metrics.and_then(|m| m.splits.get(*split)) {
            Some(found) => format!("{} → {}", psnr(&found.source), psnr(&found.lagrangian)),
            None => "–".to_owned(),
        };
        std::iter::once(cell.name.clone()).chain(splits.iter().map(score)).collect()
    };
    std::iter::once(header).chain(cells.iter().map(row)).collect()
}

fn motion_rows(cells: &[Cell]) -> Vec<Vec<String>> {
    let header = [
        "run",
        "trajectory error",
        "cycle error, exact",
        "extent over t = 0",
        "objects",
        "training (s)",
        "peak memory (MiB)",
    ];
    let row = |cell: &Cell| {
        let metrics = cell.metrics.as_ref();
        let physics = metrics.map(|m| &m.physics);
        let percent = |v: Option<f64>| v.map(|v| format!("{:.3} %", 100.0 * v));
        let last = physics.and_then(|p| {
            let times = p.trajectory_error.iter().filter_map(|(t, e)| Some((t.parse::<f64>().ok()?, (*e)?)));
            times.max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, e)| e)
        });
        let values = [
            percent(last),
            percent(physics.and_then(|p| p.cycle_error.exact)),
            physics.and_then(|p| p.extent_ratio_max).map(|v| format!("{v:.3}")),
            metrics.map(|m| m.footprint.objects.to_string()),
            metrics.and_then(|m| m.cost.train_secs).map(|v| format!("{v:.0}")),
            metrics
                .and_then(|m| m.cost.peak_rss_bytes)
                .map(|b| format!("{:.0}", b as f64 / f64::from(1 << 20))),
        ];
        std::iter::once(cell.name.clone())
            .chain(values.into_iter().map(|v| v.unwrap_or_else(|| "–".to_owned())))
            .collect()
    };
    std::iter::once(header.map(str::to_owned).to_vec()).chain(cells.iter().map(row)).collect()
}
