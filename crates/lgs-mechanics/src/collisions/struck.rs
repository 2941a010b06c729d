//! Motions that something outside of the law strikes.
//!
//! A ball that another one hits, or a thing that is pushed, changes its velocity where nothing at rest is and
//! in a direction that no plane explains. Its law is that of its flights; the impulses are given by time.

use super::body::{Body, Observed};
use super::bounced::{Bounced, likeliest};
use super::bouncing::Bouncing;
use super::flights::flights;
use super::freedom::Hypothesis;
use super::laws::{FlightLaw, FlightLaws};
use super::meeting::meeting;
use super::samples::Samples;
use super::walls::{is_there, may_cause};
use crate::contact::Impact;
use crate::law::Law;
use crate::thresholds::SAME_HIT;
use std::ops::Range;
use std::rc::Rc;

/// The motion through impulses where flights meet; `None` where the flights have no law, one of them is too
/// short to tell how it begins, or there is no impulse.
pub(super) fn through_impulses(
    seen: &Observed,
    laws: &FlightLaws<'_>,
    impacts: &[Impact],
) -> Option<Bounced> {
    let parts = flights(seen.times, impacts, &vec![false; seen.times.len()]);
    let (found, are_certain) = between(seen, (&parts, laws.of(&parts)?), impacts)?;
    are_certain.iter().all(|is_certain| *is_certain).then_some(found)
}

/// The motion through hits of which other bodies tell, by their times: those that this one shows, which may
/// have been near without being hit. Where no law goes through all of them, the likeliest motion through all
/// but one: the others may be mistaken.
pub(super) fn through_hits(seen: &Observed, laws: &FlightLaws<'_>, times: &[f64]) -> Option<Bounced> {
    let hits: Vec<Impact> = times.iter().map(|&time| Impact { time, change: Vec::new() }).collect();
    let without = |left_out: usize| {
        let others = hits.iter().enumerate().filter(|(index, _)| *index != left_out);
        through_certain(seen, laws, others.map(|(_, hit)| hit.clone()).collect())
    };
    through_certain(seen, laws, hits.clone()).or_else(|| likeliest((0..hits.len()).filter_map(without)))
}

/// The motion through those of some hits that are certain; `None` where no law goes through all of them.
fn through_certain(seen: &Observed, laws: &FlightLaws<'_>, mut hits: Vec<Impact>) -> Option<Bounced> {
    while !hits.is_empty() {
        let parts = flights(seen.times, &hits, &vec![false; seen.times.len()]);
        let (found, are_certain) = between(seen, (&parts, laws.of_all(&parts)?), &hits)?;
        if are_certain.iter().all(|is_certain| *is_certain) {
            return Some(found.knowing_hits(hits.len()));
        }
        let mut are_certain = are_certain.into_iter();
        hits.retain(|_| are_certain.next().unwrap_or(true));
    }
    None
}

/// The motion through impulses between flights with a law, and which of these are certain.
fn between(
    seen: &Observed,
    (parts, law): (&[Range<usize>], Rc<FlightLaw>),
    impacts: &[Impact],
) -> Option<(Bounced, Vec<bool>)> {
    if impacts.is_empty() || law.flights.len() != parts.len() {
        return None;
    }
    let since = seen.since();
    let impulse = |index: usize| meeting(seen, &law, (parts, impacts), index)?.impulse;
    let impulses = (0..impacts.len()).map(impulse).collect::<Option<_>>()?;
    let left_out = law.left_out(parts, since.len());
    let samples =
        Samples::new(seen.samples(0..since.len()), seen.x.to_vec(), &law.noise, (parts[0].end, left_out));
    let (motion, duration) = (Law { impulses, ..law.motion().ok()? }, since[since.len() - 1]);
    Bouncing::new(&law, motion, (since, samples), duration, &[]).solve([0.0; 2], seen.times[0])
}

/// A hypothesis with impulses where flights meet and no plane of it is the cause: in mid-air, or where other
/// bodies tell of a hit. `None` if there are none.
pub(super) fn with_impulses(
    (body, seen): (&Body, &Observed),
    law: &FlightLaw,
    (flights, impacts): (&[Range<usize>], &[Impact]),
    hypothesis: &Hypothesis,
) -> Option<Hypothesis> {
    let contact = &hypothesis.contact;
    let impulse = |index: usize| {
        let pair = flights.get(index..index + 2)?;
        let met = meeting(seen, law, (flights, impacts), index)?;
        let is_caused = contact.planes().any(|plane| may_cause(plane, &met, contact));
        let is_near = contact.planes().any(|plane| is_there(plane, &met, contact));
        let impulse = met.impulse?;
        let is_free = !is_near || is_told(body, seen, &impulse);
        (pair[0].end == pair[1].start && !is_caused && is_free).then_some(impulse)
    };
    let impulses: Vec<Impact> = (0..flights.len()).filter_map(impulse).collect();
    (!impulses.is_empty()).then(|| Hypothesis { impulses, ..hypothesis.clone() })
}

/// How many impulses are hits of which other bodies tell.
pub(super) fn told(body: &Body, seen: &Observed, impulses: &[Impact]) -> usize {
    impulses.iter().filter(|impulse| is_told(body, seen, impulse)).count()
}

/// Whether other bodies tell of a hit at the time of an impulse, which counts from the start of the track.
fn is_told(body: &Body, seen: &Observed, impulse: &Impact) -> bool {
    let count = seen.times.len();
    let interval = (seen.times[count - 1] - seen.times[0]) / (count - 1).max(1) as f64;
    body.hits.iter().any(|hit| (hit - seen.times[0] - impulse.time).abs() <= SAME_HIT * interval)
}
