//! The potential of an object on the plane through its centre that faces the camera.

use glam::Vec3;
use lgs_core::Camera;
use lgs_model::Dynamics;

use crate::draw::{camera, check_time};
use crate::motions::Motions;
use crate::protocol::{FrameRequest, ObjectEdit, Slice};
use crate::subject::Subject;
use crate::thresholds::{SLICE_ARROW_LENGTH, SLICE_ARROWS, SLICE_COLUMNS};

/// A plane that faces a camera.
struct Facing<'a> {
    camera: &'a Camera,
    /// Depth of the plane, world units.
    depth: f32,
}

impl Facing<'_> {
    /// The place behind a point of the picture, in parts of its sides.
    fn place(&self, [u, v]: [f32; 2]) -> [f32; 3] {
        let camera = self.camera;
        let pixel = [u * camera.width as f32, v * camera.height as f32];
        let across = [(pixel[0] - camera.cx) / camera.fx, (pixel[1] - camera.cy) / camera.fy];
        let seen = Vec3::new(across[0] * self.depth, across[1] * self.depth, self.depth);
        camera.camera_from_world.inverse().transform_point3(seen).into()
    }

    /// The change of the point of the picture for a small step from the plane's middle, in parts of its
    /// sides.
    fn change(&self, step: [f32; 3]) -> [f32; 2] {
        let turned = self.camera.camera_from_world.transform_vector3(step.into());
        let camera = self.camera;
        [
            turned.x * camera.fx / (self.depth * camera.width as f32),
            turned.y * camera.fy / (self.depth * camera.height as f32),
        ]
    }
}

/// Samples the potential of an object in a picture.
pub(crate) fn slice(
    subject: &Subject,
    motions: &mut Motions,
    request: &FrameRequest,
    object: usize,
) -> Result<Slice, String> {
    check_time(subject, request.time)?;
    let camera = camera(subject, request)?;
    let members =
        subject.scene.objects.get(object).ok_or_else(|| format!("no object {object}"))?.members.clone();
    let state = motions.towards(request.time, &request.edits)?.state;
    let sum: Vec3 = members.clone().map(|row| Vec3::from(state.q[row])).sum();
    let center = sum / members.len().max(1) as f32;
    let (_, depth) = camera.pixel_from_world(center.into());
    if depth <= camera.near {
        return Err(format!("object {object} is behind the camera"));
    }
    let scale = request.edits.get(object).map_or(1.0, |edit: &ObjectEdit| edit.potential);
    let dynamics = motions.dynamics(&request.edits, object)?;
    let facing = Facing { camera: &camera, depth };
    sampled(&dynamics, &facing, scale)
        .ok_or_else(|| format!("the potential of object {object} is no function of a place"))
}

fn sampled(dynamics: &Dynamics, facing: &Facing<'_>, scale: f32) -> Option<Slice> {
    let aspect = facing.camera.height as f32 / facing.camera.width as f32;
    let rows = |columns: usize| ((columns as f32 * aspect).round() as usize).clamp(2, 4 * columns);
    let size = [SLICE_COLUMNS, rows(SLICE_COLUMNS)];
    let places: Vec<[f32; 3]> = grid(size).map(|at| facing.place(at)).collect();
    let values: Vec<f64> =
        dynamics.potentials_at(&places)?.into_iter().map(|value| value * f64::from(scale)).collect();
    let range = [f64::INFINITY, f64::NEG_INFINITY];
    let [low, high] = values.iter().fold(range, |[low, high], &v| [low.min(v), high.max(v)]);
    if !(high - low).is_finite() {
        return None;
    }
    let spread = (high - low).max(1e-12);
    let arrows = [SLICE_ARROWS, rows(SLICE_ARROWS)];
    let feet: Vec<[f32; 2]> = grid(arrows).collect();
    let places: Vec<[f32; 3]> = feet.iter().map(|&at| facing.place(at)).collect();
    let gradients = dynamics.potential_gradients_at(&places)?;
    let steps = gradients.iter().map(|gradient| facing.change(gradient.map(|g| -scale * g))).collect();
    Some(Slice {
        size,
        values: values.iter().map(|value| ((value - low) / spread) as f32).collect(),
        range: [low, high],
        arrows: fitted(&feet, steps, arrows),
    })
}

/// Middles of cells, row by row, in parts of the sides.
fn grid([columns, rows]: [usize; 2]) -> impl Iterator<Item = [f32; 2]> {
    let middle = |i: usize, n: usize| (i as f32 + 0.5) / n as f32;
    (0..columns * rows).map(move |i| [middle(i % columns, columns), middle(i / columns, rows)])
}

/// Arrows from feet along steps, the longest of which is nearly as long as a cell.
fn fitted(feet: &[[f32; 2]], steps: Vec<[f32; 2]>, [columns, rows]: [usize; 2]) -> Vec<[f32; 4]> {
    let length = |step: &[f32; 2]| (step[0] * columns as f32).hypot(step[1] * rows as f32);
    let longest = steps.iter().map(length).filter(|length| length.is_finite()).fold(0.0, f32::max);
    let factor = if longest > 0.0 { SLICE_ARROW_LENGTH / longest } else { 0.0 };
    let arrow = |(foot, step): (&[f32; 2], [f32; 2])| {
        [foot[0], foot[1], foot[0] + factor * step[0], foot[1] + factor * step[1]]
    };
    feet.iter().zip(steps).map(arrow).collect()
}
