//! Rigid bodies made of textured solids, the scenes they form, and what a ray sees in one.

use super::motion::Motion;
use super::pose::Pose;
use super::shape::{Ray, Shape};
use super::texture::Texture;
use crate::edit::MotionEdit;
use glam::{DMat3, DVec3};

/// A textured solid in the axes of its body.
#[derive(Clone, Debug)]
pub(super) struct Part {
    pub(super) shape: Shape,
    pub(super) center: DVec3,
    /// Body axes from the solid's axes.
    pub(super) rotation: DMat3,
    pub(super) texture: Texture,
    /// Radius of a sphere around `center` that contains the solid.
    bound: f64,
}

/// A body: rigid, or deformed linearly.
#[derive(Clone, Debug)]
pub(super) struct Body {
    pub(super) name: &'static str,
    pub(super) motion: Motion,
    pub(super) parts: Vec<Part>,
    /// A point in body axes that has to stay in view.
    pub(super) center: DVec3,
}

/// Moving bodies, and fixed parts in world axes.
#[derive(Clone, Debug)]
pub(super) struct Stage {
    pub(super) bodies: Vec<Body>,
    pub(super) fixed: Vec<Part>,
}

/// Where a ray meets a part, in the axes of the part's body.
#[derive(Clone, Copy)]
pub(super) struct Meeting<'a> {
    pub(super) distance: f64,
    point: DVec3,
    normal: DVec3,
    texture: &'a Texture,
    part: (u16, u16),
}

/// The visible surface where a ray meets a part.
#[derive(Clone, Copy, Debug)]
pub(super) struct Hit {
    pub(super) distance: f64,
    pub(super) color: DVec3,
    /// Tells parts apart, for finding edges: number of the body and of its part.
    pub(super) part: (u16, u16),
}

impl Meeting<'_> {
    /// The number of the moving body; nothing for fixed parts.
    pub(super) fn body(&self) -> Option<usize> {
        (self.part.0 != FIXED).then_some(usize::from(self.part.0))
    }

    /// The visible surface with its unit normal in body axes, lit as the normal says.
    pub(super) fn lit(&self, light: impl FnOnce(DVec3) -> f64) -> Hit {
        let color = self.texture.reflectance(self.point) * light(self.normal);
        Hit { distance: self.distance, color: color.clamp(DVec3::ZERO, DVec3::ONE), part: self.part }
    }

    /// Colours are computed for what is seen, not for what is hidden behind it.
    pub(super) fn hit(&self) -> Hit {
        Hit { distance: self.distance, color: self.texture.color(self.point, self.normal), part: self.part }
    }
}

/// The body number of fixed parts.
const FIXED: u16 = u16::MAX;

impl Part {
    pub(super) fn new(shape: Shape, center: DVec3, texture: Texture) -> Self {
        Self { shape, center, rotation: DMat3::IDENTITY, texture, bound: shape.bound() }
    }

    pub(super) fn turned(self, axis: DVec3, angle: f64) -> Self {
        Self { rotation: DMat3::from_axis_angle(axis, angle) * self.rotation, ..self }
    }

    /// A body ray in the solid's axes.
    fn local(&self, ray: &Ray) -> Ray {
        let inverse = self.rotation.transpose();
        Ray { origin: inverse * (ray.origin - self.center), direction: inverse * ray.direction }
    }

    /// Whether a point in body axes is strictly inside.
    pub(super) fn contains(&self, p: DVec3) -> bool {
        self.shape.contains(self.rotation.transpose() * (p - self.center))
    }
}

impl Stage {
    /// The stage with the same start under an edit; nothing if any of the bodies has no law.
    pub(super) fn edited(&self, edit: MotionEdit) -> Option<Self> {
        let edited = |body: &Body| Some(Body { motion: body.motion.edited(edit)?, ..body.clone() });
        let bodies = self.bodies.iter().map(edited).collect::<Option<_>>()?;
        Some(Self { bodies, fixed: self.fixed.clone() })
    }
}

impl Body {
    /// A body of one part, about its origin.
    pub(super) fn of(name: &'static str, motion: Motion, part: Part) -> Self {
        Self { name, motion, parts: vec![part], center: DVec3::ZERO }
    }

    /// Radius of a sphere around the body's origin that contains it.
    pub(super) fn bound(&self) -> f64 {
        self.parts.iter().map(|part| part.center.length() + part.bound).fold(0.0, f64::max)
    }
}

/// The moving bodies of a stage at one time, ready for rays.
pub(super) struct Snapshot<'a> {
    moving: Vec<(&'a Body, Pose, f64)>,
}

impl<'a> Snapshot<'a> {
    pub(super) fn new(stage: &'a Stage, t: f64) -> Self {
        let at = |body: &'a Body| {
            let pose = body.motion.pose(t);
            (body, pose, body.bound() * pose.stretch)
        };
        Self { moving: stage.bodies.iter().map(at).collect() }
    }

    /// Whether a ray within the angle `spread` (radians, small) of the given one may meet a moving body.
    pub(super) fn is_near(&self, ray: &Ray, spread: f64) -> bool {
        self.moving.iter().any(|(_, pose, bound)| {
            let reach = bound + spread * (pose.position.distance(ray.origin) + bound);
            !passes_by(ray, pose.position, reach)
        })
    }

    /// A direction across the surface of a body in world axes, unit length, given in its own.
    pub(super) fn normal(&self, body: usize, normal: DVec3) -> DVec3 {
        (self.moving[body].1.inverse.transpose() * normal).normalize()
    }

    /// The first moving body that a ray meets.
    pub(super) fn meet(&self, ray: &Ray) -> Option<Meeting<'a>> {
        let mut best = None;
        for (number, (body, pose, bound)) in self.moving.iter().enumerate() {
            if passes_by(ray, pose.position, *bound) {
                continue;
            }
            let local = Ray {
                origin: pose.inverse * (ray.origin - pose.position),
                direction: pose.inverse * ray.direction,
            };
            best = nearest(&local, &body.parts, number as u16, best);
        }
        best
    }
}

/// The first fixed part that a ray meets.
pub(super) fn meet_fixed<'a>(stage: &'a Stage, ray: &Ray) -> Option<Meeting<'a>> {
    nearest(ray, &stage.fixed, FIXED, None)
}

fn nearest<'a>(
    ray: &Ray,
    parts: &'a [Part],
    body: u16,
    mut best: Option<Meeting<'a>>,
) -> Option<Meeting<'a>> {
    for (number, part) in parts.iter().enumerate() {
        if passes_by(ray, part.center, part.bound) {
            continue;
        }
        if let Some((distance, normal)) = part.shape.hit(&part.local(ray))
            && best.is_none_or(|other| distance < other.distance)
        {
            let (point, normal) = (ray.origin + distance * ray.direction, part.rotation * normal);
            best = Some(Meeting {
                distance,
                point,
                normal,
                texture: &part.texture,
                part: (body, number as u16),
            });
        }
    }
    best
}

/// Whether a ray misses a sphere.
fn passes_by(ray: &Ray, center: DVec3, radius: f64) -> bool {
    let to_center = center - ray.origin;
    let along = to_center.dot(ray.direction) / ray.direction.length_squared();
    to_center.length_squared() > radius * radius
        && (along < 0.0 || (to_center - along * ray.direction).length_squared() > radius * radius)
}
