//! What a recording holds, in the terms of the scene.

use lgs_core::{Camera, GaussianCloud};

use crate::picture::Picture;

/// When something holds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum When {
    /// At all times.
    Always,
    /// From a step of training on, on the timeline `step`.
    Step(usize),
    /// From a time of the scene on, on the timeline `time`.
    Time(f32),
}

/// What is recorded of an entity.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(not(feature = "rerun"), expect(dead_code, reason = "recordings alone read it"))]
pub(crate) enum Content<'a> {
    /// Gaussians with all that is drawn of them, colours as seen from anywhere.
    Gaussians(&'a GaussianCloud),
    /// Scales, opacities and colours of Gaussians, with their harmonics: what no motion changes.
    Looks(&'a GaussianCloud),
    /// Centres and quaternions `[w, x, y, z]` of Gaussians.
    Poses(&'a [[f32; 3]], &'a [[f32; 4]]),
    /// Pose and intrinsics of a camera.
    Camera(&'a Camera),
    /// An image.
    Picture(&'a Picture),
    /// A number of a curve.
    Number(f64),
    /// Name and colour of a curve.
    Curve(&'a str, [f32; 3]),
    /// A line of a log.
    Line(&'a str),
    /// A text in Markdown.
    Page(&'a str),
    /// A point with a name and a colour.
    Label(&'a str, [f32; 3]),
    /// The place of a point.
    Place([f32; 3]),
    /// An arrow by its origin, vector and colour.
    Arrow([f32; 3], [f32; 3], [f32; 3]),
    /// Paths of one colour.
    Paths(&'a [Vec<[f32; 3]>], [f32; 3]),
}
