//! The cameras of a dataset and the points it ships, from above and from the side.
//!
//! Up is the mean of the cameras' upward directions, whatever the axes of the world are; to the right is the
//! direction in which the cameras spread most. A camera is a pyramid over its image; a path of many poses is
//! drawn with a part of them.

use glam::{DMat3, DVec3};
use lgs_core::Camera;
use lgs_core::geometry::{outer, principal_axes, wide};
use lgs_data::dataset::{Dataset, Frame as Photograph};
use plotters::style::RGBColor;
use plotters::style::text_anchor::{HPos, VPos};
use plotters_backend::DrawingBackend;

use super::trajectories::equal_scales;
use crate::axis::{Axis, padded};
use crate::canvas::{Area, Drawing, Fault, Figure};
use crate::chart::{Frame, TITLE, border, dots, open_with_grid, path, write};
use crate::error::ReportError;
use crate::legend::{Mark, legend};
use crate::plane::Plane;
use crate::style::{FAINT, INK, line, object_colour};
use crate::thresholds::{DRAWN_CAMERAS, DRAWN_POINTS, PYRAMID};

const LEFT: f64 = 76.0;
const TOP: f64 = 64.0;
const WIDTH: f64 = 330.0;
const HEIGHTS: [f64; 2] = [120.0, 360.0];

/// A camera's centre and the corners of its image at the depth of its pyramid.
struct Pyramid {
    split: usize,
    tip: [f32; 3],
    corners: [[f32; 3]; 4],
}

/// One direction of view.
struct Panel {
    title: &'static str,
    plane: Plane,
    axes: [Axis; 2],
    frame: Frame,
}

struct Rig {
    panels: Vec<Panel>,
    pyramids: Vec<Pyramid>,
    points: Vec<[f32; 3]>,
    entries: Vec<(Mark, RGBColor, String)>,
}

/// The figure of a dataset's cameras.
///
/// # Errors
/// If plotters cannot draw.
pub fn rig_figure(dataset: &Dataset) -> Result<Figure, ReportError> {
    let all: Vec<(usize, &str, Vec<&Photograph>)> = dataset
        .splits
        .keys()
        .enumerate()
        .map(|(i, name)| (i, name.as_str(), dataset.cameras(name)))
        .collect();
    let cameras: Vec<&Camera> = all.iter().flat_map(|(_, _, frames)| frames).map(|f| &f.camera).collect();
    let size = PYRAMID * extent(&cameras);
    let pyramids: Vec<Pyramid> = all
        .iter()
        .flat_map(|(split, _, frames)| {
            let stride = frames.len().div_ceil(DRAWN_CAMERAS).max(1);
            frames.iter().step_by(stride).map(|frame| pyramid(*split, &frame.camera, size))
        })
        .collect();
    let points = dataset.init_points.as_ref().map_or(&[][..], |points| &points.positions);
    let stride = points.len().div_ceil(DRAWN_POINTS).max(1);
    let points: Vec<[f32; 3]> = points.iter().step_by(stride).copied().collect();
    let panels = panels(&cameras, &pyramids, &points);
    let entry = |(split, name, frames): &(usize, &str, Vec<&Photograph>)| {
        (Mark::Square, object_colour(*split), format!("{name}: {} cameras", frames.len()))
    };
    let mut entries: Vec<(Mark, RGBColor, String)> = all.iter().map(entry).collect();
    if !points.is_empty() {
        entries.push((Mark::Dot, FAINT, "points of the set".to_owned()));
    }
    let height = panels.iter().map(|panel| panel.frame.size[1]).fold(0.0, f64::max);
    let caption = "The cameras of the dataset by split, from above and from the side. Axes in world units.";
    let shown = [2.0 * (LEFT + WIDTH) + 12.0, TOP + height + 52.0];
    Figure::of(("rig", caption), shown, &Rig { panels, pyramids, points, entries })
}

/// Largest distance of a camera from the mean of all; 1 if they are at one place.
fn extent(cameras: &[&Camera]) -> f32 {
    let centers: Vec<DVec3> = cameras.iter().map(|camera| wide(camera.center_in_world())).collect();
    let mean = centers.iter().sum::<DVec3>() / centers.len().max(1) as f64;
    let most = centers.iter().map(|c| c.distance(mean)).fold(0.0, f64::max);
    if most > 0.0 { most as f32 } else { 1.0 }
}

fn pyramid(split: usize, camera: &Camera, size: f32) -> Pyramid {
    let tip = camera.center_in_world();
    let [w, h] = [camera.width as f32, camera.height as f32];
    let corner = |pixel: [f32; 2]| {
        let ray = camera.ray_direction_in_world(pixel);
        std::array::from_fn(|i| tip[i] + size * ray[i])
    };
    Pyramid { split, tip, corners: [[0.0, 0.0], [w, 0.0], [w, h], [0.0, h]].map(corner) }
}

fn panels(cameras: &[&Camera], pyramids: &[Pyramid], points: &[[f32; 3]]) -> Vec<Panel> {
    let up: DVec3 = cameras.iter().map(|c| -c.camera_from_world.row(1).truncate().as_dvec3()).sum();
    let up = up.normalize_or(DVec3::Z);
    let centers: Vec<DVec3> = cameras.iter().map(|camera| wide(camera.center_in_world())).collect();
    let origin = centers.iter().sum::<DVec3>() / centers.len().max(1) as f64;
    let level = |v: DVec3| v - up * v.dot(up);
    let spread = centers.iter().fold(DMat3::ZERO, |sum, c| sum + outer(level(c - origin), level(c - origin)));
    let [(_, first), ..] = principal_axes(&spread);
    let right = level(first).try_normalize().unwrap_or_else(|| up.any_orthonormal_vector());
    let views = [("from above", up.cross(right)), ("from the side", up)];
    let panel = |(column, (title, up)): (usize, (&'static str, DVec3))| {
        let plane = Plane { origin: DVec3::ZERO, right, up };
        let shown = pyramids.iter().flat_map(|p| p.corners.iter().chain([&p.tip])).chain(points);
        let places: Vec<(f64, f64)> = shown.map(|&p| plane.project(p)).collect();
        let range = |values: &mut dyn Iterator<Item = f64>| padded(values, 0.06).unwrap_or(-1.0..1.0);
        let x = range(&mut places.iter().map(|p| p.0));
        let y = range(&mut places.iter().map(|p| p.1));
        let (x, y, height) = equal_scales(x, y, WIDTH, HEIGHTS);
        let labels = plane.labels();
        let axes = [Axis::linear(x, 5, &labels[0]), Axis::linear(y, (height / 50.0) as usize, &labels[1])];
        let frame = Frame { at: [LEFT + column as f64 * (LEFT + WIDTH), TOP], size: [WIDTH, height] };
        Panel { title, plane, axes, frame }
    };
    views.into_iter().enumerate().map(panel).collect()
}

impl Drawing for Rig {
    fn draw<B: DrawingBackend>(&self, area: &Area<B>) -> Result<(), Fault<B>> {
        legend(area, [8.0, 18.0], &self.entries)?;
        for panel in &self.panels {
            let [x, y] = &panel.axes;
            let chart = open_with_grid(area, panel.frame, [x, y])?;
            let places: Vec<(f64, f64)> = self.points.iter().map(|&p| panel.plane.project(p)).collect();
            dots(&chart, &places, 0.6, FAINT)?;
            for pyramid in &self.pyramids {
                let at = |p: [f32; 3]| panel.plane.project(p);
                let [a, b, c, d] = pyramid.corners.map(at);
                let (tip, style) = (at(pyramid.tip), line(object_colour(pyramid.split), 0.8));
                path(&chart, &[a, b, c, d, a, tip, b], style)?;
                path(&chart, &[c, tip, d], style)?;
            }
            border(area, panel.frame, [x, y], [x.ticks(), y.ticks()])?;
            let above = [panel.frame.at[0], panel.frame.at[1] - 8.0];
            write(area, panel.title, above, (TITLE, INK), (HPos::Left, VPos::Bottom))?;
        }
        Ok(())
    }
}
