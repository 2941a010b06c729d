//! Fits through impacts: start and law from the free flight, then restitution and friction with all of them.

use super::bounced::Bounced;
use crate::candidate::Candidate;
use crate::contact::{Contact, impacts};
use crate::coordinates::State;
use crate::edit::Edit;
use crate::error::MechanicsError;
use crate::explain::check_track;
use crate::fit::{Fitted, Minimum, Problem, Settings, Track, Unknown, first_values, minimise, shoot};
use crate::law::Law;
use crate::system::System;
use crate::thresholds::{
    CONTACT_ITERATIONS, CONTACT_PASSES, CONTACT_SPREAD, FEWEST_TIMES, FRICTIONS, MOST_FRICTION, NEAR_PLANE,
    RESTITUTIONS,
};
use nalgebra::DVector;
use std::ops::Range;

/// Fits a candidate with a contact, whose restitution and friction are to be found, to configurations at
/// ascending times.
///
/// Errors: fewer than five samples before the first impact, faults of the track or of the contact, and a
/// candidate that cannot be fitted.
pub fn fit(
    candidate: &Candidate,
    times: &[f64],
    x: &[Vec<f64>],
    contact: &Contact,
) -> Result<Bounced, MechanicsError> {
    contact.check(&candidate.coordinates)?;
    let x = check_track(std::slice::from_ref(candidate), times, x)?;
    let no_fit = || MechanicsError::NoFit { candidates: 1 };
    let since: Vec<f64> = times.iter().map(|time| time - times[0]).collect();
    let mut free = 0..first_touch(candidate, (&since, &x), contact);
    loop {
        check_track(std::slice::from_ref(candidate), &times[free.clone()], &x[free.clone()])?;
        let track = Track::new(&candidate.coordinates, &since[free.clone()], &x[free.clone()]);
        let fitted = flight(candidate, &track).ok_or_else(no_fit)?;
        let mut law = fitted.law.clone();
        law.contact = Some(contact.clone());
        let met = System::new(&law, Edit::NONE).impacts(&fitted.start, since[free.end - 1])?;
        let kept = met.first().map_or(free.end, |impact| since.partition_point(|time| *time <= impact.time));
        // A flight that goes through the plane holds samples of its impact.
        if (FEWEST_TIMES..free.end).contains(&kept) {
            free.end = kept;
            continue;
        }
        let problem = Bouncing::new(law, (since, x), &track, &fitted);
        return problem.solve(&fitted, free, (times[0], track.independent_samples())).ok_or_else(no_fit);
    }
}

/// Samples before the first impact: before a jump of the centre's velocity, or before a point comes as near
/// to the plane as poses are known.
fn first_touch(candidate: &Candidate, (times, x): (&[f64], &[Vec<f64>]), contact: &Contact) -> usize {
    let place = candidate.coordinates.len() - 3;
    let centers: Vec<[f64; 3]> = x.iter().map(|x| [x[place], x[place + 1], x[place + 2]]).collect();
    let jump = impacts(times, &centers).first().map_or(f64::INFINITY, |impact| impact.time);
    let before = times.partition_point(|time| *time <= jump);
    let near = NEAR_PLANE * contact.extent();
    let touch = x.iter().position(|x| contact.gap(x) <= near).unwrap_or(before);
    before.min(touch)
}

/// The free flight.
fn flight(candidate: &Candidate, track: &Track) -> Option<Fitted> {
    let scales = track.scales(&candidate.coordinates);
    let begin = &track.smooth[0].0;
    let fits = first_values(candidate, track, &scales, 1)
        .into_iter()
        .filter_map(|values| shoot(candidate, track, (&scales, begin), &values, &Settings::default()));
    fits.min_by(|a, b| a.loss.total_cmp(&b.loss))
}

/// Start, parameters, restitution and friction as unknowns.
struct Bouncing {
    law: Law,
    first: State,
    times: Vec<f64>,
    x: Vec<Vec<f64>>,
    levers: Vec<f64>,
    /// Weights of the samples of the free flight, then one for all others.
    weights: Vec<Vec<f64>>,
    later: f64,
    /// Restitution and friction around which both are sought.
    middle: [f64; 2],
    unknowns: Vec<Unknown>,
}

impl Bouncing {
    fn new(law: Law, (times, x): (Vec<f64>, Vec<Vec<f64>>), track: &Track, fitted: &Fitted) -> Self {
        let deviation = |i: usize| fitted.covariance[(i, i)].max(f64::MIN_POSITIVE).sqrt();
        let free = |i| Unknown { scale: deviation(i), lower: f64::NEG_INFINITY, upper: f64::INFINITY };
        let mut unknowns: Vec<Unknown> = (0..fitted.covariance.nrows()).map(free).collect();
        let start = 2 * fitted.start.v.len();
        for (unknown, [lower, upper]) in unknowns[start..].iter_mut().zip(&fitted.bounds) {
            (unknown.lower, unknown.upper) = (*lower, *upper);
        }
        unknowns.push(Unknown { scale: 0.1, lower: 0.0, upper: 1.0 });
        unknowns.push(Unknown { scale: 0.1, lower: 0.0, upper: MOST_FRICTION });
        let levers = law.coordinates.levers();
        let first = fitted.start.clone();
        Self {
            law,
            first,
            times,
            x,
            levers,
            weights: track.weights(),
            later: 0.0,
            middle: [0.0; 2],
            unknowns,
        }
    }

    /// Values at the free flight's fit with a restitution and a friction.
    fn values(&self, [restitution, friction]: [f64; 2]) -> Vec<f64> {
        let still = vec![0.0; self.first.v.len()];
        [&still, self.first.v.as_slice(), &self.law.parameters, &[restitution, friction]].concat()
    }

    /// Law and start at values of the unknowns.
    fn motion(&self, values: &[f64]) -> (Law, State) {
        let n = self.first.v.len();
        let x = self.law.coordinates.retract(&self.first.x, &values[..n]);
        let (parameters, own) = values[2 * n..].split_at(values.len() - 2 * n - 2);
        let mut law = self.law.clone();
        law.parameters = parameters.to_vec();
        if let Some(contact) = &mut law.contact {
            (contact.restitution, contact.friction) = (own[0].clamp(0.0, 1.0), own[1].max(0.0));
        }
        (law, State { x, v: values[n..2 * n].to_vec() })
    }

    /// Differences from the track, `[T][freedoms]`.
    fn differences(&self, values: &[f64]) -> Option<Vec<Vec<f64>>> {
        let (law, start) = self.motion(values);
        let states = System::new(&law, Edit::NONE).states(&start, &self.times).ok()?;
        let pairs = states.iter().zip(&self.x);
        Some(pairs.map(|(state, x)| law.coordinates.difference(x, &state.x)).collect())
    }

    /// Mean distance from the samples after the free flight.
    fn error(&self, values: &[f64]) -> Option<f64> {
        let later = &self.differences(values)?[self.weights.len()..];
        let distance = |change: &Vec<f64>| {
            change.iter().zip(&self.levers).map(|(d, lever)| (lever * d).powi(2)).sum::<f64>().sqrt()
        };
        Some(later.iter().map(distance).sum::<f64>() / later.len().max(1) as f64)
    }

    /// Restitution and friction with the least error over a grid.
    fn coarse(&self) -> Option<([f64; 2], f64)> {
        let pairs = RESTITUTIONS.iter().flat_map(|&e| FRICTIONS.iter().map(move |&f| [e, f]));
        let tried = pairs.filter_map(|pair| Some((pair, self.error(&self.values(pair))?)));
        tried.min_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// Minimum over all unknowns, and the mean distance that it leaves after the free flight.
    fn minimum(&mut self, seen: usize) -> Option<(Minimum, f64)> {
        let (pair, mut error) = self.coarse()?;
        self.middle = pair;
        let settings = Settings { iterations: CONTACT_ITERATIONS, ..Settings::default() };
        let later = (self.x.len() - seen).max(1) as f64;
        let mut values = self.values(pair);
        let mut minimum = None;
        for _ in 0..CONTACT_PASSES {
            // Errors after an impact are those of the model of contact, which all later samples share.
            self.later = if error > 0.0 { 1.0 / (error * later.sqrt()) } else { 0.0 };
            let found = minimise(&*self, &values, &settings)?;
            error = self.error(&found.values)?;
            values.clone_from(&found.values);
            minimum = Some(found);
        }
        Some((minimum?, error))
    }

    fn solve(
        mut self,
        fitted: &Fitted,
        free: Range<usize>,
        (first, track_samples): (f64, f64),
    ) -> Option<Bounced> {
        let (minimum, error) = self.minimum(free.len())?;
        let covariance = minimum.information.pseudo_inverse(f64::MIN_POSITIVE).ok()?;
        let last = covariance.nrows();
        let deviation = |i: usize| covariance[(i, i)].max(0.0).sqrt();
        let (mut law, start) = self.motion(&minimum.values);
        law.deviations = fitted.law.deviations.clone();
        let until = self.times[self.times.len() - 1];
        law.events = System::new(&law, Edit::NONE).impacts(&start, until).ok()?;
        let deviations = [deviation(last - 2), deviation(last - 1)];
        let chi_square = fitted.loss / track_samples.max(1.0);
        Some(Bounced {
            law,
            start,
            free,
            deviations,
            error,
            chi_square,
            covariance,
            window: [first, first + until],
        })
    }
}

impl Problem for Bouncing {
    fn unknowns(&self) -> &[Unknown] {
        &self.unknowns
    }

    fn residuals(&self, values: &[f64]) -> Option<DVector<f64>> {
        let mut residuals = Vec::new();
        for (sample, change) in self.differences(values)?.iter().enumerate() {
            match self.weights.get(sample) {
                Some(weights) => residuals.extend(change.iter().zip(weights).map(|(d, w)| d * w)),
                None => residuals.extend(change.iter().zip(&self.levers).map(|(d, l)| d * l * self.later)),
            }
        }
        let own = &values[values.len() - 2..];
        residuals
            .extend(own.iter().zip(self.middle).map(|(value, middle)| (value - middle) / CONTACT_SPREAD));
        Some(DVector::from_vec(residuals))
    }
}
