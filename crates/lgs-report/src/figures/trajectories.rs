//! Paths of particles through truth, source model and Lagrangian scene, side by side in the plane of the
//! motion.

use plotters::style::RGBColor;
use plotters::style::text_anchor::{HPos, VPos};
use plotters_backend::DrawingBackend;

use crate::axis::{Axis, number, padded};
use crate::canvas::{Area, Drawing, Fault, Figure};
use crate::chart::{Frame, TITLE, border, dots, open_with_grid, path, write};
use crate::error::ReportError;
use crate::legend::{Mark, legend};
use crate::paths::{Paths, Tracks};
use crate::plane::Plane;
use crate::style::{FAINT, LAGRANGIAN, SOURCE, TRUTH, line, object_colour, pale};

const WIDTH: f64 = 820.0;
const LEFT: f64 = 76.0;
const TOP: f64 = 62.0;
const GAP: f64 = 16.0;
/// Height of the panels, shown pixels.
const HEIGHTS: [f64; 2] = [170.0, 430.0];

struct Panel<'a> {
    title: &'static str,
    colour: RGBColor,
    tracks: &'a Tracks,
}

/// The axes of a panel that have numbers and a name: panels side by side share the vertical one.
#[derive(Clone, Copy)]
enum Numbers {
    BothAxes,
    HorizontalAxis,
}

struct Trajectories<'a> {
    paths: &'a Paths,
    panels: Vec<Panel<'a>>,
    plane: Plane,
    axes: [Axis; 2],
    panel: [f64; 2],
}

/// The figure; nothing without dynamic Gaussians.
pub(crate) fn figure(paths: &Paths) -> Result<Option<Figure>, ReportError> {
    let plane = Plane::of_motion(&paths.truth.as_ref().unwrap_or(&paths.lagrangian).positions);
    let panel = |title, colour, tracks| Panel { title, colour, tracks };
    let mut panels = Vec::new();
    panels.extend(paths.truth.as_ref().map(|tracks| panel("truth", TRUTH, tracks)));
    panels.extend(paths.source.as_ref().map(|tracks| panel("source", SOURCE, tracks)));
    panels.push(panel("Lagrangian", LAGRANGIAN, &paths.lagrangian));
    let n = panels.len() as f64;
    let width = (WIDTH - LEFT - GAP * n) / n;
    // The truth decides what is seen, so that a model that flies off is seen to leave.
    let limits = paths.truth.as_ref().unwrap_or(&paths.lagrangian);
    let points: Vec<(f64, f64)> = limits.positions.iter().flatten().map(|&p| plane.project(p)).collect();
    let (Some(x), Some(y)) =
        (padded(points.iter().map(|p| p.0), 0.06), padded(points.iter().map(|p| p.1), 0.06))
    else {
        return Ok(None);
    };
    let (x, y, height) = equal_scales(x, y, width, HEIGHTS);
    let labels = plane.labels();
    let axes = [
        Axis::linear(x, (width / 55.0) as usize, &labels[0]),
        Axis::linear(y, (height / 45.0) as usize, &labels[1]),
    ];
    let caption = format!(
        "Paths of {} particles over t = {} … {}, seen in the plane of the motion; dots: t = 0. Thick: the \
            captured window. Axes in world units. The source model knows nothing outside of it.",
        paths.particles.len(),
        number(-paths.window, 2),
        number(3.0 * paths.window, 2)
    );
    let drawing = Trajectories { paths, panels, plane, axes, panel: [width, height] };
    Figure::of(("trajectories", &caption), [WIDTH, TOP + height + 48.0], &drawing).map(Some)
}

/// Ranges widened until one unit is as long on both axes of a panel of this width, and the panel's height.
pub(super) fn equal_scales(
    x: std::ops::Range<f64>,
    y: std::ops::Range<f64>,
    width: f64,
    heights: [f64; 2],
) -> (std::ops::Range<f64>, std::ops::Range<f64>, f64) {
    let (dx, dy) = (x.end - x.start, y.end - y.start);
    let per_pixel = (dx / width).max(dy / heights[1]);
    let height = (dy / per_pixel).clamp(heights[0], heights[1]);
    let widened = |r: std::ops::Range<f64>, length: f64| {
        let middle = 0.5 * (r.start + r.end);
        middle - 0.5 * length..middle + 0.5 * length
    };
    (widened(x, width * per_pixel), widened(y, height * per_pixel), height)
}

impl Trajectories<'_> {
    fn entries(&self) -> Vec<(Mark, RGBColor, String)> {
        let objects = self.paths.objects();
        let mut entries = Vec::new();
        if objects.len() > 1 {
            entries
                .extend(objects.iter().map(|&o| (Mark::Line(2.0), object_colour(o), format!("object {o}"))));
        }
        let colour =
            if objects.len() > 1 { FAINT } else { object_colour(objects.first().copied().unwrap_or(0)) };
        entries.push((Mark::Line(2.0), colour, format!("observed, 0 … {}", number(self.paths.window, 2))));
        entries.push((Mark::Line(1.0), pale(colour, 0.6), "before and after".to_owned()));
        entries
    }

    fn draw_panel<B: DrawingBackend>(
        &self,
        area: &Area<B>,
        frame: Frame,
        panel: &Panel<'_>,
        axes: Numbers,
    ) -> Result<(), Fault<B>> {
        let [x, y] = &self.axes;
        let chart = open_with_grid(area, frame, [x, y])?;
        let track = |particle: usize| -> Vec<(f64, (f64, f64))> {
            let positions = panel.tracks.positions[particle].iter().map(|&p| self.plane.project(p));
            panel.tracks.times.iter().copied().zip(positions).collect()
        };
        let between = |track: &[(f64, (f64, f64))], low: f64, high: f64| -> Vec<(f64, f64)> {
            track.iter().filter(|(t, _)| (low - 1e-6..=high + 1e-6).contains(t)).map(|&(_, p)| p).collect()
        };
        for (index, particle) in self.paths.particles.iter().enumerate() {
            let (track, style) = (track(index), line(pale(object_colour(particle.object), 0.5), 0.9));
            path(&chart, &between(&track, f64::NEG_INFINITY, 0.0), style)?;
            path(&chart, &between(&track, self.paths.window, f64::INFINITY), style)?;
        }
        for (index, particle) in self.paths.particles.iter().enumerate() {
            let colour = object_colour(particle.object);
            let observed = between(&track(index), 0.0, self.paths.window);
            path(&chart, &observed, line(colour, 1.8))?;
            dots(&chart, &observed[..observed.len().min(1)], 2.2, colour)?;
        }
        let (numbers, label): (&[f64], Axis) = match axes {
            Numbers::BothAxes => (y.ticks(), y.clone()),
            Numbers::HorizontalAxis => (&[], y.clone().unnamed()),
        };
        border(area, frame, [x, &label], [x.ticks(), numbers])?;
        write(
            area,
            panel.title,
            [frame.at[0] + 0.5 * frame.size[0], frame.at[1] - 8.0],
            (TITLE, panel.colour),
            (HPos::Center, VPos::Bottom),
        )
    }
}

impl Drawing for Trajectories<'_> {
    fn draw<B: DrawingBackend>(&self, area: &Area<B>) -> Result<(), Fault<B>> {
        legend(area, [LEFT, 16.0], &self.entries())?;
        for (index, panel) in self.panels.iter().enumerate() {
            let at = [LEFT + index as f64 * (self.panel[0] + GAP), TOP];
            let axes = if index == 0 { Numbers::BothAxes } else { Numbers::HorizontalAxis };
            self.draw_panel(area, Frame { at, size: self.panel }, panel, axes)?;
        }
        Ok(())
    }
}
