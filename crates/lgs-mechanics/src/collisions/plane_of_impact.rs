//! The plane of an impact, where nothing at rest shows it.

use super::body::{Body, Observed};
use super::freedom::{Freedom, Hypothesis};
use super::laws::FlightLaw;
use super::meeting::{Met, meeting};
use super::thresholds::{FASTEST, WIDEST_TILT};
use crate::contact::{Contact, Impact, Origin, Plane};
use crate::thresholds::EXACT;
use glam::DVec3;
use std::ops::Range;

/// Planes of the first impact: one across the field that pulls the body down, as well as this is known, and
/// one across the change of velocity, which may tilt.
pub(super) fn fitted_planes(
    body: &Body,
    seen: &Observed,
    law: &FlightLaw,
    flights: &[Range<usize>],
    impacts: &[Impact],
) -> Vec<Hypothesis> {
    let Some(Met { x, before, change, .. }) = meeting(seen, law, (flights, impacts), 0) else {
        return Vec::new();
    };
    let plane = |normal: DVec3, tilt: f64, least: f64| {
        let contact = Contact::of(plane_below(body, &x, normal), &body.surface, 0.0);
        let freedom = Freedom { tilt, least, ..freedom_at(body, &x) };
        Hypothesis::of(Contact { origin: Origin::Fitted, ..contact }, freedom)
    };
    let field = field(law).filter(|field| field.dot(change) < 0.0);
    let level =
        field.and_then(|field| Some(plane((-field).try_normalize()?, tilt_of(field, law, seen), 1.0)));
    let tilted = change.try_normalize().map(|normal| plane(normal, WIDEST_TILT, 3.0));
    let allowed = |hypothesis: &Hypothesis| {
        let normal = DVec3::from(hypothesis.contact.plane.normal);
        before.is_none_or(|before| stops(before, change, normal))
    };
    level.into_iter().chain(tilted).filter(allowed).collect()
}

/// The plane with a normal that a body in a configuration touches.
pub(super) fn plane_below(body: &Body, x: &[f64], normal: DVec3) -> Plane {
    let through = Plane { normal: normal.to_array(), offset: 0.0 };
    let offset = Contact::of(through, &body.surface, 0.0).gap(x);
    Plane { offset, ..through }
}

/// How far a plane may be from the body in a configuration and from the change of velocity there.
pub(super) fn freedom_at(body: &Body, x: &[f64]) -> Freedom {
    let about = std::array::from_fn(|i| x[x.len() - 3 + i]);
    Freedom { about, tilt: WIDEST_TILT, shift: body.surface.extent(), least: 0.0 }
}

/// Whether a plane at rest can change a velocity so: the body comes towards it, and leaves it no faster.
pub(super) fn stops(before: DVec3, change: DVec3, normal: DVec3) -> bool {
    let approach = -before.dot(normal);
    change.dot(normal) <= (1.0 + FASTEST) * approach
}

/// How well the direction of a field is known, radians, from how well the places along a flight of a duration
/// `T` are: `n` places with an error σ tell an acceleration to within √(720/n) σ/T².
fn tilt_of(field: DVec3, law: &FlightLaw, seen: &Observed) -> f64 {
    let Some((flight, _)) = law.flights.iter().max_by_key(|(range, _)| range.len()) else { return EXACT };
    let duration = seen.times[flight.end - 1] - seen.times[flight.start];
    let noise = law.noise_of_place();
    let independent = flight.len() as f64 * (1.0 - noise.correlation) / (1.0 + noise.correlation);
    let acceleration = noise.deviation * (720.0 / independent.max(1.0)).sqrt() / duration.powi(2);
    (acceleration / field.length()).clamp(EXACT, WIDEST_TILT)
}

/// The uniform field of a law.
fn field(law: &FlightLaw) -> Option<DVec3> {
    let motion = law.motion().ok()?;
    let index = motion.terms.iter().position(|term| term.kind.name() == "uniform-field")?;
    motion.parameters.get(motion.range(index)).map(DVec3::from_slice)
}
