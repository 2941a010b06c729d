//! Motions that something outside of the law strikes: start, law and impulses as the unknowns of one motion.
//!
//! A ball that another one hits, or a thing that is pushed, changes its velocity where nothing at rest is and
//! in a direction that no plane explains. Its law is that of its flights; the impulses are given by time.

use super::body::Observed;
use super::bounced::{Bounced, likeliest};
use super::flights::flights;
use super::laws::{FlightLaw, FlightLaws};
use super::samples::{Later, Samples};
use crate::contact::{Impact, noticeable};
use crate::coordinates::State;
use crate::edit::Edit;
use crate::fit::{Problem, Settings, Unknown, covariance_of, minimise};
use crate::law::Law;
use crate::system::System;
use crate::thresholds::{CONTACT_ITERATIONS, IMPACT_JUMP, MEETINGS};
use nalgebra::{DMatrix, DVector};
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
    let impulses = meetings(&law, &since, impacts)?;
    let left_out = law.left_out(parts, since.len());
    let samples =
        Samples::new(seen.samples(0..since.len()), seen.x.to_vec(), &law.noise, (parts[0].end, left_out));
    let window = [seen.times[0], seen.times[seen.times.len() - 1]];
    StruckMotion::new(&law, impulses, (since, samples))?.solve(window)
}

/// The impulses between flights, each at the time where the motions before and after it are nearest to each
/// other.
fn meetings(law: &FlightLaw, since: &[f64], impacts: &[Impact]) -> Option<Vec<Impact>> {
    let motion = law.motion().ok()?;
    let system = System::new(&motion, Edit::NONE);
    let of_pair = |(pair, impact): (&[(Range<usize>, State)], &Impact)| {
        let [(before, one), (after, other)] = pair else { return None };
        let at = |time: f64| -> Option<[State; 2]> {
            let first = system.states(one, &[time - since[before.start]]).ok()?.pop()?;
            Some([first, system.states(other, &[time - since[after.start]]).ok()?.pop()?])
        };
        let bounds = [since[before.end - 1], since[after.start]];
        let mut time = impact.time.clamp(bounds[0], bounds[1]);
        let mut change = Vec::new();
        for _ in 0..MEETINGS {
            let [first, then] = at(time)?;
            change = then.v.iter().zip(&first.v).map(|(after, before)| after - before).collect();
            let apart = motion.coordinates.difference(&first.x, &then.x);
            let along: f64 = apart.iter().zip(&change).map(|(x, v)| x * v).sum();
            let square: f64 = change.iter().map(|v| v * v).sum();
            time = (time - along / square.max(f64::MIN_POSITIVE)).clamp(bounds[0], bounds[1]);
        }
        Some(Impact { time, change })
    };
    law.flights.windows(2).zip(impacts).map(of_pair).collect()
}

/// A motion through impulses as a problem of least squares. Unknowns are the change of the start `[n]`, its
/// velocity `[n]`, the law's parameters, and time and change `[n]` of every impulse.
struct StruckMotion {
    law: Law,
    first: State,
    times: Vec<f64>,
    samples: Samples,
    unknowns: Vec<Unknown>,
}

impl StruckMotion {
    fn new(law: &FlightLaw, events: Vec<Impact>, (times, samples): (Vec<f64>, Samples)) -> Option<Self> {
        let first = law.flights[0].1.clone();
        let duration = times[times.len() - 1];
        let interval = duration / (times.len() - 1) as f64;
        let free = |scale: f64| Unknown { scale, lower: f64::NEG_INFINITY, upper: f64::INFINITY };
        let mut unknowns: Vec<Unknown> = law.scales_of_changes(duration).into_iter().map(free).collect();
        for (unknown, [lower, upper]) in unknowns[2 * first.v.len()..].iter_mut().zip(&law.bounds) {
            (unknown.lower, unknown.upper) = (*lower, *upper);
        }
        for (index, event) in events.iter().enumerate() {
            // Impulses keep their order.
            let after = index.checked_sub(1).map_or(0.0, |last| 0.5 * (events[last].time + event.time));
            let before = events.get(index + 1).map_or(duration, |next| 0.5 * (next.time + event.time));
            unknowns.push(Unknown { scale: interval, lower: after, upper: before });
            unknowns.extend(law.noise.iter().map(|noise| free(noise.deviation / duration)));
        }
        let law = Law { events, ..law.motion().ok()? };
        Some(Self { law, first, times, samples, unknowns })
    }

    fn values(&self) -> Vec<f64> {
        let impulse = |event: &Impact| [&[event.time], event.change.as_slice()].concat();
        let impulses = self.law.events.iter().flat_map(impulse).collect::<Vec<_>>();
        [&vec![0.0; self.first.v.len()], self.first.v.as_slice(), &self.law.parameters, &impulses].concat()
    }

    /// Law and start at values of the unknowns.
    fn motion(&self, values: &[f64]) -> (Law, State) {
        let n = self.first.v.len();
        let x = self.law.coordinates.retract(&self.first.x, &values[..n]);
        let (parameters, impulses) = values[2 * n..].split_at(self.law.parameters.len());
        let impulse = |own: &[f64]| Impact { time: own[0], change: own[1..].to_vec() };
        let events = impulses.chunks_exact(1 + n).map(impulse).collect();
        let law = Law { parameters: parameters.to_vec(), events, ..self.law.clone() };
        (law, State { x, v: values[n..2 * n].to_vec() })
    }

    fn states(&self, values: &[f64]) -> Option<Vec<Vec<f64>>> {
        let (law, start) = self.motion(values);
        let states = System::new(&law, Edit::NONE).states(&start, &self.times).ok()?;
        Some(states.into_iter().map(|state| state.x).collect())
    }

    /// The best motion, and which of its impulses are certain and no little beside the largest.
    fn solve(self, window: [f64; 2]) -> Option<(Bounced, Vec<bool>)> {
        let settings = Settings { iterations: CONTACT_ITERATIONS, ..Settings::default() };
        let minimum = minimise(&self, &self.values(), &settings)?;
        let covariance = covariance_of(&minimum.information)?;
        let (mut law, start) = self.motion(&minimum.values);
        let first = 2 * start.v.len();
        let impulses = first + law.parameters.len();
        let are_certain = law.events.iter().enumerate().map(|(index, event)| {
            let row = impulses + index * (1 + start.v.len()) + 1;
            noticeable(&law.events).any(|other| other == event) && is_certain(event, &covariance, row)
        });
        let are_certain = are_certain.collect();
        let deviation = |i: usize| covariance[(i, i)].max(0.0).sqrt();
        law.deviations = (first..first + law.parameters.len()).map(deviation).collect();
        let predicted = self.states(&minimum.values)?;
        let found = Bounced {
            chi_square: self.samples.chi_square_of_flight(&law.coordinates, &predicted),
            free: 0..self.samples.free,
            unknowns: (minimum.values.len() - first) as f64,
            about: Vec::new(),
            window,
            deviations: [0.0; 2],
            error: self.samples.later_error(&law.coordinates, &predicted),
            samples: self.samples,
            times: self.times,
            prior: Vec::new(),
            law,
            start,
            covariance,
            predicted,
        };
        Some((found, are_certain))
    }
}

/// Whether the change of an impulse, whose unknowns begin at a row of the covariance, stands out of its own
/// error as far as a jump of a track has to: samples that are left out beside it may make an outlier one.
fn is_certain(event: &Impact, covariance: &DMatrix<f64>, row: usize) -> bool {
    let size = event.change.len();
    let change = DVector::from_column_slice(&event.change);
    let own = covariance.view((row, row), (size, size)).into_owned();
    let inverse = own.pseudo_inverse(f64::MIN_POSITIVE);
    inverse.is_ok_and(|inverse| change.dot(&(inverse * &change)) > IMPACT_JUMP.powi(2))
}

impl Problem for StruckMotion {
    fn unknowns(&self) -> &[Unknown] {
        &self.unknowns
    }

    fn residuals(&self, values: &[f64]) -> Option<DVector<f64>> {
        let predicted = self.states(values)?;
        let residuals = self.samples.residuals(&self.law.coordinates, &predicted, Later::OfNoise);
        residuals.iter().all(|r| r.is_finite()).then(|| DVector::from_vec(residuals))
    }
}
