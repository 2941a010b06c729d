//! Blocked forecasts: a third of the window by the chosen law, fitted to the other two thirds alone.

use super::known::{distance, points_of};
use super::placed::Placed;
use super::rated::Rated;
use crate::motion::pose::Pose;
use crate::motion::shared_motion::SharedMotion;
use glam::DVec3;
use lgs_mechanics::Candidate;
use lgs_mechanics::fit::{Settings, Track, shoot};
use std::ops::Range;

/// Error of the forecasts of the last third and of the first third of the window by the likeliest law, over
/// the displacement there from the nearest sample that was seen; root mean squares over particles and samples.
/// `None` if a law without those samples cannot be found or followed.
pub(super) fn error(rated: &Rated, bodies: &[&SharedMotion]) -> Option<f64> {
    let count = bodies[0].times.len();
    let third = count / 3;
    let blocked = Blocked::new(rated, bodies)?;
    let last = blocked.squares(0..count - third, count - third..count)?;
    let first = blocked.squares(third..count, 0..third)?;
    let [error, displacement] = [0, 1].map(|i| last[i] + first[i]);
    Some((error / displacement).sqrt()).filter(|error| error.is_finite())
}

/// What forecasts are made of.
struct Blocked<'a> {
    rated: &'a Rated,
    candidate: Candidate,
    track: Track,
    /// The bodies in the order of the coordinates.
    bodies: Vec<&'a SharedMotion>,
    points: Vec<Vec<DVec3>>,
}

impl<'a> Blocked<'a> {
    fn new(rated: &'a Rated, bodies: &[&'a SharedMotion]) -> Option<Self> {
        let system = rated.system();
        let terms = rated.best().judged.fitted.law.terms.clone();
        let candidate = Candidate::new(system.coordinates.clone(), terms).ok()?;
        let first = bodies[0].times[0];
        let times: Vec<f64> = bodies[0].times.iter().map(|time| time - first).collect();
        let track = Track::new(&system.coordinates, &times, &system.x);
        let bodies: Vec<&SharedMotion> = system.order.iter().map(|&body| bodies[body]).collect();
        Some(Self { rated, candidate, track, points: points_of(&bodies), bodies })
    }

    /// Sums over hidden samples of the squared errors of a law fitted to others, and of the squared
    /// displacements from the nearest of these.
    fn squares(&self, seen: Range<usize>, hidden: Range<usize>) -> Option<[f64; 2]> {
        let part = self.track.part(seen.clone());
        let scales = self.track.scales(&self.candidate.coordinates);
        let values = &self.rated.best().judged.fitted.law.parameters;
        let start = &part.smooth[0].0;
        let fitted = shoot(&self.candidate, &part, (&scales, start), values, &Settings::default())?;
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
