//! The law through the impacts of a track, among all planes and impulses that may be their causes.

use super::body::{Body, Observed};
use super::bounced::{Bounced, likeliest};
use super::fit::through;
use super::flights::{flights, nested_impacts, with_hits};
use super::freedom::Hypothesis;
use super::grounds::{agree, contradict, freedom_of, touching};
use super::laws::{FlightLaw, FlightLaws};
use super::plane_of_impact::fitted_planes;
use super::struck::{through_hits, through_impulses, with_impulses};
use super::thresholds::{AS_NEAR, DEEPEST, LEAST_OF_BOUNCE};
use super::walls::with_walls;
use crate::choose::DESCRIBED;
use crate::contact::{Contact, Ground, Impact, Origin, Plane};
use crate::thresholds::LEAST_OF_LARGEST;
use glam::DVec3;
use std::ops::Range;

/// The law that explains a track with impacts best: with a contact on one of the planes at rest that the body
/// meets, or on one that the impacts themselves tell of, since points at rest may show a plane badly; with
/// impulses by something else; or with impulses between bounces off a plane at rest. The plane's origin is
/// [`Origin::Observed`] where it lies in one of those at rest. `None` where there is no impact or no law.
#[must_use]
pub fn explain(body: &Body, seen: &Observed) -> Option<Bounced> {
    let sets = nested_impacts(seen.times, &seen.centers(), LEAST_OF_LARGEST);
    // A contact explains no motion whose flights no law describes.
    let laws = FlightLaws::new(body, seen, DESCRIBED);
    let met = on_grounds((body, seen), &laws, &sets);
    let told = on_fitted_planes((body, seen), &laws, &sets);
    let contact = likeliest(met.into_iter().chain(told));
    // A term may follow what flights with starts of their own leave, and be none once they are one motion.
    let free = body.moving_freely();
    let laws = [&laws, &FlightLaws::new(&free, seen, DESCRIBED)];
    let through_sets =
        |laws| first_peak(sets[1..].iter().filter_map(|set| through_impulses(seen, laws, set)));
    let struck = likeliest(laws.into_iter().filter_map(through_sets));
    let hit = likeliest(laws.into_iter().filter_map(|laws| through_hits(seen, laws, &body.hits)));
    let mut found = likeliest([hit, before_impulses(contact, struck)].into_iter().flatten())?;
    let about = found.about.first().map_or(DVec3::ZERO, |&about| about.into());
    let is_seen = |plane: &Plane| body.grounds.iter().any(|ground| agree(plane, ground, (about, body)));
    if let Some(contact) = found.law.contact.as_mut().filter(|contact| is_seen(&contact.plane)) {
        contact.origin = Origin::Observed;
    }
    Some(found)
}

/// The law with a contact on one of the planes at rest. Hits of which others tell are tried beside the
/// impacts of the track. So are changes of velocity that are small beside a bounce: they count where the law
/// without them does not describe the motion or has taken them for noise.
fn on_grounds(
    (body, seen): (&Body, &Observed),
    laws: &FlightLaws<'_>,
    sets: &[Vec<Impact>],
) -> Option<Bounced> {
    let through = |sets: &[Vec<Impact>]| {
        likeliest(body.grounds.iter().filter_map(|ground| on_ground((body, seen), laws, ground, sets)))
    };
    let with_hits = with_hits(sets, &body.hits, seen.times);
    let met = likeliest([through(sets), through(&with_hits)].into_iter().flatten())?;
    let all = nested_impacts(seen.times, &seen.centers(), LEAST_OF_BOUNCE);
    let fainter = if all.len() > sets.len() { through(&all) } else { None };
    let shows = |found: &Bounced| {
        found.is_likelier_than(&met) && (!met.is_within_noise() || found.is_sharper_than(&met))
    };
    Some(fainter.filter(shows).unwrap_or(met))
}

/// The law with a contact on a plane that the impacts tell of, and that planes at rest do not contradict.
fn on_fitted_planes(
    (body, seen): (&Body, &Observed),
    laws: &FlightLaws<'_>,
    sets: &[Vec<Impact>],
) -> Option<Bounced> {
    let untouched = vec![false; seen.times.len()];
    let through_set = |impacts: &Vec<Impact>| {
        let flights = flights(seen.times, impacts, &untouched);
        let planes = |law: &FlightLaw| {
            let fitted = fitted_planes(body, seen, law, &flights, impacts);
            and_walls((body, seen), law, (&flights, impacts), fitted)
        };
        through((body, seen), laws, flights.clone(), &planes)
    };
    let is_possible = |found: &Bounced| {
        let against = |(plane, &about): (&Plane, &[f64; 3])| {
            body.grounds.iter().any(|ground| contradict(plane, ground, (about.into(), body)))
        };
        found.law.contact.as_ref().is_none_or(|contact| !contact.planes().zip(&found.about).any(against))
    };
    first_peak(sets[1..].iter().filter_map(through_set).filter(is_possible))
}

/// A contact, if it comes about as near to the samples as impulses do, which follow any track and know
/// nothing of what comes next; else the likelier one.
fn before_impulses(contact: Option<Bounced>, struck: Option<Bounced>) -> Option<Bounced> {
    match (contact, struck) {
        (Some(contact), Some(struck)) if contact.error > AS_NEAR * struck.error => {
            likeliest([contact, struck].into_iter())
        }
        (contact, struck) => contact.or(struck),
    }
}

/// The motion after which more impacts make the evidence worse; sets of impacts come in growing order.
fn first_peak(found: impl Iterator<Item = Bounced>) -> Option<Bounced> {
    let mut best: Option<Bounced> = None;
    for next in found {
        if best.as_ref().is_some_and(|best| !next.is_likelier_than(best)) {
            break;
        }
        best = Some(next);
    }
    best
}

/// The law with a contact on a plane at rest, if the body comes from above it and meets it.
fn on_ground(
    (body, seen): (&Body, &Observed),
    laws: &FlightLaws<'_>,
    ground: &Ground,
    sets: &[Vec<Impact>],
) -> Option<Bounced> {
    let contact = Contact { origin: Origin::Observed, ..Contact::of(ground.plane, &body.surface, 0.0) };
    let lowest = seen.x.iter().map(|x| contact.gap(x)).fold(f64::INFINITY, f64::min);
    let extent = body.surface.extent();
    if lowest.abs() > DEEPEST * extent {
        return None;
    }
    let touching = touching(body, seen, &contact);
    if touching[0] {
        return None;
    }
    let own = Hypothesis::of(contact, freedom_of((body, seen), ground, lowest));
    let mut parts: Vec<_> =
        sets.iter().map(|impacts| (flights(seen.times, impacts, &touching), impacts)).collect();
    parts.dedup_by(|(a, _), (b, _)| a == b);
    let stays_free = |flights: &[Range<usize>]| flights.len() == 1 && flights[0].len() == seen.times.len();
    parts.retain(|(flights, _)| !stays_free(flights));
    let through_part = |(flights, impacts): (Vec<Range<usize>>, &Vec<Impact>)| {
        let planes =
            |law: &FlightLaw| and_impulses((body, seen), law, (&flights, impacts), vec![own.clone()]);
        through((body, seen), laws, flights.clone(), &planes)
    };
    first_peak(parts.into_iter().filter_map(through_part))
}

/// Hypotheses, and those among them with walls.
fn and_walls(
    of: (&Body, &Observed),
    law: &FlightLaw,
    given: (&[Range<usize>], &[Impact]),
    mut hypotheses: Vec<Hypothesis>,
) -> Vec<Hypothesis> {
    let walled: Vec<_> = hypotheses.iter().filter_map(|own| with_walls(of, law, given, own)).collect();
    hypotheses.extend(walled);
    hypotheses
}

/// Hypotheses, those among them with walls, and of all these those with impulses by something else.
fn and_impulses(
    of: (&Body, &Observed),
    law: &FlightLaw,
    given: (&[Range<usize>], &[Impact]),
    hypotheses: Vec<Hypothesis>,
) -> Vec<Hypothesis> {
    let mut hypotheses = and_walls(of, law, given, hypotheses);
    let struck: Vec<_> = hypotheses.iter().filter_map(|own| with_impulses(of, law, given, own)).collect();
    hypotheses.extend(struck);
    hypotheses
}
