//! What a fit through impacts is given.

use crate::candidate::Candidate;
use crate::contact::{Ground, Surface};
use crate::coordinates::Coordinates;
use crate::noise::SampleTimes;
use std::ops::Range;

/// A body that may collide.
#[derive(Clone, Debug)]
pub struct Body {
    /// Of a point or of a rigid body.
    pub coordinates: Coordinates,
    /// Laws that its centre may follow, in coordinates of a point.
    pub centers: Vec<Candidate>,
    /// Laws that its rotation may follow, in those of a ball joint without an arm; none for a point.
    pub spins: Vec<Candidate>,
    /// The surface by which it touches, in its principal axes.
    pub surface: Surface,
    /// Planes of points at rest.
    pub grounds: Vec<Ground>,
    /// Whether its inertia is that of points which may be its surface alone.
    pub is_shell: bool,
    /// Times at which others are struck that this one touches then, in the clock of its track, ascending.
    pub hits: Vec<f64>,
}

impl Body {
    /// The same, which moves freely between impacts.
    pub(super) fn moving_freely(&self) -> Self {
        let free = |laws: &[Candidate]| laws.iter().filter(|law| law.terms.is_empty()).cloned().collect();
        Self { centers: free(&self.centers), spins: free(&self.spins), ..self.clone() }
    }
}

/// Configurations of a body at ascending times.
#[derive(Clone, Copy, Debug)]
pub struct Observed<'a> {
    /// Times.
    pub times: &'a [f64],
    /// Configurations, with quaternions whose signs are continuous.
    pub x: &'a [Vec<f64>],
    /// Standard deviation of each configuration in units of the usual one; empty where all are alike.
    pub deviations: &'a [f64],
    /// Standard deviations, of rotations (radians) and places, below which nothing is known.
    pub least: [f64; 2],
}

impl Observed<'_> {
    /// Times since the first.
    pub(super) fn since(&self) -> Vec<f64> {
        self.times.iter().map(|time| time - self.times[0]).collect()
    }

    /// Times and deviations of some samples.
    pub(super) fn samples(&self, range: Range<usize>) -> SampleTimes<'_> {
        SampleTimes {
            times: &self.times[range.clone()],
            deviations: self.deviations.get(range).unwrap_or_default(),
        }
    }

    /// Centres.
    pub(super) fn centers(&self) -> Vec<[f64; 3]> {
        let center = |x: &Vec<f64>| std::array::from_fn(|i| x[x.len() - 3 + i]);
        self.x.iter().map(center).collect()
    }
}
