//! Blocked forecasts: a third of the window by the chosen law, fitted to the other two thirds alone, beside
//! those of free motion in the same coordinates.

use super::known::{distance, points_of};
use super::placed::Placed;
use super::rated::Rated;
use crate::motion::pose::Pose;
use crate::motion::shared_motion::SharedMotion;
use glam::DVec3;
use lgs_mechanics::fit::{Settings, Track, shoot};
use lgs_mechanics::terms::Term;
use lgs_mechanics::{Candidate, TRUSTED_FRACTION};
use std::ops::Range;

/// Errors of the forecasts of the last third and of the first third of the window, over the displacement
/// there from the nearest sample that was seen; root mean squares over particles and samples. `None` for what
/// cannot be fitted without those samples, or not be followed, and for normal modes.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ForecastErrors {
    /// By the likeliest law.
    pub(crate) law: Option<f64>,
    /// By free motion.
    pub(super) free: Option<f64>,
}

impl ForecastErrors {
    pub(super) fn of(rated: &Rated, bodies: &[&SharedMotion]) -> Self {
        let law = &rated.best().judged.fitted.law;
        let Some(blocked) = Blocked::new(rated, bodies) else { return Self::default() };
        let error = |terms: Vec<Term>, values: &[f64]| {
            let candidate = Candidate::new(rated.system().coordinates.clone(), terms).ok()?;
            blocked.error(&candidate, values)
        };
        let (of_coordinates, _) = law.parameters.split_at(law.coordinates.start().len());
        Self { law: error(law.terms.clone(), &law.parameters), free: error(Vec::new(), of_coordinates) }
    }

    /// Whether free motion forecasts better than a law whose forecasts are not to be trusted.
    pub(super) fn free_is_better(&self) -> bool {
        self.law.is_some_and(|law| law > TRUSTED_FRACTION && self.free.is_some_and(|free| free < law))
    }
}

/// What forecasts are made of.
struct Blocked<'a> {
    rated: &'a Rated,
    track: Track,
    /// The bodies in the order of the coordinates.
    bodies: Vec<&'a SharedMotion>,
    points: Vec<Vec<DVec3>>,
}

impl<'a> Blocked<'a> {
    fn new(rated: &'a Rated, bodies: &[&'a SharedMotion]) -> Option<Self> {
        let system = rated.system();
        // Normal modes that were fitted with their law have no amplitudes of their own at the samples.
        if system.x.len() != bodies[0].times.len() {
            return None;
        }
        let first = bodies[0].times[0];
        let times: Vec<f64> = bodies[0].times.iter().map(|time| time - first).collect();
        let track = Track::new(&system.coordinates, &times, &system.x);
        let bodies: Vec<&SharedMotion> = system.order.iter().map(|&body| bodies[body]).collect();
        Some(Self { rated, track, points: points_of(&bodies), bodies })
    }

    /// The error of both forecasts; `values` are those that the fits start from.
    fn error(&self, candidate: &Candidate, values: &[f64]) -> Option<f64> {
        let count = self.track.times.len();
        let third = count / 3;
        let last = self.squares((candidate, values), 0..count - third, count - third..count)?;
        let first = self.squares((candidate, values), third..count, 0..third)?;
        let [error, displacement] = [0, 1].map(|i| last[i] + first[i]);
        Some((error / displacement).sqrt()).filter(|error| error.is_finite())
    }

    /// Sums over hidden samples of the squared errors of a law fitted to others, and of the squared
    /// displacements from the nearest of these.
    fn squares(
        &self,
        (candidate, values): (&Candidate, &[f64]),
        seen: Range<usize>,
        hidden: Range<usize>,
    ) -> Option<[f64; 2]> {
        let part = self.track.part(seen.clone());
        let scales = self.track.scales(&candidate.coordinates);
        let start = &part.smooth[0].0;
        let fitted = shoot(candidate, &part, (&scales, start), values, &Settings::default())?;
        let begin = self.track.times[seen.start];
        let times: Vec<f64> = self.track.times[hidden.clone()].iter().map(|time| time - begin).collect();
        let forecast = Placed::new(self.rated.system(), &fitted).poses(&times)?;
        let nearest = self.observed(if hidden.start > seen.start { seen.end - 1 } else { seen.start });
        let pairs = hidden.zip(&forecast).map(|(sample, poses)| (self.observed(sample), poses));
        Some(pairs.fold([0.0; 2], |[error, displacement], (observed, poses)| {
            let from = |other: &[Pose]| distance(&self.points, &observed, other).powi(2);
            [error + from(poses), displacement + from(&nearest)]
        }))
    }

    fn observed(&self, sample: usize) -> Vec<Pose> {
        self.bodies.iter().map(|motion| motion.poses[sample]).collect()
    }
}
