//! PSNR of every run of a suite, split by split: the source model's and the Lagrangian scene's as dots on one
//! line.

use plotters::style::text_anchor::{HPos, VPos};
use plotters_backend::DrawingBackend;

use crate::axis::{Axis, padded};
use crate::canvas::{Area, Drawing, Fault, Figure};
use crate::chart::{Frame, TEXT, TITLE, border, dots, open, path, write};
use crate::error::ReportError;
use crate::legend::{Mark, legend};
use crate::style::{FAINT, GRID, INK, LAGRANGIAN, SOURCE, line};
use crate::suite_cell::{Cell, SPLITS};

const WIDTH: f64 = 820.0;
/// Upper left corner of the first split's plot, shown pixels.
const CORNER: [f64; 2] = [190.0, 60.0];
/// Between the plots of two splits, shown pixels.
const GAP: f64 = 14.0;
/// Height of a run's line, shown pixels.
const LINE: f64 = 19.0;
/// Letters of a run's name that fit.
const NAME: usize = 26;

struct Suite {
    names: Vec<String>,
    /// By split: its name, and both models' PSNR of every run.
    splits: Vec<(String, Vec<[Option<f64>; 2]>)>,
    x: Axis,
    y: Axis,
}

/// The chart; nothing without scores.
pub(crate) fn suite_figure(cells: &[Cell]) -> Result<Option<Figure>, ReportError> {
    let of = |cell: &Cell, split: &str| {
        let found = cell.metrics.as_ref().and_then(|m| m.splits.get(split));
        [found.and_then(|s| s.source.as_ref()), found.and_then(|s| s.lagrangian.as_ref())]
            .map(|s| s.and_then(|s| s.psnr))
    };
    let splits: Vec<(String, Vec<[Option<f64>; 2]>)> = SPLITS
        .iter()
        .map(|split| ((*split).to_owned(), cells.iter().map(|cell| of(cell, split)).collect::<Vec<_>>()))
        .filter(|(_, scores)| scores.iter().flatten().any(Option::is_some))
        .collect();
    let Some(range) = padded(splits.iter().flat_map(|(_, s)| s.iter().flatten().flatten().copied()), 0.06)
    else {
        return Ok(None);
    };
    let shortened = |name: &str| {
        if name.chars().count() <= NAME {
            name.to_owned()
        } else {
            name.chars().take(NAME - 1).chain(['…']).collect()
        }
    };
    let drawing = Suite {
        names: cells.iter().map(|c| shortened(&c.name)).collect(),
        x: Axis::linear(range, 4, "PSNR (dB)"),
        y: Axis::linear(0.0..cells.len() as f64, 1, ""),
        splits,
    };
    let caption = "PSNR of every run, by split; a line joins the source model with the Lagrangian \
        scene distilled from it.";
    let size = [WIDTH, CORNER[1] + drawing.panel()[1] + 50.0];
    Figure::of(("suite", caption), size, &drawing).map(Some)
}

impl Suite {
    fn panel(&self) -> [f64; 2] {
        let n = self.splits.len() as f64;
        [(WIDTH - CORNER[0] - GAP * n) / n, LINE * self.names.len() as f64]
    }
}

impl Drawing for Suite {
    fn draw<B: DrawingBackend>(&self, area: &Area<B>) -> Result<(), Fault<B>> {
        let dot = |colour, text: &str| (Mark::Dot, colour, text.to_owned());
        legend(area, [CORNER[0], 16.0], &[dot(SOURCE, "source"), dot(LAGRANGIAN, "Lagrangian")])?;
        let height = |run: usize| self.names.len() as f64 - run as f64 - 0.5;
        for (run, name) in self.names.iter().enumerate() {
            let y = CORNER[1] + LINE * (run as f64 + 0.5);
            write(area, name, [CORNER[0] - 10.0, y], (TEXT - 1.0, INK), (HPos::Right, VPos::Center))?;
        }
        for (column, (split, scores)) in self.splits.iter().enumerate() {
            let frame = Frame {
                at: [CORNER[0] + column as f64 * (self.panel()[0] + GAP), CORNER[1]],
                size: self.panel(),
            };
            let chart = open(area, frame, [&self.x, &self.y])?;
            for &tick in self.x.ticks() {
                path(&chart, &[(tick, 0.0), (tick, self.names.len() as f64)], line(GRID, 0.75))?;
            }
            for (run, [source, lagrangian]) in scores.iter().enumerate() {
                if let (Some(a), Some(b)) = (source, lagrangian) {
                    path(&chart, &[(*a, height(run)), (*b, height(run))], line(FAINT, 1.0))?;
                }
                for (score, colour) in [(source, SOURCE), (lagrangian, LAGRANGIAN)] {
                    let points: Vec<(f64, f64)> = score.map(|p| (p, height(run))).into_iter().collect();
                    dots(&chart, &points, 4.0, colour)?;
                }
            }
            border(area, frame, [&self.x, &self.y], [self.x.ticks(), &[]])?;
            let above = [frame.at[0] + 0.5 * frame.size[0], CORNER[1] - 8.0];
            write(area, split, above, (TITLE, INK), (HPos::Center, VPos::Bottom))?;
        }
        Ok(())
    }
}
