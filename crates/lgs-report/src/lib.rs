//! Figures of trained scenes, and pages that gather them.
//!
//! [`write_run_report`] draws what a run has something for, each figure as SVG and as PNG under `figures/`,
//! and a page `report.html` that needs nothing else; [`write_suite_report`] makes one page of several runs;
//! [`sheet`] puts frames beside each other. Drawing is plotters' with a bundled font, so that the same run
//! gives the same bytes on any machine. Nothing is measured here but paths: figures show `metrics.json` and
//! what `Motion` gives.

mod axis;
mod canvas;
mod chart;
mod clip;
mod error;
mod figures;
mod html;
mod law_section;
mod legend;
mod paths;
mod plane;
mod run_page;
pub mod sheet;
mod stroke;
mod style;
mod subject;
mod suite_cell;
mod suite_page;
mod thresholds;
mod untrusted_mark;
mod views;

pub use canvas::Figure;
pub use error::ReportError;
pub use figures::{coloured_partition, rig_figure, run_figures};
pub use run_page::{FIGURE_NAMES, FIGURES, run_html, write_run_report};
pub use subject::{Curve, RunSubject};
pub use suite_page::{read_metrics, suite_html, write_suite_report};
pub use untrusted_mark::mark_untrusted;
pub use views::{longest_view, spread_in_time};
