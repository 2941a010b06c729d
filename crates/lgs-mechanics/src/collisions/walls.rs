//! Further planes at rest that the impacts of a track lie on.

use super::body::{Body, Observed};
use super::freedom::{Freedom, Hypothesis};
use super::grounds::freedom_of;
use super::laws::FlightLaw;
use super::meeting::{Met, meeting};
use super::plane_of_impact::{freedom_at, plane_below, stops};
use super::thresholds::DEEPEST;
use crate::contact::{Contact, Ground, Impact, Plane};
use crate::thresholds::MOST_FRICTION;
use glam::DVec3;
use std::ops::Range;

/// A hypothesis with the planes at rest beside its own on which impacts between flights lie; `None` if all
/// that lie on one lie on its own. What lies on none of them is left to it: only points at rest make a wall
/// of what changes a velocity in mid-air.
pub(super) fn with_walls(
    (body, seen): (&Body, &Observed),
    law: &FlightLaw,
    (flights, impacts): (&[Range<usize>], &[Impact]),
    hypothesis: &Hypothesis,
) -> Option<Hypothesis> {
    let mut whole = hypothesis.clone();
    for index in 0..flights.len().saturating_sub(1) {
        let Some(met) = meeting(seen, law, (flights, impacts), index) else { continue };
        if whole.contact.planes().any(|plane| may_cause(plane, &met, &whole.contact)) {
            continue;
        }
        let causes = body.grounds.iter().filter(|ground| may_cause(&ground.plane, &met, &whole.contact));
        let direction = |ground: &&Ground| DVec3::from(ground.plane.normal).dot(met.change);
        if let Some(ground) = causes.max_by(|a, b| direction(a).total_cmp(&direction(b))) {
            let (plane, freedom) = wall((body, seen), ground, &met);
            whole.contact.walls.push(plane);
            whole.freedoms.push(freedom);
        }
    }
    (whole.freedoms.len() > hypothesis.freedoms.len()).then_some(whole)
}

/// A plane at rest that caused an impact: as its points show it or, where they fill a layer, across the
/// change of velocity.
fn wall((body, seen): (&Body, &Observed), ground: &Ground, met: &Met) -> (Plane, Freedom) {
    let across = met.change.try_normalize().filter(|_| !ground.is_sharp);
    match across {
        Some(normal) => (plane_below(body, &met.x, normal), freedom_at(body, &met.x)),
        None => {
            let lowest = Contact::of(ground.plane, &body.surface, 0.0).gap(&met.x);
            (ground.plane, freedom_of((body, seen), ground, lowest))
        }
    }
}

/// Whether a plane may have changed a velocity so: the body touches it there, and is pushed away from it
/// within the cone of the largest friction, no faster than it came.
pub(super) fn may_cause(plane: &Plane, met: &Met, contact: &Contact) -> bool {
    let normal = DVec3::from(plane.normal);
    let is_within_cone = met.change.dot(normal) * MOST_FRICTION.hypot(1.0) >= met.change.length();
    let is_stopped = met.before.is_none_or(|before| stops(before, met.change, normal));
    is_there(plane, met, contact) && is_within_cone && is_stopped
}

/// Whether the body is about as near to a plane as if it touched it.
pub(super) fn is_there(plane: &Plane, met: &Met, contact: &Contact) -> bool {
    contact.gap_to(plane, &met.x).abs() <= DEEPEST * contact.extent()
}
