//! Source model, truth and Lagrangian scene through one camera, before, during and after the captured window.

use lgs_core::{Camera, GaussianCloud, Image};
use lgs_data::dataset::{Dataset, Frame};
use lgs_eval::{FrameMetrics, FrameModelScore, Metrics};
use lgs_model::source::SourceModel;
use lgs_model::{LagrangianScene, Motion};
use plotters::style::RGBColor;

use super::strip::{Cell, Group, Row, Strip, image_width};
use crate::axis::number;
use crate::canvas::Figure;
use crate::error::ReportError;
use crate::style::{LAGRANGIAN, SOURCE, TRUTH};
use crate::views::{drawn, longest_view, of_width, resized, spread_in_time};

/// Columns at most.
const COLUMNS: usize = 9;

/// The figure; nothing without images.
pub(crate) fn figure(
    (scene, motion): (&LagrangianScene, &mut Motion<'_>),
    source: Option<&dyn SourceModel>,
    dataset: &Dataset,
    metrics: &Metrics,
) -> Result<Option<Figure>, ReportError> {
    let (low, high) = scene.motion.time_range();
    let reachable: Vec<&Frame> =
        longest_view(dataset).into_iter().filter(|f| (low - 1e-4..=high + 1e-4).contains(&f.time)).collect();
    let frames = spread_in_time(&reachable, COLUMNS);
    let Some(first) = frames.first() else { return Ok(None) };
    let background = scene.background;
    let camera = of_width(&first.camera, image_width(frames.len()));
    let score = |frame: &Frame| metrics.frames.values().flatten().find(|f| f.name == frame.name);
    let row = |title: &str,
               colour: RGBColor,
               image: &mut dyn FnMut(&Frame) -> Image,
               note: &dyn Fn(&FrameMetrics) -> Option<FrameModelScore>| {
        let mut cell = |frame: &&Frame| {
            let psnr = score(frame).and_then(note).and_then(|s| s.psnr);
            let note = psnr.map_or_else(String::new, |p| format!("{} dB", number(p, 1)));
            Some(Cell { image: image(frame), note, arrows: Vec::new() })
        };
        Row { title: title.to_owned(), colour, cells: frames.iter().map(&mut cell).collect() }
    };
    let view = |cloud: &GaussianCloud, camera: &Camera| drawn(cloud, camera, background);
    let mut rows = Vec::new();
    if let Some(source) = source {
        rows.push(row("source", SOURCE, &mut |f| view(&source.cloud_at(f.time), &camera), &|f| f.source));
    }
    rows.push(row(
        "truth",
        TRUTH,
        &mut |f| resized(&f.composited(background), camera.width, camera.height),
        &|_| None,
    ));
    rows.push(row(
        "Lagrangian",
        LAGRANGIAN,
        &mut |f| view(&scene.cloud_at(&motion.state_at(f.time)), &camera),
        &|f| Some(f.lagrangian),
    ));
    let times: Vec<f64> = frames.iter().map(|f| f64::from(f.time)).collect();
    let strip = Strip {
        labels: times.iter().map(|&t| format!("t = {}", number(t, 2))).collect(),
        groups: groups(&times, f64::from(scene.motion.time_window)),
        rows,
        aspect: f64::from(camera.height) / f64::from(camera.width),
    };
    let caption = "One view over time; under every image its PSNR. The models were trained on times of the \
        observed window alone.";
    Figure::of("extrapolation", caption, &strip).map(Some)
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
