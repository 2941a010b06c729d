//! The training curve: PSNR of the images that training drew, stage after stage.

use plotters::style::RGBColor;
use plotters::style::text_anchor::{HPos, VPos};
use plotters_backend::DrawingBackend;

use crate::axis::{Axis, padded};
use crate::canvas::{Area, Drawing, Fault, Figure};
use crate::chart::{Frame, TEXT, border, open_with_grid, path, segment, write};
use crate::error::ReportError;
use crate::style::{FAINT, INK, LAGRANGIAN, SOURCE, line, pale};
use crate::subject::Curve;
use crate::thresholds::{MEANS_PER_STAGE, NARROWEST_STAGE};

const SIZE: [f64; 2] = [820.0, 320.0];
const FRAME: Frame = Frame { at: [76.0, 36.0], size: [730.0, 234.0] };

/// A stage's place on the common axis.
struct Stage {
    name: String,
    steps: String,
    colour: RGBColor,
    from: f64,
    to: f64,
    points: Vec<(f64, f64)>,
}

struct Training {
    stages: Vec<Stage>,
    axes: [Axis; 2],
}

/// The figure; nothing without curves.
pub(crate) fn figure(curves: &[Curve]) -> Result<Option<Figure>, ReportError> {
    let mut stages: Vec<Stage> = Vec::new();
    let drawn: Vec<(&Curve, f64)> = curves
        .iter()
        .filter(|c| c.points.len() > 1)
        .map(|c| (c, c.points.iter().map(|p| p.0).fold(0.0, f64::max)))
        .filter(|&(_, last)| last > 0.0)
        .collect();
    let all: f64 = drawn.iter().map(|d| d.1).sum();
    let mut from = 0.0;
    for (curve, last) in drawn {
        let width = (last / all).max(NARROWEST_STAGE);
        let points = curve.points.iter().map(|p| (from + width * p.0 / last, p.1)).collect();
        let colour = if stages.is_empty() && curve.stage == "source" { SOURCE } else { LAGRANGIAN };
        stages.push(Stage {
            name: curve.stage.clone(),
            steps: format!("{last:.0} steps"),
            colour,
            from,
            to: from + width,
            points,
        });
        from += width;
    }
    let values = stages.iter().flat_map(|s| &s.points);
    let (Some(y), true) = (padded(values.map(|p| p.1), 0.05), from > 0.0) else { return Ok(None) };
    let axes = [
        Axis::linear(0.0..from, 0, "training, stage after stage").unnumbered(),
        Axis::linear(y, 6, "PSNR (dB)"),
    ];
    let caption = "PSNR of the training images drawn at each step, stage after stage; bold: mean over \
        neighbouring steps.";
    Figure::of(("training", caption), SIZE, &Training { stages, axes }).map(Some)
}

/// Means over runs of neighbouring points.
fn averaged(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let run = points.len().div_ceil(MEANS_PER_STAGE).max(1);
    let mean = |values: &[(f64, f64)], pick: fn(&(f64, f64)) -> f64| {
        values.iter().map(pick).sum::<f64>() / values.len() as f64
    };
    points.chunks(run).map(|values| (mean(values, |p| p.0), mean(values, |p| p.1))).collect()
}

impl Drawing for Training {
    fn draw<B: DrawingBackend>(&self, area: &Area<B>) -> Result<(), Fault<B>> {
        let [x, y] = &self.axes;
        let chart = open_with_grid(area, FRAME, [x, y])?;
        for stage in &self.stages {
            path(&chart, &stage.points, line(pale(stage.colour, 0.35), 0.8))?;
            path(&chart, &averaged(&stage.points), line(stage.colour, 2.0))?;
        }
        let place = |value: f64| FRAME.at[0] + FRAME.size[0] * x.fraction(value);
        for stage in &self.stages {
            let start = place(stage.from);
            segment(area, [[start, FRAME.at[1]], [start, FRAME.at[1] + FRAME.size[1]]], line(FAINT, 0.75))?;
            let middle = 0.5 * (start + place(stage.to));
            write(
                area,
                &stage.name,
                [middle, FRAME.at[1] - 8.0],
                (TEXT, stage.colour),
                (HPos::Center, VPos::Bottom),
            )?;
            write(
                area,
                &stage.steps,
                [middle, FRAME.at[1] + FRAME.size[1] + 7.0],
                (TEXT, INK),
                (HPos::Center, VPos::Top),
            )?;
        }
        border(area, FRAME, [x, y], [x.ticks(), y.ticks()])
    }
}
