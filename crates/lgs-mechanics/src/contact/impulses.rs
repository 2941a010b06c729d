//! Impulses at the contact points of a body.

use super::plane::Plane;
use super::surfaces::Contact;
use crate::coordinates::State;
use crate::thresholds::{ROUNDING_OF_VELOCITY, SOLVED_IMPULSE, SWEEPS};
use glam::{DMat3, DVec3};
use lgs_core::geometry::quaternion;

/// A body in world axes: mass 1, inertia in principal axes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Body {
    rotation: DMat3,
    center: DVec3,
    /// Inverse of the inertia, body axes; zero for a point, which does not turn.
    inverse: DMat3,
    /// Angular velocity, world axes.
    spin: DVec3,
    velocity: DVec3,
}

/// A contact point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Touch {
    /// Unit normal of the plane that it touches, world axes.
    pub(crate) plane_normal: DVec3,
    /// Height of its surface over the plane.
    pub(crate) gap: f64,
    /// From the centre to the surface, world axes.
    pub(crate) arm: DVec3,
    /// Normal velocity that the impulses must leave at least.
    pub(crate) least: f64,
    /// Impulse along the normal, then across it.
    pub(crate) normal: f64,
    pub(crate) across: DVec3,
}

impl Body {
    pub(crate) fn new(state: &State, inverse: Option<DMat3>) -> Self {
        match inverse {
            Some(inverse) => {
                let rotation = DMat3::from_quat(quaternion(&state.x));
                Self {
                    rotation,
                    center: DVec3::from_slice(&state.x[4..]),
                    inverse,
                    spin: rotation * DVec3::from_slice(&state.v),
                    velocity: DVec3::from_slice(&state.v[3..]),
                }
            }
            None => Self {
                rotation: DMat3::IDENTITY,
                center: DVec3::from_slice(&state.x),
                inverse: DMat3::ZERO,
                spin: DVec3::ZERO,
                velocity: DVec3::from_slice(&state.v),
            },
        }
    }

    /// A body at rest in a configuration, quaternion and centre or a centre alone.
    pub(crate) fn at(x: &[f64]) -> Self {
        let turns = x.len() > 3;
        let state = State { x: x.to_vec(), v: vec![0.0; if turns { 6 } else { 3 }] };
        Self::new(&state, turns.then_some(DMat3::IDENTITY))
    }

    /// The points of which the height over a plane is at most `reach`, plane by plane.
    pub(crate) fn touches(&self, contact: &Contact, reach: f64) -> Vec<Touch> {
        let of_plane = |plane: &Plane| {
            let (normal, base) = self.heights(plane, contact.radius);
            let plane_normal = DVec3::from(plane.normal);
            let touch = |point: &[f64; 3]| {
                let (point, gap) = (DVec3::from(*point), base + normal.dot((*point).into()));
                let arm = self.rotation * point - plane_normal * contact.radius;
                Touch { plane_normal, gap, arm, least: 0.0, normal: 0.0, across: DVec3::ZERO }
            };
            contact.points.iter().map(touch).filter(|touch| touch.gap <= reach).collect::<Vec<_>>()
        };
        contact.planes().flat_map(of_plane).collect()
    }

    /// Smallest height over the planes.
    pub(crate) fn gap(&self, contact: &Contact) -> f64 {
        contact.planes().map(|plane| self.gap_to(plane, contact)).fold(f64::INFINITY, f64::min)
    }

    /// Smallest height over a plane.
    fn gap_to(&self, plane: &Plane, contact: &Contact) -> f64 {
        let (normal, base) = self.heights(plane, contact.radius);
        let along = contact.points.iter().map(|point| normal.dot(DVec3::from(*point)));
        base + along.fold(f64::INFINITY, f64::min)
    }

    /// The normal of a plane in body axes, and the height of the surface around a point at the centre: that
    /// of others is higher by their product with the normal.
    fn heights(&self, plane: &Plane, radius: f64) -> (DVec3, f64) {
        let normal = self.rotation.transpose() * DVec3::from(plane.normal);
        (normal, plane.height(self.center) - radius)
    }

    /// The same place with the velocities of another.
    pub(crate) fn with_velocities(&self, other: &Self) -> Self {
        Self { spin: other.spin, velocity: other.velocity, ..*self }
    }

    /// Angular velocity, world axes.
    pub(crate) fn spin(&self) -> DVec3 {
        self.spin
    }

    /// Velocity of the centre.
    pub(crate) fn velocity(&self) -> DVec3 {
        self.velocity
    }

    /// Velocity of a touching point.
    fn velocity_at(&self, touch: &Touch) -> DVec3 {
        self.velocity + self.spin.cross(touch.arm)
    }

    /// Velocity of a touching point along the normal of its plane.
    pub(crate) fn velocity_along(&self, touch: &Touch) -> f64 {
        self.velocity_at(touch).dot(touch.plane_normal)
    }

    /// Fastest that a point up to a distance from the centre moves.
    pub(crate) fn fastest(&self, distance: f64) -> f64 {
        self.velocity.length() + self.spin.length() * distance
    }

    /// What impulses do to it where it is.
    fn mobility(&self) -> Mobility {
        Mobility(self.rotation * self.inverse * self.rotation.transpose())
    }

    /// Writes the velocities into a state.
    pub(crate) fn write(&self, state: &mut State) {
        let turns = state.v.len() - 3;
        if turns == 3 {
            state.v[..3].copy_from_slice(&(self.rotation.transpose() * self.spin).to_array());
        }
        state.v[turns..].copy_from_slice(&self.velocity.to_array());
    }
}

/// The inverse inertia of a body of mass 1, world axes.
struct Mobility(DMat3);

impl Mobility {
    /// Changes the velocities by an impulse at a point.
    fn push(&self, body: &mut Body, arm: DVec3, impulse: DVec3) {
        body.velocity += impulse;
        body.spin += self.0 * arm.cross(impulse);
    }

    /// Change of a point's velocity along a direction by a unit impulse there.
    fn response(&self, arm: DVec3, direction: DVec3) -> f64 {
        let lever = arm.cross(direction);
        1.0 + lever.dot(self.0 * lever)
    }
}

impl Contact {
    /// Height of the lowest point of a body in a configuration over the planes, world units.
    #[must_use]
    pub fn gap(&self, x: &[f64]) -> f64 {
        Body::at(x).gap(self)
    }

    /// The same over one plane.
    #[must_use]
    pub fn gap_to(&self, plane: &Plane, x: &[f64]) -> f64 {
        Body::at(x).gap_to(plane, self)
    }
}

/// Finds impulses by projected Gauss–Seidel: normal ones push only, and only as far as each point's least
/// velocity asks for; those across the normal oppose sliding within Coulomb's cone.
pub(crate) fn solve(body: &mut Body, touches: &mut [Touch], contact: &Contact) {
    let mobility = body.mobility();
    let response = |touch: &Touch| mobility.response(touch.arm, touch.plane_normal);
    let responses: Vec<f64> = touches.iter().map(response).collect();
    let reach = touches.iter().map(|touch| touch.arm.length()).fold(0.0, f64::max);
    // Impulses of a short step are small against the velocities, which are known no better than this.
    let rounding = ROUNDING_OF_VELOCITY * touches.len() as f64 * body.fastest(reach);
    for _ in 0..SWEEPS {
        let (mut change, mut sum) = (0.0, 0.0);
        for (touch, response) in touches.iter_mut().zip(&responses) {
            let normal = touch.plane_normal;
            let missing = touch.least - body.velocity_along(touch);
            let push = (touch.normal + missing / response).max(0.0);
            let by = push - touch.normal;
            mobility.push(body, touch.arm, normal * by);
            touch.normal = push;
            let slide = body.velocity_at(touch).reject_from(normal);
            let mut across = touch.across;
            if let Some(direction) = slide.try_normalize() {
                across -= slide / mobility.response(touch.arm, direction);
            }
            across = across.clamp_length_max(contact.friction * touch.normal);
            let turned = across - touch.across;
            mobility.push(body, touch.arm, turned);
            touch.across = across;
            change += by.abs() + turned.length();
            sum += push;
        }
        if change <= SOLVED_IMPULSE * sum + rounding {
            break;
        }
    }
}
