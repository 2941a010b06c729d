//! A law with its contact or the impulses that it receives, and how far it is known.

use super::samples::Samples;
use super::thresholds::{KNOWN_OF_HIT, NEAR_PLANE, SAME_NOISE};
use crate::bands::Verdict;
use crate::choose::DESCRIBED;
use crate::contact::{Contact, Ground};
use crate::coordinates::State;
use crate::edit::Edit;
use crate::error::MechanicsError;
use crate::fit::Fitted;
use crate::law::Law;
use crate::system::System;
use crate::thresholds::COMPARED_TIMES;
use nalgebra::DMatrix;
use std::ops::Range;

/// A law with the contact and the impulses that were fitted to a track.
#[derive(Clone, Debug)]
pub struct Bounced {
    /// The law with its contact, if it has one, whose impacts are those of the fitted motion within the
    /// track, and its impulses.
    pub law: Law,
    /// State at the first time of the track.
    pub start: State,
    /// Samples of the free flight before the first impact.
    pub free: Range<usize>,
    /// Standard deviations of restitution and friction.
    pub deviations: [f64; 2],
    /// Mean distance from the track after the first impact, world units; 0 without any.
    pub error: f64,
    /// Whitened χ² of the free flight for each independent sample.
    pub chi_square: f64,
    /// Configurations of the fitted motion at the times of the track.
    pub predicted: Vec<Vec<f64>>,
    /// Unknowns of law, contact and plane, the start left out.
    pub(super) unknowns: f64,
    /// Covariance of start, velocity, parameters, time and change of every impulse, and of a contact
    /// restitution, friction, tilts and shift of every plane.
    pub(super) covariance: DMatrix<f64>,
    /// Points about which the planes tilt.
    pub(super) about: Vec<[f64; 3]>,
    pub(super) samples: Samples,
    /// Times of the samples since the first one.
    pub(super) times: Vec<f64>,
    /// Standard deviations by which the last unknowns were known before the track.
    pub(super) prior: Vec<f64>,
    /// First and last time of the track.
    pub(super) window: [f64; 2],
}

impl Bounced {
    /// A fitted law that has met nothing yet, with a contact that it is expected to meet: restitution and
    /// friction are those of the contact with its deviations, the plane is as well known as `ground` says.
    #[must_use]
    pub fn expecting(fitted: &Fitted, contact: Contact, ground: &Ground, window: [f64; 2]) -> Self {
        let [restitution, friction] = contact.deviations;
        let own = [vec![restitution, friction], deviations_of(ground, &contact)].concat();
        let covariance = with_independent(&fitted.covariance, &own);
        Self {
            law: Law { contact: Some(contact), ..fitted.law.clone() },
            start: fitted.start.clone(),
            free: 0..0,
            deviations: [restitution, friction],
            error: 0.0,
            chi_square: 0.0,
            predicted: Vec::new(),
            unknowns: 0.0,
            covariance,
            about: vec![ground.middle],
            samples: Samples::default(),
            times: Vec::new(),
            prior: Vec::new(),
            window,
        }
    }

    /// The same if so many of its impulses are hits of which other bodies tell: time, place and direction of
    /// each are known then, and its size but for the mass of the body.
    pub(super) fn knowing_hits(mut self, count: usize) -> Self {
        self.unknowns -= (KNOWN_OF_HIT * count) as f64;
        self
    }

    /// The same with a further plane at rest, of which the track tells nothing.
    #[must_use]
    pub fn with_wall(mut self, ground: &Ground) -> Self {
        if let Some(contact) = self.law.contact.as_mut() {
            self.covariance = with_independent(&self.covariance, &deviations_of(ground, contact));
            contact.walls.push(ground.plane);
            self.about.push(ground.middle);
        }
        self
    }

    /// The fitted motion at times of the track's clock.
    pub fn states(&self, times: &[f64]) -> Result<Vec<State>, MechanicsError> {
        System::new(&self.law, Edit::NONE).states(&self.start, &self.since(times))
    }

    /// Time of the first impact since the start, up to a time.
    #[must_use]
    pub fn first_impact(&self, until: f64) -> Option<f64> {
        let met = System::new(&self.law, Edit::NONE).impacts(&self.start, until).ok()?;
        met.first().map(|impact| impact.time)
    }

    /// Whether the motion stays within the noise of the track, before and after impacts.
    #[must_use]
    pub fn is_within_noise(&self) -> bool {
        self.chi_square <= DESCRIBED
            && self.samples.is_within_noise_later(&self.law.coordinates, &self.predicted)
    }

    /// Length of the fitted path at the times of the track, world units.
    #[must_use]
    pub fn path(&self) -> f64 {
        let levers = self.law.coordinates.levers();
        let step = |pair: &[Vec<f64>]| {
            let change = self.law.coordinates.difference(&pair[0], &pair[1]);
            change.iter().zip(&levers).map(|(d, lever)| (lever * d).powi(2)).sum::<f64>().sqrt()
        };
        self.predicted.windows(2).map(step).sum()
    }

    /// Evidence of the law against other motions: χ² with the penalty of all unknowns, smaller for likelier.
    #[must_use]
    pub fn evidence(&self) -> f64 {
        self.evidence_of(&self.predicted, self.unknowns)
    }

    /// The same of other configurations at the times of the track, by a law with so many unknowns beside its
    /// start.
    #[must_use]
    pub fn evidence_of(&self, predicted: &[Vec<f64>], unknowns: f64) -> f64 {
        self.samples.evidence(&self.law.coordinates, predicted, unknowns)
    }

    /// Whether it is likelier than another motion through the same samples. What an impact leaves of flights
    /// that do not end at it looks like noise: where one of two motions leaves far less, both are judged by
    /// its noise.
    pub(super) fn is_likelier_than(&self, other: &Self) -> bool {
        let by = |judge: &Self, of: &Self| judge.evidence_of(&of.predicted, of.unknowns);
        if self.is_sharper_than(other) {
            by(self, self) < by(self, other)
        } else if other.is_sharper_than(self) {
            by(other, self) < by(other, other)
        } else {
            self.evidence() < other.evidence()
        }
    }

    /// Whether its flights leave far less noise than those of another motion.
    pub(super) fn is_sharper_than(&self, other: &Self) -> bool {
        self.samples.sharpness() > other.samples.sharpness() + SAME_NOISE.ln()
    }

    /// Distance of two states, world units: root mean square over the points of the body.
    #[must_use]
    pub fn distance(&self, a: &State, b: &State) -> f64 {
        let change = self.law.coordinates.difference(&a.x, &b.x);
        change
            .iter()
            .zip(self.law.coordinates.levers())
            .map(|(d, lever)| (lever * d).powi(2))
            .sum::<f64>()
            .sqrt()
    }

    /// The verdict, and the time until which the radius stays within `tolerance` times the path moved until
    /// then: explained needs half a window beyond the track.
    pub fn verdict(&self, tolerance: f64, seed: u64) -> Result<(Verdict, f64), MechanicsError> {
        let [first, last] = self.window;
        let time = |k: usize| first + (last - first) * k as f64 / COMPARED_TIMES as f64;
        let times: Vec<f64> = (0..=3 * COMPARED_TIMES).map(time).collect();
        let states = self.states(&times)?;
        let mut path: Vec<f64> = vec![0.0];
        for pair in states.windows(2) {
            path.push(path[path.len() - 1] + self.distance(&pair[0], &pair[1]));
        }
        let radii = self.radius(&times, seed)?;
        let good = |k: &usize| radii[*k] <= tolerance * path[(*k).max(COMPARED_TIMES)];
        let trusted = (0..times.len()).take_while(good).last().map_or(first, time);
        let verdict = if self.chi_square > DESCRIBED || self.error > tolerance * path[COMPARED_TIMES] {
            Verdict::Outside
        } else if trusted < time(COMPARED_TIMES + COMPARED_TIMES / 2) {
            Verdict::Described
        } else {
            Verdict::Explained
        };
        Ok((verdict, trusted))
    }

    /// Times since the first one of the track.
    pub(super) fn since(&self, times: &[f64]) -> Vec<f64> {
        times.iter().map(|time| time - self.window[0]).collect()
    }
}

/// The motion with the best evidence.
pub(super) fn likeliest(found: impl Iterator<Item = Bounced>) -> Option<Bounced> {
    found.reduce(|best, next| if next.is_likelier_than(&best) { next } else { best })
}

/// Standard deviations of the tilts and of the shift of a plane at rest that a body has not met.
fn deviations_of(ground: &Ground, contact: &Contact) -> Vec<f64> {
    let extent = contact.extent();
    let tilt = ground.tilt_deviation(extent);
    vec![tilt, tilt, (NEAR_PLANE * extent).hypot(ground.roughness)]
}

/// A covariance with further unknowns that are independent of all others.
fn with_independent(covariance: &DMatrix<f64>, deviations: &[f64]) -> DMatrix<f64> {
    let (known, all) = (covariance.nrows(), covariance.nrows() + deviations.len());
    let mut whole = covariance.clone().resize(all, all, 0.0);
    deviations.iter().enumerate().for_each(|(i, deviation)| {
        whole[(known + i, known + i)] = deviation.powi(2);
    });
    whole
}
