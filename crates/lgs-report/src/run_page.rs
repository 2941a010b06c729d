//! `report.html` of a run, and the files beside it.

use std::path::Path;

use lgs_data::files::{FileError, write_atomically, write_with_parents};
use lgs_data::ply::write_ply;
use lgs_dynamics::{Edit, Reversal};
use lgs_eval::table::{physics_rows, split_rows};
use lgs_eval::{Cost, Footprint, Metrics};
use lgs_model::Motion;

use crate::canvas::Figure;
use crate::error::ReportError;
use crate::figures::{coloured_partition, run_figures};
use crate::html::{self, FirstRow};
use crate::law_section::law_sections;
use crate::subject::RunSubject;

/// Folder of the figures, inside of the run.
pub const FIGURES: &str = "figures";

/// Draws all figures and writes them, the colour-coded splat file and `report.html` into a run's folder;
/// figures of an earlier report that this run has no longer are removed.
///
/// # Errors
/// If a figure cannot be drawn or a file not written.
pub fn write_run_report(root: &Path, subject: &RunSubject<'_>) -> Result<Vec<Figure>, ReportError> {
    let figures = run_figures(subject)?;
    let folder = root.join(FIGURES);
    std::fs::create_dir_all(&folder).map_err(|e| FileError::new("create folder", &folder, e))?;
    remove_others(&folder, &figures)?;
    for figure in &figures {
        write_atomically(&folder.join(format!("{}.svg", figure.name)), |w| {
            w.write_all(figure.svg.as_bytes())
        })?;
        write_atomically(&folder.join(format!("{}.png", figure.name)), |w| w.write_all(&figure.png))?;
    }
    let mut motion = Motion::new(subject.scene, Edit::default(), Reversal::Exact);
    write_ply(&folder.join("partition.ply"), &coloured_partition(subject.scene, &mut motion))?;
    write_with_parents(&root.join("report.html"), |w| w.write_all(run_html(subject, &figures).as_bytes()))?;
    Ok(figures)
}

/// Removes images of earlier figures; other files stay.
fn remove_others(folder: &Path, figures: &[Figure]) -> Result<(), ReportError> {
    for name in FIGURE_NAMES.iter().filter(|name| !figures.iter().any(|f| f.name == **name)) {
        for path in ["svg", "png"].map(|extension| folder.join(format!("{name}.{extension}"))) {
            match std::fs::remove_file(&path) {
                Err(e) if e.kind() != std::io::ErrorKind::NotFound => {
                    return Err(FileError::new("remove file", &path, e).into());
                }
                _ => {}
            }
        }
    }
    Ok(())
}

/// Every figure that a run can have.
pub const FIGURE_NAMES: [&str; 9] = [
    "extrapolation",
    "psnr",
    "trajectories",
    "position-error",
    "potential",
    "beta-sweep",
    "time-reversal",
    "partition",
    "training",
];

/// The page of a run with its figures.
#[must_use]
pub fn run_html(subject: &RunSubject<'_>, figures: &[Figure]) -> String {
    let metrics = subject.metrics;
    let figure = |name: &str| figures.iter().find(|f| f.name == name).map_or_else(String::new, html::figure);
    let mut body = summary(&metrics.footprint);
    body.push_str("<h2>Images</h2>\n");
    body.push_str(&html::table(
        "PSNR in dB (mean over images; of the mean squared error; over the \
        foreground; over what differs from the background), SSIM and LPIPS without \
        unit.",
        &split_rows(metrics),
        FirstRow::Names,
    ));
    ["extrapolation", "psnr"].iter().for_each(|name| body.push_str(&figure(name)));
    body.push_str("<h2>Motion</h2>\n");
    body.push_str(&html::table(
        "Errors relative to path length; times in units of the captured sequence.",
        &physics_rows(metrics),
        FirstRow::Values,
    ));
    ["trajectories", "position-error", "potential", "beta-sweep", "time-reversal"]
        .iter()
        .for_each(|name| body.push_str(&figure(name)));
    body.push_str("<h2>Objects</h2>\n");
    body.push_str(&html::table(
        "Centre at t = 0 in world units, mean velocity in world units per unit of time.",
        &object_rows(metrics),
        FirstRow::Names,
    ));
    body.push_str(&(figure("partition") + &law_sections(metrics)));
    body.push_str("<h2>Training</h2>\n");
    body.push_str(&html::table("", &cost_rows(&metrics.cost), FirstRow::Names));
    body.push_str(&figure("training"));
    if !subject.config.is_empty() {
        body.push_str(&format!(
            "<details><summary>Configuration</summary>\n<pre>{}</pre></details>\n",
            html::escaped(subject.config)
        ));
    }
    html::page(subject.title, &body)
}

fn summary(footprint: &Footprint) -> String {
    let Footprint { static_gaussians, moving_gaussians, objects } = footprint;
    let plural = if *objects == 1 { "object" } else { "objects" };
    format!(
        "<p class=\"soft\">{objects} moving {plural}; {moving_gaussians} moving and {static_gaussians} \
            still Gaussians.</p>\n"
    )
}

fn object_rows(metrics: &Metrics) -> Vec<Vec<String>> {
    let objects = &metrics.physics.objects;
    if objects.is_empty() {
        return Vec::new();
    }
    let vector = |v: [f32; 3]| v.map(|c| crate::axis::number(f64::from(c), 3)).join(", ");
    let header =
        ["object", "Gaussians", "centre", "mean velocity", "force over gradient"].map(str::to_owned).to_vec();
    let row = |(index, o): (usize, &lgs_eval::ObjectSummary)| {
        let ratio = o.force_ratio.map_or_else(|| "–".to_owned(), |r| format!("{r:.3}"));
        vec![index.to_string(), o.gaussians.to_string(), vector(o.center), vector(o.mean_velocity), ratio]
    };
    std::iter::once(header).chain(objects.iter().enumerate().map(row)).collect()
}

fn cost_rows(cost: &Cost) -> Vec<Vec<String>> {
    let mebibytes = |b: Option<u64>| {
        b.map_or_else(|| "–".to_owned(), |b| format!("{:.0}", b as f64 / f64::from(1 << 20)))
    };
    if cost.stages.is_empty() && cost.train_secs.is_none() {
        return Vec::new();
    }
    let header = ["stage", "time (s)", "peak memory (MiB)"].map(str::to_owned).to_vec();
    let stages = cost
        .stages
        .iter()
        .map(|s| vec![s.stage.clone(), format!("{:.1}", s.secs), mebibytes(s.peak_rss_bytes)]);
    let total = cost
        .train_secs
        .map(|secs| vec!["all".to_owned(), format!("{secs:.1}"), mebibytes(cost.peak_rss_bytes)]);
    std::iter::once(header).chain(stages).chain(total).collect()
}
