//! Draws from the posterior of a law through impacts, and the bands that they make.

use super::bounced::Bounced;
use super::freedom::{OF_MATERIAL, unknowns_of, with_planes_changed};
use crate::bands::{DrawnLaws, StartedLaw, changes, radius};
use crate::coordinates::State;
use crate::edit::Edit;
use crate::error::MechanicsError;
use crate::system::System;
use crate::thresholds::{DRAWS, MOST_FRICTION};

impl Bounced {
    /// Laws drawn from its posterior.
    #[must_use]
    pub fn drawn_laws(&self, count: usize, seed: u64) -> DrawnLaws {
        let middle = StartedLaw { law: self.law.clone(), start: self.start.clone() };
        let drawn = self.drawn(count, (seed, 1)).into_iter().filter(|drawn| drawn.check().is_ok()).collect();
        DrawnLaws { middle, order: vec![0], part: 1.0, drawn }
    }

    /// Radius around the fitted motion that holds 90 % of its posterior, for each time, world units; it
    /// widens at every impact.
    pub fn radius(&self, times: &[f64], seed: u64) -> Result<Vec<f64>, MechanicsError> {
        self.radius_of(&self.drawn(DRAWS, (seed, 0)), &self.since(times))
    }

    /// The same at ascending times of any sign since the start, infinite where too few of the drawn motions
    /// can be followed.
    #[must_use]
    pub fn band(&self, since: &[f64], seed: u64) -> Vec<f64> {
        let drawn = self.drawn(DRAWS, (seed, 0));
        let zero = since.partition_point(|time| *time < 0.0);
        let of = |times: &[f64]| -> Vec<f64> {
            self.radius_of(&drawn, times).unwrap_or_else(|_| vec![f64::INFINITY; times.len()])
        };
        // The past may end at the plane: it is followed step by step.
        let past = (0..zero).map(|k| of(&since[k..k + 1])[0]);
        past.collect::<Vec<_>>().into_iter().chain(of(&since[zero..])).collect()
    }

    /// Radius that holds 90 % of drawn motions at times since the start.
    fn radius_of(&self, drawn: &[StartedLaw], since: &[f64]) -> Result<Vec<f64>, MechanicsError> {
        let middle = System::new(&self.law, Edit::NONE).states(&self.start, since)?;
        let motion =
            |drawn: &StartedLaw| System::new(&drawn.law, Edit::NONE).states(&drawn.start, since).ok();
        let motions: Vec<Option<Vec<State>>> = drawn.iter().map(motion).collect();
        Ok(radius(&motions, &middle, 0.9, &|a, b| self.distance(a, b)))
    }

    /// Laws with their starts. Friction at its bound and a plane that tilts, or a small change of direction
    /// that makes the body miss a wall, are no matter of a normal distribution: draws are accepted by how
    /// much less likely the track makes them than their linearisation says.
    fn drawn(&self, count: usize, stream: (u64, u64)) -> Vec<StartedLaw> {
        let coordinates = &self.law.coordinates;
        let later = self.samples.weigh_later(coordinates, &self.predicted);
        let chi_square = |predicted: &[Vec<f64>]| -> f64 {
            self.samples.residuals(coordinates, predicted, later).iter().map(|r| r * r).sum()
        };
        let least = chi_square(&self.predicted);
        let probability = |change: &[f64], square: f64| {
            let drawn = self.changed(change);
            if !self.is_within_bounds(change) || drawn.check().is_err() {
                return 0.0;
            }
            let Ok(states) = System::new(&drawn.law, Edit::NONE).states(&drawn.start, &self.times) else {
                return 0.0;
            };
            let predicted: Vec<Vec<f64>> = states.into_iter().map(|state| state.x).collect();
            let known = change[change.len() - self.prior.len()..].iter().zip(&self.prior);
            let of_prior: f64 = known.map(|(by, deviation)| (by / deviation).powi(2)).sum();
            (0.5 * (square - of_prior - (chi_square(&predicted) - least))).exp().min(1.0)
        };
        let all = changes(&self.covariance, count, stream, &probability);
        all.iter().map(|change| self.changed(change)).collect()
    }

    /// Whether a change leaves parameters, restitution and friction within their bounds.
    fn is_within_bounds(&self, change: &[f64]) -> bool {
        let first = 2 * self.start.v.len();
        let table = self.law.table();
        let own = table.iter().zip(&self.law.parameters).zip(&change[first..]);
        let own = own.map(|(((parameter, _), value), by)| (value + by, parameter.absolute_bounds()));
        let material = self.law.contact.iter().flat_map(|contact| {
            let by = &change[change.len() - unknowns_of(contact)..];
            [(contact.restitution + by[0], [0.0, 1.0]), (contact.friction + by[1], [0.0, MOST_FRICTION])]
        });
        own.chain(material).all(|(value, [lower, upper])| (lower..=upper).contains(&value))
    }

    /// Law and start after a change of all unknowns, with values beyond their bounds moved to these.
    fn changed(&self, change: &[f64]) -> StartedLaw {
        let n = self.start.v.len();
        let x = self.law.coordinates.retract(&self.start.x, &change[..n]);
        let v = self.start.v.iter().enumerate().map(|(i, v)| v + change[n + i]).collect();
        let mut law = self.law.clone();
        for (i, (parameter, _)) in law.table().iter().enumerate() {
            let [lower, upper] = parameter.absolute_bounds();
            law.parameters[i] = (law.parameters[i] + change[2 * n + i]).clamp(lower, upper);
        }
        let impulses = change[2 * n + law.parameters.len()..].chunks_exact(1 + n);
        law.impulses.iter_mut().zip(impulses).for_each(|(impulse, change)| {
            impulse.time += change[0];
            impulse.change.iter_mut().zip(&change[1..]).for_each(|(v, change)| *v += change);
        });
        if let Some(contact) = &mut law.contact {
            let own = &change[change.len() - unknowns_of(contact)..];
            *contact = with_planes_changed(contact, &self.about, &own[OF_MATERIAL..]);
            contact.restitution = (contact.restitution + own[0]).clamp(0.0, 1.0);
            contact.friction = (contact.friction + own[1]).clamp(0.0, MOST_FRICTION);
        }
        StartedLaw { law, start: State { x, v } }
    }
}
