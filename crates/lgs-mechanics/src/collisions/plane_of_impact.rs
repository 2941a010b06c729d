//! The plane of an impact, where nothing at rest shows it.

use super::body::{Body, Observed};
use super::freedom::Freedom;
use super::laws::FlightLaw;
use crate::contact::{Contact, Impact, Origin, Plane};
use crate::coordinates::State;
use crate::edit::Edit;
use crate::system::System;
use crate::thresholds::{EXACT, FASTEST, WIDEST_TILT};
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
) -> Vec<(Contact, Freedom)> {
    let Some(Met { x, before, change }) = first_impact(seen, law, (flights, impacts)) else {
        return Vec::new();
    };
    let extent = body.surface.extent();
    let about: [f64; 3] = std::array::from_fn(|i| x[x.len() - 3 + i]);
    let plane = |normal: DVec3, tilt: f64, least: f64| {
        let through = Plane { normal: normal.to_array(), offset: 0.0 };
        let offset = Contact::of(through, &body.surface, 0.0).gap(&x);
        let contact = Contact::of(Plane { offset, ..through }, &body.surface, 0.0);
        let freedom = Freedom { about, tilt, shift: extent, least };
        (Contact { origin: Origin::Fitted, ..contact }, freedom)
    };
    let field = field(law).filter(|field| field.dot(change) < 0.0);
    let level =
        field.and_then(|field| Some(plane((-field).try_normalize()?, tilt_of(field, law, seen), 1.0)));
    let tilted = change.try_normalize().map(|normal| plane(normal, WIDEST_TILT, 3.0));
    let allowed = |(contact, _): &(Contact, Freedom)| {
        let normal = DVec3::from(contact.plane.normal);
        before.is_none_or(|before| stops(before, change, normal))
    };
    level.into_iter().chain(tilted).filter(allowed).collect()
}

/// Whether a plane at rest can change a velocity so: the body comes towards it, and leaves it no faster.
fn stops(before: DVec3, change: DVec3, normal: DVec3) -> bool {
    let approach = -before.dot(normal);
    change.dot(normal) <= (1.0 + FASTEST) * approach
}

/// An impact as the flights before and after it have it.
struct Met {
    /// Configuration.
    x: Vec<f64>,
    /// Velocity of the centre before, if there are flights on both sides.
    before: Option<DVec3>,
    /// Change of that velocity.
    change: DVec3,
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

/// The first impact: where the first two flights meet, or as the samples around it have it.
fn first_impact(
    seen: &Observed,
    law: &FlightLaw,
    (flights, impacts): (&[Range<usize>], &[Impact]),
) -> Option<Met> {
    let since = seen.since();
    let end = flights[0].end;
    let meeting = law
        .flights
        .get(1)
        .filter(|_| flights.get(1).is_some_and(|next| next.contains(&law.flights[1].0.start)));
    let Some((range, after)) = meeting else {
        let first = impacts.first()?;
        let change = DVec3::from_slice(&first.change);
        return Some(Met { x: seen.x.get(end)?.clone(), before: None, change });
    };
    let motion = law.motion().ok()?;
    let system = System::new(&motion, Edit::NONE);
    let both = |time: f64| -> Option<[State; 2]> {
        let one = system.states(&law.flights[0].1, &[time]).ok()?.swap_remove(0);
        let other = system.states(after, &[time - since[range.start]]).ok()?.swap_remove(0);
        Some([one, other])
    };
    let tail = |values: &[f64]| DVec3::from_slice(&values[values.len() - 3..]);
    let mut time = 0.5 * (since[end - 1] + since[end.min(since.len() - 1)]);
    let mut found = None;
    for _ in 0..2 {
        let [before, after] = both(time)?;
        let change = tail(&after.v) - tail(&before.v);
        found = Some(Met { x: before.x.clone(), before: Some(tail(&before.v)), change });
        let apart =
            (tail(&after.x) - tail(&before.x)).dot(change) / change.length_squared().max(f64::MIN_POSITIVE);
        time = (time - apart).clamp(since[law.flights[0].0.end - 1], since[range.start]);
    }
    found
}
