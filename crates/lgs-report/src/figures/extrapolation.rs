//! Source model, truth and Lagrangian scene through one camera, or through several where each has one image,
//! before, during and after the captured window.

use lgs_core::{GaussianCloud, Image};
use lgs_data::dataset::{Dataset, Frame};
use lgs_eval::{FrameMetrics, FrameModelScore, Metrics};
use lgs_model::source::SourceModel;
use lgs_model::{LagrangianScene, Motion};

use super::over_time::Span;
use super::strip::{Cell, Group, Row, Strip, image_width};
use crate::axis::number;
use crate::canvas::Figure;
use crate::error::ReportError;
use crate::style::{LAGRANGIAN, SOURCE, TRUTH};
use crate::thresholds::EXTRAPOLATION_COLUMNS;
use crate::views::{drawn, of_width, resized, spread_in_time, views_over_time};

const CAPTION: &str = "Views over time; under every image its PSNR. The models were trained on times of the \
    observed window alone.";

/// The figure; nothing without images.
pub(crate) fn figure(
    (scene, motion): (&LagrangianScene, &mut Motion<'_>),
    source: Option<&dyn SourceModel>,
    dataset: &Dataset,
    (metrics, span): (&Metrics, Span),
) -> Result<Option<Figure>, ReportError> {
    let (low, high) = scene.motion.time_range();
    let is_reachable = |f: &&Frame| (low - 1e-4..=high + 1e-4).contains(&f.time);
    let reachable: Vec<&Frame> = views_over_time(dataset).into_iter().filter(is_reachable).collect();
    let frames = spread_in_time(&reachable, EXTRAPOLATION_COLUMNS);
    let Some(first) = frames.first() else { return Ok(None) };
    let background = scene.background;
    let camera = |frame: &Frame| of_width(&frame.camera, image_width(frames.len()));
    let view = |cloud: &GaussianCloud, frame: &Frame| drawn(cloud, &camera(frame), background);
    let of = |frames: &[&Frame], image: &mut dyn FnMut(&Frame) -> Image, score: Score| -> Vec<Option<Cell>> {
        let scored = |frame: &&Frame| Some(cell(image(frame), score_of(metrics, frame).and_then(score)));
        frames.iter().map(scored).collect()
    };
    let mut rows = Vec::new();
    if let Some(source) = source {
        let cells = of(&frames, &mut |f| view(&source.cloud_at(f.time), f), |f| f.source);
        rows.push(Row { title: "source".to_owned(), colour: SOURCE, cells });
    }
    let truth = |f: &Frame| resized(&f.composited(background), camera(f).width, camera(f).height);
    rows.push(Row { title: "truth".to_owned(), colour: TRUTH, cells: of(&frames, &mut { truth }, |_| None) });
    let mut lagrangian = |f: &Frame| {
        span.marked(f64::from(f.time), view(&scene.cloud_at(&motion.state_at(f.time), f.time), f))
    };
    let cells = of(&frames, &mut lagrangian, |f| Some(f.lagrangian));
    rows.push(Row { title: "Lagrangian".to_owned(), colour: LAGRANGIAN, cells });
    let times: Vec<f64> = frames.iter().map(|f| f64::from(f.time)).collect();
    let strip = Strip {
        labels: times.iter().map(|&t| format!("t = {}", number(t, 2))).collect(),
        groups: groups(&times, f64::from(scene.motion.time_window)),
        rows,
        aspect: f64::from(first.camera.height) / f64::from(first.camera.width),
    };
    Figure::of(("extrapolation", CAPTION), strip.size(), &strip).map(Some)
}

/// Picks a model's score of an image.
type Score = fn(&FrameMetrics) -> Option<FrameModelScore>;

fn score_of<'a>(metrics: &'a Metrics, frame: &Frame) -> Option<&'a FrameMetrics> {
    metrics.frames.values().flatten().find(|f| f.name == frame.name)
}

/// An image with its PSNR below.
fn cell(image: Image, score: Option<FrameModelScore>) -> Cell {
    let psnr = score.and_then(|s| s.psnr);
    let note = psnr.map_or_else(String::new, |p| format!("{} dB", number(p, 1)));
    Cell { image, note, arrows: Vec::new() }
}

/// Columns before, in and after the captured window.
fn groups(times: &[f64], window: f64) -> Vec<Group> {
    let (start, end) =
        (times.partition_point(|&t| t < -1e-6), times.partition_point(|&t| t <= window + 1e-6));
    let group = |name: &str, columns: std::ops::Range<usize>, strong| Group {
        name: name.to_owned(),
        columns,
        strong,
    };
    [
        group("before", 0..start, false),
        group("observed", start..end, true),
        group("after", end..times.len(), false),
    ]
    .into_iter()
    .filter(|g| !g.columns.is_empty())
    .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_grouped_by_the_window() {
        let names =
            |times: &[f64]| groups(times, 0.75).into_iter().map(|g| (g.name, g.columns)).collect::<Vec<_>>();
        assert_eq!(
            names(&[-0.5, 0.0, 0.75, 0.8]),
            [("before".into(), 0..1), ("observed".into(), 1..3), ("after".into(), 3..4)]
        );
        assert_eq!(names(&[0.1, 0.2]), [("observed".into(), 0..2)]);
    }
}
