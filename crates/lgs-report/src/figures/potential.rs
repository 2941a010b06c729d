//! The potential of every object on the plane of its motion: U from its minimum, −∇U as arrows, and
//! the true force beside it.

use lgs_eval::physics::potential::TrueForce;
use lgs_model::{LagrangianScene, ObjectModel};
use plotters::element::{PathElement, Rectangle};
use plotters::style::text_anchor::{HPos, VPos};
use plotters_backend::DrawingBackend;

use super::field::{Field, ForceArrow, LEVELS, level_colour};
use super::trajectories::equal_scales;
use crate::axis::{Axis, padded};
use crate::canvas::{Area, Drawing, Fault, Figure, Picture};
use crate::chart::{Frame, TEXT, TITLE, arrow, border, canvas, dots, open, path, segment, write};
use crate::error::ReportError;
use crate::legend::{Mark, legend};
use crate::paths::Paths;
use crate::plane::Plane;
use crate::style::{FAINT, INK, LAGRANGIAN, PAPER, TRUTH, filled, line, pale};
use crate::thresholds::{ARROW_SPACING, POTENTIAL_PANELS};

const LEFT: f64 = 76.0;
const TOP: f64 = 58.0;
const BAR: f64 = 74.0;

/// One object's potential on its plane.
struct Panel {
    title: String,
    axes: [Axis; 2],
    frame: Frame,
    field: Field,
    paths: Vec<Vec<(f64, f64)>>,
    /// Which points of every path were observed.
    observed: std::ops::Range<usize>,
}

struct Potential {
    panels: Vec<Panel>,
}

/// The figure; nothing without dynamic Gaussians. `forces` are the true ones, by object.
pub(crate) fn figure(
    scene: &LagrangianScene,
    paths: &Paths,
    forces: &[Option<TrueForce>],
) -> Result<Option<Figure>, ReportError> {
    let objects: Vec<usize> = paths.objects().into_iter().take(POTENTIAL_PANELS).collect();
    if objects.is_empty() {
        return Ok(None);
    }
    let columns = objects.len().min(2);
    let width = if columns == 1 { 520.0 } else { 270.0 };
    let heights = if columns == 1 { [200.0, 460.0] } else { [150.0, 320.0] };
    let mut panels: Vec<Panel> = objects
        .iter()
        .filter_map(|&o| {
            panel(&scene.objects[o], (o, paths), forces.get(o).and_then(Option::as_ref), (width, heights))
        })
        .collect();
    let mut y = TOP;
    for row in panels.chunks_mut(columns) {
        for (column, panel) in row.iter_mut().enumerate() {
            panel.frame.at = [LEFT + column as f64 * (width + BAR + LEFT), y];
        }
        y += row.iter().map(|p| p.frame.size[1]).fold(0.0, f64::max) + 78.0;
    }
    let Some(last) = panels.first() else { return Ok(None) };
    let size = [columns as f64 * (LEFT + last.frame.size[0] + BAR) + 8.0, y - 26.0];
    let known = panels.iter().any(|p| p.field.arrows.iter().any(|a| a.truth.is_some()));
    let caption = format!(
        "The learned potential U of each object, from its minimum, on the plane of the object's motion \
            through its centre; arrows: the force −∇U{}. White: paths of particles, thick where observed. \
            Axes in world units, U in squared world units per squared time.",
        if known { " (blue) over the true one (black)" } else { "" }
    );
    Figure::of(("potential", &caption), size, &Potential { panels }).map(Some)
}

fn panel(
    object: &ObjectModel,
    (index, paths): (usize, &Paths),
    truth: Option<&TrueForce>,
    (width, heights): (f64, [f64; 2]),
) -> Option<Panel> {
    let tracks: Vec<&Vec<[f32; 3]>> =
        paths.of_object(index).map(|i| &paths.lagrangian.positions[i]).collect();
    let plane = Plane::of_motion(&tracks.iter().map(|t| (*t).clone()).collect::<Vec<_>>());
    let projected: Vec<Vec<(f64, f64)>> =
        tracks.iter().map(|t| t.iter().map(|&p| plane.project(p)).collect()).collect();
    let x = padded(projected.iter().flatten().map(|p| p.0), 0.1)?;
    let y = padded(projected.iter().flatten().map(|p| p.1), 0.1)?;
    let (x, y, height) = equal_scales(x, y, width, heights);
    let field = Field::of(
        &object.dynamics,
        truth,
        (&plane, &x, &y),
        [width, height].map(|s| (s / ARROW_SPACING) as usize),
    )?;
    let labels = plane.labels();
    Some(Panel {
        title: format!("object {index}: {} Gaussians", object.members.len()),
        axes: [
            Axis::linear(x, (width / 60.0) as usize, &labels[0]),
            Axis::linear(y, (height / 50.0) as usize, &labels[1]),
        ],
        frame: Frame { at: [0.0; 2], size: [width, height] },
        field,
        paths: projected,
        observed: observed(paths),
    })
}

/// The points of a track that lie in the captured window.
fn observed(paths: &Paths) -> std::ops::Range<usize> {
    let times = &paths.lagrangian.times;
    times.partition_point(|&t| t < -1e-6)..times.partition_point(|&t| t <= paths.window + 1e-6)
}

impl Panel {
    /// The colour map, two pixels per shown pixel.
    fn picture(&self) -> Picture {
        let [width, height] = self.frame.size.map(|s| (2.0 * s).round() as usize);
        Picture { at: self.frame.at, size: self.frame.size, image: self.field.map(width, height) }
    }

    fn draw<B: DrawingBackend>(&self, area: &Area<B>) -> Result<(), Fault<B>> {
        let (frame, [x, y]) = (self.frame, &self.axes);
        let chart = open(area, frame, [x, y])?;
        for points in &self.paths {
            path(&chart, points, line(PAPER, 0.8))?;
            path(&chart, &points[self.observed.clone()], line(PAPER, 2.0))?;
        }
        let strongest = self.field.strongest();
        let scale = if strongest > 0.0 { 0.85 * ARROW_SPACING / strongest } else { 0.0 };
        for ForceArrow { place, learned, truth } in &self.field.arrows {
            let middle = frame.place(x, y, *place);
            let end = |force: &[f64; 2], part: f64| {
                [middle[0] + part * scale * force[0], middle[1] - part * scale * force[1]]
            };
            if let Some(truth) = truth {
                arrow(area, [end(truth, -0.5), end(truth, 0.5)], 3.0, TRUTH)?;
            }
            arrow(
                area,
                [end(learned, -0.5), end(learned, 0.5)],
                1.4,
                if truth.is_some() { pale(LAGRANGIAN, 0.75) } else { LAGRANGIAN },
            )?;
        }
        let starts: Vec<(f64, f64)> =
            self.paths.iter().filter_map(|p| p.get(self.observed.start)).copied().collect();
        dots(&chart, &starts, 2.4, PAPER)?;
        border(area, frame, [x, y], [x.ticks(), y.ticks()])?;
        write(area, &self.title, [frame.at[0], frame.at[1] - 8.0], (TITLE, INK), (HPos::Left, VPos::Bottom))?;
        self.bar(area)
    }

    /// The scale of colours.
    fn bar<B: DrawingBackend>(&self, area: &Area<B>) -> Result<(), Fault<B>> {
        let (x, top, height) =
            (self.frame.at[0] + self.frame.size[0] + 12.0, self.frame.at[1], self.frame.size[1]);
        let axis = Axis::linear(0.0..self.field.highest, 5, "");
        for level in 0..LEVELS {
            let from = top + height * (1.0 - (level + 1) as f64 / LEVELS as f64);
            let corners = [canvas([x, from]), canvas([x + 12.0, from + height / LEVELS as f64 + 0.3])];
            area.draw(&Rectangle::new(corners, filled(level_colour(level))))?;
        }
        let outline = [[x, top], [x + 12.0, top], [x + 12.0, top + height], [x, top + height], [x, top]];
        area.draw(&PathElement::new(outline.map(canvas).to_vec(), line(FAINT, 0.75)))?;
        for &tick in axis.ticks() {
            let at = top + (1.0 - axis.fraction(tick)) * height;
            segment(area, [[x + 12.0, at], [x + 16.0, at]], line(FAINT, 0.75))?;
            write(area, &axis.written(tick), [x + 19.0, at], (TEXT, INK), (HPos::Left, VPos::Center))?;
        }
        write(area, "U", [x + 6.0, top - 8.0], (TITLE, INK), (HPos::Center, VPos::Bottom))
    }
}

impl Drawing for Potential {
    fn pictures(&self) -> Vec<Picture> {
        self.panels.iter().map(Panel::picture).collect()
    }

    fn draw<B: DrawingBackend>(&self, area: &Area<B>) -> Result<(), Fault<B>> {
        let mut entries = vec![(Mark::Arrow, LAGRANGIAN, "−∇U, learned".to_owned())];
        if self.panels.iter().any(|p| p.field.arrows.iter().any(|a| a.truth.is_some())) {
            entries.push((Mark::Arrow, TRUTH, "true force".to_owned()));
        }
        legend(area, [LEFT, 16.0], &entries)?;
        self.panels.iter().try_for_each(|panel| panel.draw(area))
    }
}
