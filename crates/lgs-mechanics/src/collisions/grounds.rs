//! Planes that points at rest show, beside what a body's track tells of them.

use super::body::{Body, Observed};
use super::freedom::Freedom;
use super::thresholds::{AGREED, DEEPEST, NEAR_PLANE, WIDEST_TILT};
use crate::contact::{Contact, Ground, Plane};
use glam::DVec3;

/// Whether a plane at a place is one at rest, as far as its points tell.
pub(super) fn agree(plane: &Plane, ground: &Ground, (about, body): (DVec3, &Body)) -> bool {
    is_near(plane, ground, (about, body)) && has_its_tilt(plane, ground, body)
}

/// Whether a plane at a place would lie in one at rest with another tilt than its points show: there are no
/// two planes in one place, and points that cluster about theirs know it better than an impact does.
pub(super) fn contradict(plane: &Plane, ground: &Ground, (about, body): (DVec3, &Body)) -> bool {
    ground.is_sharp
        && is_near(plane, ground, (about, body))
        && plane.tilt_to(&ground.plane) <= WIDEST_TILT
        && !has_its_tilt(plane, ground, body)
}

fn is_near(plane: &Plane, ground: &Ground, (about, body): (DVec3, &Body)) -> bool {
    let height = ground.plane.height(about) - plane.height(about);
    height.abs() <= DEEPEST * body.surface.extent()
}

fn has_its_tilt(plane: &Plane, ground: &Ground, body: &Body) -> bool {
    plane.tilt_to(&ground.plane) <= AGREED * ground.tilt_deviation(body.surface.extent())
}

/// How far a plane at rest may be from where its points show it, for a body whose lowest sample is at a
/// height over it: a sample farther off than poses are known says that surfaces are that far from their
/// particles.
pub(super) fn freedom_of((body, seen): (&Body, &Observed), ground: &Ground, lowest: f64) -> Freedom {
    Freedom {
        about: seen.centers()[seen.times.len() / 2],
        tilt: ground.tilt_deviation(body.surface.extent()),
        shift: near(body, seen).max(lowest.abs()).hypot(ground.roughness),
        least: 0.0,
    }
}

/// Height at which a pose counts as touching: no better are poses, plane and surface known.
pub(super) fn near(body: &Body, seen: &Observed) -> f64 {
    NEAR_PLANE * body.surface.extent() + seen.least[1]
}

/// Samples that are as near to the plane as poses are known.
pub(super) fn touching(body: &Body, seen: &Observed, contact: &Contact) -> Vec<bool> {
    let near = near(body, seen);
    seen.x.iter().map(|x| contact.gap(x) <= near).collect()
}
