//! The potential of every object on the plane of its motion (gap G63): U from its minimum, −∇U as arrows, and the true force beside it.

use lgs_core::Image;
use lgs_eval::physics::potential::TrueForce;
use lgs_model::{LagrangianScene, ObjectModel};
use plotters::element::{PathElement, Rectangle};
use plotters::style::colors::colormaps::{ColorMap, ViridisRGB};
use plotters::style::text_anchor::{HPos, VPos};
use plotters_backend::DrawingBackend;

use super::trajectories::equal_scales;
use crate::axis::{Axis, padded};
use crate::canvas::{Area, Drawing, Fault, Figure, Picture};
use crate::chart::{Frame, Mark, TEXT, TITLE, arrow, border, canvas, dots, legend, open, path, segment, write};
use crate::error::ReportError;
use crate::paths::Paths;
use crate::plane::Plane;
use crate::style::{FAINT, INK, LAGRANGIAN, PAPER, TRUTH, filled, line, pale};

/// Panels at most.
const PANELS: usize = 4;
/// Levels of the colour map.
const LEVELS: usize = 24;
/// Strength of the map's colours, so that arrows stand out.
const STRENGTH: f64 = 0.55;
/// Grid on which U is evaluated.
const GRID: [usize; 2] = [97, 97];
/// Distance of arrows, shown pixels.
const SPACING: f64 = 40.0;

const LEFT: f64 = 66.0;
const TOP: f64 = 58.0;
const BAR: f64 = 74.0;

/// One object's potential on its plane.
struct Panel {
    title: String,
    axes: [Axis; 2],
    frame: Frame,
    /// U above its minimum on [`GRID`] points, bottom row first.
    values: Vec<f64>,
    highest: f64,
    /// Place and direction of −∇U and of the true force, in the plane's coordinates.
    arrows: Vec<([f64; 2], [f64; 2], Option<[f64; 2]>)>,
    paths: Vec<Vec<(f64, f64)>>,
    /// Which points of every path were observed.
    observed: std::ops::Range<usize>,
}

struct Potential {
    panels: Vec<Panel>,
    size: [f64; 2],
}

/// The figure; nothing without movers. `forces` are the true ones, by object.
pub(crate) fn figure(scene: &LagrangianScene, paths: &Paths, forces: &[Option<TrueForce>]) -> Result<Option<Figure>, ReportError> {
    let objects: Vec<usize> = paths.objects().into_iter().take(PANELS).collect();
    if objects.is_empty() {
        return Ok(None);
    }
    let columns = objects.len().min(2);
    let width = if columns == 1 { 520.0 } else { 270.0 };
    let heights = if columns == 1 { [200.0, 460.0] } else { [150.0, 320.0] };
    let mut panels: Vec<Panel> = objects
        .iter()
        .filter_map(|&o| panel(&scene.objects[o], (o, paths), forces.get(o).and_then(Option::as_ref), (width, heights)))
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
    let known = panels.iter().flat_map(|p| &p.arrows).any(|(_, _, truth)| truth.is_some());
    let caption = format!(
        "The learned potential U of each object, from its minimum, on the plane of the object’s motion through its centre; arrows: the force −∇U{}. White: paths of particles, thick where observed. Axes in world units, U in squared world units per squared time.",
        if known { " (blue) over the true one (black)" } else { "" }
    );
    Figure::of("potential", &caption, &Potential { panels, size }).map(Some)
}

fn panel(
    object: &ObjectModel,
    (index, paths): (usize, &Paths),
    truth: Option<&TrueForce>,
    (width, heights): (f64, [f64; 2]),
) -> Option<Panel> {
    let tracks: Vec<&Vec<[f32; 3]>> = paths.of_object(index).map(|i| &paths.lagrangian.positions[i]).collect();
    let plane = Plane::of_motion(&tracks.iter().map(|t| (*t).clone()).collect::<Vec<_>>());
    let projected: Vec<Vec<(f64, f64)>> = tracks.iter().map(|t| t.iter().map(|&p| plane.project(p)).collect()).collect();
    let x = padded(projected.iter().flatten().map(|p| p.0), 0.1)?;
    let y = padded(projected.iter().flatten().map(|p| p.1), 0.1)?;
    let (x, y, height) = equal_scales(x, y, width, heights);
    let at = |i: usize, n: usize, r: &std::ops::Range<f64>| r.start + (r.end - r.start) * i as f64 / (n - 1) as f64;
    let grid: Vec<[f32; 3]> = (0..GRID[1])
        .flat_map(|j| (0..GRID[0]).map(move |i| (i, j)))
        .map(|(i, j)| plane.position([at(i, GRID[0], &x), at(j, GRID[1], &y)]))
        .collect();
    let values: Vec<f64> = object.system.potentials(&grid).into_iter().map(f64::from).collect();
    let lowest = values.iter().copied().fold(f64::INFINITY, f64::min);
    let highest = values.iter().copied().fold(f64::NEG_INFINITY, f64::max) - lowest;
    if !(lowest.is_finite() && highest.is_finite()) {
        return None;
    }
    let counts = [(width / SPACING) as usize, (height / SPACING) as usize];
    let middle = |i: usize, n: usize, r: &std::ops::Range<f64>| r.start + (r.end - r.start) * (i as f64 + 0.5) / n as f64;
    let places: Vec<[f64; 2]> =
        (0..counts[0] * counts[1]).map(|i| [middle(i % counts[0], counts[0], &x), middle(i / counts[0], counts[1], &y)]).collect();
    let positions: Vec<[f32; 3]> = places.iter().map(|&p| plane.position(p)).collect();
    let gradients = object.system.potential_gradients(&positions);
    let arrows = places
        .iter()
        .zip(&positions)
        .zip(&gradients)
        .map(|((&place, &q), g)| {
            let true_force = truth.map(|t| plane.direction(t.at(q.map(f64::from))));
            (place, plane.direction(g.map(|c| -f64::from(c))), true_force)
        })
        .collect();
    let labels = plane.labels();
    Some(Panel {
        title: format!("object {index}: {} Gaussians", object.members.len()),
        axes: [Axis::linear(x, (width / 60.0) as usize, &labels[0]), Axis::linear(y, (height / 50.0) as usize, &labels[1])],
        frame: Frame { at: [0.0; 2], size: [width, height] },
        values: values.into_iter().map(|u| u - lowest).collect(),
        highest: highest.max(1e-12),
        arrows,
        paths: projected,
        observed: observed(paths),
    })
}

/// The points of a track that lie in the captured window.
fn observed(paths: &Paths) -> std::ops::Range<usize> {
    let times = &paths.lagrangian.times;
    times.partition_point(|&t| t < -1e-6)..times.partition_point(|&t| t <= paths.window + 1e-6)
}

/// The colour of a level, 0 to 1.
fn colour(level: f64) -> plotters::style::RGBColor {
    pale(ViridisRGB.get_color(level.clamp(0.0, 1.0)), STRENGTH)
}

/// A value in steps.
fn banded(part: f64) -> f64 {
    ((part * LEVELS as f64).floor().clamp(0.0, LEVELS as f64 - 1.0) + 0.5) / LEVELS as f64
}

impl Panel {
    /// The colour map, two pixels per shown pixel.
    fn map(&self) -> Image {
        let size = self.frame.size.map(|s| (2.0 * s).round() as usize);
        let mut image = Image::filled(size[0] as u32, size[1] as u32, [1.0; 3]);
        for (row, line) in image.pixels.chunks_exact_mut(size[0]).enumerate() {
            let v = 1.0 - (row as f64 + 0.5) / size[1] as f64;
            for (column, pixel) in line.iter_mut().enumerate() {
                let u = (column as f64 + 0.5) / size[0] as f64;
                let c = colour(banded(self.interpolated(u, v) / self.highest));
                *pixel = [c.0, c.1, c.2].map(|b| f32::from(b) / 255.0);
            }
        }
        image
    }

    /// U between grid points, bilinear; `u`, `v` in [0, 1].
    fn interpolated(&self, u: f64, v: f64) -> f64 {
        let [x, y] = [u * (GRID[0] - 1) as f64, v * (GRID[1] - 1) as f64];
        let [i, j] = [(x as usize).min(GRID[0] - 2), (y as usize).min(GRID[1] - 2)];
        let (s, t) = (x - i as f64, y - j as f64);
        let at = |di: usize, dj: usize| self.values[(j + dj) * GRID[0] + i + di];
        (1.0 - t) * ((1.0 - s) * at(0, 0) + s * at(1, 0)) + t * ((1.0 - s) * at(0, 1) + s * at(1, 1))
    }

    fn draw<B: DrawingBackend>(&self, area: &Area<B>) -> Result<(), Fault<B>> {
        let (frame, [x, y]) = (self.frame, &self.axes);
        let chart = open(area, frame, [x, y], false)?;
        for points in &self.paths {
            path(&chart, points, line(PAPER, 0.8))?;
            path(&chart, &points[self.observed.clone()], line(PAPER, 2.0))?;
        }
        let longest =
            self.arrows.iter().flat_map(|(_, own, truth)| [Some(*own), *truth]).flatten().map(|a| a[0].hypot(a[1])).fold(0.0, f64::max);
        let scale = if longest > 0.0 { 0.85 * SPACING / longest } else { 0.0 };
        for (place, own, truth) in &self.arrows {
            let middle = frame.place(x, y, *place);
            let end = |force: &[f64; 2], part: f64| [middle[0] + part * scale * force[0], middle[1] - part * scale * force[1]];
            if let Some(truth) = truth {
                arrow(area, [end(truth, -0.5), end(truth, 0.5)], 3.0, TRUTH)?;
            }
            arrow(area, [end(own, -0.5), end(own, 0.5)], 1.4, if truth.is_some() { pale(LAGRANGIAN, 0.75) } else { LAGRANGIAN })?;
        }
        let starts: Vec<(f64, f64)> = self.paths.iter().filter_map(|p| p.get(self.observed.start)).copied().collect();
        dots(&chart, &starts, 2.4, PAPER)?;
        border(area, frame, [x, y], [x.ticks(), y.ticks()])?;
        write(area, &self.title, [frame.at[0], frame.at[1] - 8.0], TITLE, INK, (HPos::Left, VPos::Bottom))?;
        self.bar(area)
    }

    /// The scale of colours.
    fn bar<B: DrawingBackend>(&self, area: &Area<B>) -> Result<(), Fault<B>> {
        let (x, top, height) = (self.frame.at[0] + self.frame.size[0] + 12.0, self.frame.at[1], self.frame.size[1]);
        let axis = Axis::linear(0.0..self.highest, 5, "");
        for level in 0..LEVELS {
            let from = top + height * (1.0 - (level + 1) as f64 / LEVELS as f64);
            let corners = [canvas([x, from]), canvas([x + 12.0, from + height / LEVELS as f64 + 0.3])];
            area.draw(&Rectangle::new(corners, filled(colour((level as f64 + 0.5) / LEVELS as f64))))?;
        }
        let outline = [[x, top], [x + 12.0, top], [x + 12.0, top + height], [x, top + height], [x, top]];
        area.draw(&PathElement::new(outline.map(canvas).to_vec(), line(FAINT, 0.75)))?;
        for &tick in axis.ticks() {
            let at = top + (1.0 - axis.fraction(tick)) * height;
            segment(area, [[x + 12.0, at], [x + 16.0, at]], line(FAINT, 0.75))?;
            write(area, &axis.written(tick), [x + 19.0, at], TEXT, INK, (HPos::Left, VPos::Center))?;
        }
        write(area, "U", [x + 6.0, top - 8.0], TITLE, INK, (HPos::Center, VPos::Bottom))
    }
}

impl Drawing for Potential {
    fn size(&self) -> [f64; 2] {
        self.size
    }

    fn pictures(&self) -> Vec<Picture> {
        self.panels.iter().map(|p| Picture { at: p.frame.at, size: p.frame.size, image: p.map() }).collect()
    }

    fn draw<B: DrawingBackend>(&self, area: &Area<B>) -> Result<(), Fault<B>> {
        let mut entries = vec![(Mark::Arrow, LAGRANGIAN, "−∇U, learned".to_owned())];
        if self.panels.iter().flat_map(|p| &p.arrows).any(|(_, _, truth)| truth.is_some()) {
            entries.push((Mark::Arrow, TRUTH, "true force".to_owned()));
        }
        legend(area, [LEFT, 16.0], &entries)?;
        self.panels.iter().try_for_each(|panel| panel.draw(area))
    }
}
