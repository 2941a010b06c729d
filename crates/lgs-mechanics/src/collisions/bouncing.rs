//! Start, law, impulses and contact as the unknowns of one motion through impacts.

use super::bounced::Bounced;
use super::effort::Effort;
use super::freedom::{Freedom, OF_MATERIAL, OF_PLANE, with_planes_changed};
use super::laws::FlightLaw;
use super::samples::{Later, Samples};
use super::thresholds::{CONTACT_ITERATIONS, CONTACT_PASSES, CONTACT_SPREAD, FRICTIONS, RESTITUTIONS};
use crate::contact::{Impact, noticeable};
use crate::coordinates::State;
use crate::edit::Edit;
use crate::fit::{Minimum, Problem, Settings, Unknown, covariance_of, minimise};
use crate::law::Law;
use crate::system::System;
use crate::thresholds::{IMPACT_JUMP, MOST_FRICTION};
use nalgebra::{DMatrix, DVector};

/// A motion through impacts and impulses as a problem of least squares. Unknowns are the change of the start
/// `[n]`, its velocity `[n]`, the law's parameters, time and change `[n]` of every impulse, and of a contact
/// restitution, friction, and tilts and shift of every plane.
pub(super) struct Bouncing {
    law: Law,
    first: State,
    times: Vec<f64>,
    samples: Samples,
    later: Later,
    /// Restitution and friction around which both are sought.
    middle: [f64; 2],
    /// How far each plane may be from where the law has it.
    freedoms: Vec<Freedom>,
    unknowns: Vec<Unknown>,
    effort: Effort,
}

/// Values of the unknowns.
struct Values<'a> {
    /// Change of the start, and its velocity.
    x: &'a [f64],
    v: &'a [f64],
    parameters: &'a [f64],
    impulses: &'a [f64],
    /// Restitution, friction and changes of planes; empty without a contact.
    contact: &'a [f64],
}

impl Bouncing {
    /// A motion from the start of the first of some flights, by a law with the impulses and the contact that
    /// it may have, of whose planes each has a freedom; starts and parameters are told by so long a time.
    pub(super) fn new(
        flights: &FlightLaw,
        law: Law,
        (times, samples): (Vec<f64>, Samples),
        duration: f64,
        freedoms: &[Freedom],
    ) -> Self {
        let first = flights.flights[0].1.clone();
        let free = |scale: f64| Unknown { scale, lower: f64::NEG_INFINITY, upper: f64::INFINITY };
        let mut unknowns: Vec<Unknown> = flights.scales_of_changes(duration).into_iter().map(free).collect();
        let start = 2 * first.v.len();
        for (unknown, [lower, upper]) in unknowns[start..].iter_mut().zip(&flights.bounds) {
            (unknown.lower, unknown.upper) = (*lower, *upper);
        }
        unknowns.extend(of_impulses(&law.impulses, flights, &times));
        if law.contact.is_some() {
            unknowns.push(Unknown { scale: 0.1, lower: 0.0, upper: 1.0 });
            unknowns.push(Unknown { scale: 0.1, lower: 0.0, upper: MOST_FRICTION });
            unknowns.extend(freedoms.iter().flat_map(Freedom::deviations).map(free));
        }
        let (freedoms, effort) = (freedoms.to_vec(), flights.effort.clone());
        let (later, middle) = (Later::OfNoise, [0.0; 2]);
        Self { law, first, times, samples, later, middle, freedoms, unknowns, effort }
    }

    /// Values at the start with a restitution and a friction.
    fn values(&self, pair: [f64; 2]) -> Vec<f64> {
        let still = vec![0.0; self.first.v.len()];
        let impulse = |impulse: &Impact| [&[impulse.time], impulse.change.as_slice()].concat();
        let impulses: Vec<f64> = self.law.impulses.iter().flat_map(impulse).collect();
        let mut values = [&still, self.first.v.as_slice(), &self.law.parameters, &impulses].concat();
        if self.law.contact.is_some() {
            values.extend(pair);
            values.resize(values.len() + OF_PLANE * self.freedoms.len(), 0.0);
        }
        values
    }

    fn split<'a>(&self, values: &'a [f64]) -> Values<'a> {
        let n = self.first.v.len();
        let (x, rest) = values.split_at(n);
        let (v, rest) = rest.split_at(n);
        let (parameters, rest) = rest.split_at(self.law.parameters.len());
        let (impulses, contact) = rest.split_at((1 + n) * self.law.impulses.len());
        Values { x, v, parameters, impulses, contact }
    }

    /// Law and start at values of the unknowns.
    fn motion(&self, values: &[f64]) -> (Law, State) {
        let Values { x, v, parameters, impulses, contact: own } = self.split(values);
        let impulse = |own: &[f64]| Impact { time: own[0], change: own[1..].to_vec() };
        let mut law = Law {
            parameters: parameters.to_vec(),
            impulses: impulses.chunks_exact(1 + v.len()).map(impulse).collect(),
            ..self.law.clone()
        };
        if let Some(contact) = &mut law.contact {
            let about: Vec<[f64; 3]> = self.freedoms.iter().map(|freedom| freedom.about).collect();
            *contact = with_planes_changed(contact, &about, &own[OF_MATERIAL..]);
            (contact.restitution, contact.friction) = (own[0].clamp(0.0, 1.0), own[1].max(0.0));
        }
        let x = self.law.coordinates.retract(&self.first.x, x);
        (law, State { x, v: v.to_vec() })
    }

    fn states(&self, values: &[f64]) -> Option<Vec<Vec<f64>>> {
        let (law, start) = self.motion(values);
        let system = System::new(&law, Edit::NONE);
        if law.contact.is_some() {
            self.effort.spend(self.times.last()? / law.step)?;
        }
        let (states, followed) = system.states_and_contacts(&start, &self.times).ok()?;
        self.effort.spend(followed as f64);
        Some(states.into_iter().map(|state| state.x).collect())
    }

    /// Mean distance from the samples after the free flight.
    fn error(&self, values: &[f64]) -> Option<f64> {
        Some(self.samples.later_error(&self.law.coordinates, &self.states(values)?))
    }

    /// Restitution and friction with the least error over a grid, and the error.
    pub(super) fn coarse(&self) -> Option<([f64; 2], f64)> {
        let pairs = RESTITUTIONS.iter().flat_map(|&e| FRICTIONS.iter().map(move |&f| [e, f]));
        let tried = pairs.filter_map(|pair| Some((pair, self.error(&self.values(pair))?)));
        tried.min_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// Minimum over all unknowns. Where there is a contact, whose model errs, samples after the free flight
    /// count by what the passes before have left of them.
    fn minimum(&mut self, pair: [f64; 2]) -> Option<Minimum> {
        self.middle = pair;
        let settings = Settings { iterations: CONTACT_ITERATIONS, ..Settings::default() };
        let mut values = self.values(pair);
        if self.law.contact.is_none() {
            return minimise(&*self, &values, &settings);
        }
        let mut minimum = None;
        for _ in 0..CONTACT_PASSES {
            self.later = self.samples.weigh_later(&self.law.coordinates, &self.states(&values)?);
            let found = minimise(&*self, &values, &settings)?;
            values.clone_from(&found.values);
            minimum = Some(found);
        }
        minimum
    }

    /// The best motion from a restitution and friction that are about right, and which of its impulses are
    /// certain and no little beside the largest; `first` is the first time of the track.
    pub(super) fn solve(mut self, pair: [f64; 2], first: f64) -> Option<(Bounced, Vec<bool>)> {
        let minimum = self.minimum(pair)?;
        let covariance = covariance_of(&minimum.information)?;
        let deviation = |i: usize| covariance[(i, i)].max(0.0).sqrt();
        let (mut law, start) = self.motion(&minimum.values);
        let predicted = self.states(&minimum.values)?;
        let until = self.times[self.times.len() - 1];
        let parameters = 2 * start.v.len();
        let impulses = parameters + law.parameters.len();
        law.deviations = (parameters..impulses).map(deviation).collect();
        let of_contact = impulses + (1 + start.v.len()) * law.impulses.len();
        if let Some(contact) = &mut law.contact {
            contact.deviations = [deviation(of_contact), deviation(of_contact + 1)];
            law.impacts = System::new(&law, Edit::NONE).impacts(&start, until).ok()?;
        }
        let are_certain = are_certain(&law.impulses, &covariance, impulses);
        let found = Bounced {
            chi_square: self.samples.chi_square_of_flight(&law.coordinates, &predicted),
            error: self.samples.later_error(&law.coordinates, &predicted),
            free: 0..self.samples.free,
            unknowns: (law.unknown_count() + of_contact - impulses) as f64
                + self.counted_of_contact(&covariance, of_contact),
            about: self.freedoms.iter().map(|freedom| freedom.about).collect(),
            window: [first, first + until],
            prior: self.known_of_contact(),
            samples: self.samples,
            times: self.times,
            deviations: law.contact.as_ref().map_or([0.0; 2], |contact| contact.deviations),
            law,
            start,
            covariance,
            predicted,
        };
        Some((found, are_certain))
    }

    /// How many unknowns of the contact count, which begin at a row of the covariance; none without one.
    fn counted_of_contact(&self, covariance: &DMatrix<f64>, row: usize) -> f64 {
        let variance = |i: usize| covariance[(row + OF_MATERIAL + i, row + OF_MATERIAL + i)];
        let of_plane = |(k, freedom): (usize, &Freedom)| {
            freedom.counted(std::array::from_fn(|i| variance(OF_PLANE * k + i)))
        };
        let of_material = if self.law.contact.is_some() { OF_MATERIAL } else { 0 };
        of_material as f64 + self.freedoms.iter().enumerate().map(of_plane).sum::<f64>()
    }

    /// Standard deviations by which the unknowns of the contact were known before the track.
    fn known_of_contact(&self) -> Vec<f64> {
        if self.law.contact.is_none() {
            return Vec::new();
        }
        let of_planes = self.freedoms.iter().flat_map(Freedom::deviations);
        [CONTACT_SPREAD; OF_MATERIAL].into_iter().chain(of_planes).collect()
    }
}

/// The unknowns of impulses: they keep their order.
fn of_impulses(impulses: &[Impact], flights: &FlightLaw, times: &[f64]) -> Vec<Unknown> {
    let duration = times[times.len() - 1];
    let interval = duration / (times.len() - 1).max(1) as f64;
    let of_impulse = |(index, impulse): (usize, &Impact)| {
        let after = index.checked_sub(1).map_or(0.0, |last| 0.5 * (impulses[last].time + impulse.time));
        let before = impulses.get(index + 1).map_or(duration, |next| 0.5 * (next.time + impulse.time));
        let time = Unknown { scale: interval, lower: after, upper: before };
        let change = flights.noise.iter().map(|noise| Unknown {
            scale: noise.deviation / duration,
            lower: f64::NEG_INFINITY,
            upper: f64::INFINITY,
        });
        std::iter::once(time).chain(change).collect::<Vec<_>>()
    };
    impulses.iter().enumerate().flat_map(of_impulse).collect()
}

/// Which impulses, whose unknowns begin at a row of the covariance, are certain and no little beside the
/// largest.
fn are_certain(impulses: &[Impact], covariance: &DMatrix<f64>, row: usize) -> Vec<bool> {
    let is = |(index, impulse): (usize, &Impact)| {
        let row = row + index * (1 + impulse.change.len()) + 1;
        noticeable(impulses).any(|other| other == impulse) && is_certain(impulse, covariance, row)
    };
    impulses.iter().enumerate().map(is).collect()
}

/// Whether the change of an impulse, which begins at a row of the covariance, stands out of its own error as
/// far as a jump of a track has to: samples that are left out beside it may make an outlier one.
fn is_certain(impulse: &Impact, covariance: &DMatrix<f64>, row: usize) -> bool {
    let size = impulse.change.len();
    let change = DVector::from_column_slice(&impulse.change);
    let own = covariance.view((row, row), (size, size)).into_owned();
    let inverse = own.pseudo_inverse(f64::MIN_POSITIVE);
    inverse.is_ok_and(|inverse| change.dot(&(inverse * &change)) > IMPACT_JUMP.powi(2))
}

impl Problem for Bouncing {
    fn unknowns(&self) -> &[Unknown] {
        &self.unknowns
    }

    fn residuals(&self, values: &[f64]) -> Option<DVector<f64>> {
        let predicted = self.states(values)?;
        let mut residuals = self.samples.residuals(&self.law.coordinates, &predicted, self.later);
        if let [restitution, friction, planes @ ..] = self.split(values).contact {
            let material = [restitution, friction].into_iter().zip(self.middle);
            residuals.extend(material.map(|(value, middle)| (value - middle) / CONTACT_SPREAD));
            let deviations = self.freedoms.iter().flat_map(Freedom::deviations);
            residuals.extend(planes.iter().zip(deviations).map(|(change, deviation)| change / deviation));
        }
        residuals.iter().all(|r| r.is_finite()).then(|| DVector::from_vec(residuals))
    }
}
