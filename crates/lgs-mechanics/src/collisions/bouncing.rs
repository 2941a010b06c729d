//! Start, law and contact as the unknowns of one motion through impacts.

use super::bounced::Bounced;
use super::effort::Effort;
use super::freedom::{Freedom, OF_MATERIAL, OF_PLANE, with_planes_changed};
use super::samples::{Later, Samples};
use crate::coordinates::State;
use crate::edit::Edit;
use crate::fit::{Minimum, Problem, Settings, Unknown, covariance_of, minimise};
use crate::law::Law;
use crate::system::System;
use crate::thresholds::{
    CONTACT_ITERATIONS, CONTACT_PASSES, CONTACT_SPREAD, FRICTIONS, MOST_FRICTION, RESTITUTIONS,
};
use nalgebra::DVector;

/// A motion through impacts as a problem of least squares.
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

impl Bouncing {
    /// A motion from a start by a law with a contact, of which each plane has a freedom; `bounds` are those
    /// of the law's parameters, and `scales` those of changes of start, velocity and parameters.
    pub(super) fn new(
        (law, first): (Law, State),
        (times, samples): (Vec<f64>, Samples),
        (bounds, scales): (&[[f64; 2]], &[f64]),
        freedoms: &[Freedom],
        effort: Effort,
    ) -> Self {
        let free = |scale: &f64| Unknown { scale: *scale, lower: f64::NEG_INFINITY, upper: f64::INFINITY };
        let mut unknowns: Vec<Unknown> = scales.iter().map(free).collect();
        let start = 2 * first.v.len();
        for (unknown, [lower, upper]) in unknowns[start..].iter_mut().zip(bounds) {
            (unknown.lower, unknown.upper) = (*lower, *upper);
        }
        unknowns.push(Unknown { scale: 0.1, lower: 0.0, upper: 1.0 });
        unknowns.push(Unknown { scale: 0.1, lower: 0.0, upper: MOST_FRICTION });
        unknowns.extend(freedoms.iter().flat_map(Freedom::deviations).map(|deviation| free(&deviation)));
        let freedoms = freedoms.to_vec();
        let later = Later::OfNoise;
        let middle = [0.0; 2];
        Self { law, first, times, samples, later, middle, freedoms, unknowns, effort }
    }

    /// Values at the start with a restitution and a friction.
    fn values(&self, [restitution, friction]: [f64; 2]) -> Vec<f64> {
        let still = vec![0.0; self.first.v.len()];
        let own = [restitution, friction];
        let planes = vec![0.0; OF_PLANE * self.freedoms.len()];
        [&still, self.first.v.as_slice(), &self.law.parameters, &own, &planes].concat()
    }

    /// Law and start at values of the unknowns.
    fn motion(&self, values: &[f64]) -> (Law, State) {
        let n = self.first.v.len();
        let x = self.law.coordinates.retract(&self.first.x, &values[..n]);
        let (parameters, own) = values[2 * n..].split_at(self.law.parameters.len());
        let about: Vec<[f64; 3]> = self.freedoms.iter().map(|freedom| freedom.about).collect();
        let mut law = self.law.clone();
        law.parameters = parameters.to_vec();
        if let Some(contact) = &mut law.contact {
            *contact = with_planes_changed(contact, &about, &own[OF_MATERIAL..]);
            (contact.restitution, contact.friction) = (own[0].clamp(0.0, 1.0), own[1].max(0.0));
        }
        (law, State { x, v: values[n..2 * n].to_vec() })
    }

    fn states(&self, values: &[f64]) -> Option<Vec<Vec<f64>>> {
        let (law, start) = self.motion(values);
        self.effort.spend(self.times.last()? / law.step)?;
        let system = System::new(&law, Edit::NONE);
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

    /// Minimum over all unknowns, and the mean distance that it leaves after the free flight.
    fn minimum(&mut self, pair: [f64; 2]) -> Option<(Minimum, f64)> {
        self.middle = pair;
        let settings = Settings { iterations: CONTACT_ITERATIONS, ..Settings::default() };
        let mut values = self.values(pair);
        let mut minimum = None;
        for _ in 0..CONTACT_PASSES {
            self.later = self.samples.weigh_later(&self.law.coordinates, &self.states(&values)?);
            let found = minimise(&*self, &values, &settings)?;
            values.clone_from(&found.values);
            minimum = Some(found);
        }
        let error = self.error(&values)?;
        Some((minimum?, error))
    }

    /// The law with its contact from a restitution and friction that are about right.
    pub(super) fn solve(mut self, pair: [f64; 2], first: f64) -> Option<Bounced> {
        let (minimum, error) = self.minimum(pair)?;
        let covariance = covariance_of(&minimum.information)?;
        let deviation = |i: usize| covariance[(i, i)].max(0.0).sqrt();
        let (mut law, start) = self.motion(&minimum.values);
        let until = self.times[self.times.len() - 1];
        law.events = System::new(&law, Edit::NONE).impacts(&start, until).ok()?;
        let n = start.v.len();
        let last = 2 * n + law.parameters.len();
        law.deviations = (2 * n..last).map(deviation).collect();
        let deviations = [deviation(last), deviation(last + 1)];
        law.contact.iter_mut().for_each(|contact| contact.deviations = deviations);
        let predicted = self.states(&minimum.values)?;
        let variance = |i: usize| covariance[(last + OF_MATERIAL + i, last + OF_MATERIAL + i)];
        let freedoms = &self.freedoms;
        let of_plane = |k: usize| freedoms[k].counted(std::array::from_fn(|i| variance(OF_PLANE * k + i)));
        let of_planes: f64 = (0..freedoms.len()).map(of_plane).sum();
        let of_freedoms = freedoms.iter().flat_map(Freedom::deviations);
        Some(Bounced {
            chi_square: self.samples.chi_square_of_flight(&law.coordinates, &predicted),
            free: 0..self.samples.free,
            unknowns: (law.unknown_count() + OF_MATERIAL) as f64 + of_planes,
            about: freedoms.iter().map(|freedom| freedom.about).collect(),
            window: [first, first + until],
            prior: [CONTACT_SPREAD; OF_MATERIAL].into_iter().chain(of_freedoms).collect(),
            samples: self.samples,
            times: self.times,
            law,
            start,
            deviations,
            error,
            covariance,
            predicted,
        })
    }
}

impl Problem for Bouncing {
    fn unknowns(&self) -> &[Unknown] {
        &self.unknowns
    }

    fn residuals(&self, values: &[f64]) -> Option<DVector<f64>> {
        let predicted = self.states(values)?;
        let mut residuals = self.samples.residuals(&self.law.coordinates, &predicted, self.later);
        let own = &values[2 * self.first.v.len() + self.law.parameters.len()..];
        residuals
            .extend(own.iter().zip(self.middle).map(|(value, middle)| (value - middle) / CONTACT_SPREAD));
        let deviations = self.freedoms.iter().flat_map(Freedom::deviations);
        residuals
            .extend(own[OF_MATERIAL..].iter().zip(deviations).map(|(change, deviation)| change / deviation));
        residuals.iter().all(|r| r.is_finite()).then(|| DVector::from_vec(residuals))
    }
}
